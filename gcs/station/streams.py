"""What telemetry a station asks for, and how it makes sure that it comes."""

from collections.abc import Iterator, Mapping

from ...transport.mavlink import Message, mav
from .commands import RETRY_S, Commands, Request

_SET_INTERVAL: int = mav.MAV_CMD_SET_MESSAGE_INTERVAL
NEVER = -1.0


class PrivateStreams:
    """Asks one of our own vehicles on its private link for all it needs at once, and no more."""

    def __init__(self, rate_hz: float, *, altitude: bool) -> None:
        interval_us = 1e6 / rate_hz
        self._wanted = {
            mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED: interval_us,
            mav.MAVLINK_MSG_ID_ATTITUDE: 2 * interval_us,
            mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 1e6 if altitude else NEVER,
            mav.MAVLINK_MSG_ID_VFR_HUD: NEVER,
            mav.MAVLINK_MSG_ID_GPS_RAW_INT: NEVER,
            mav.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: NEVER,
        }
        self._unanswered = len(self._wanted)
        self._due = 0.0

    def take_ack(self, m: Message) -> bool:
        """Return whether an ACK is one of those that are awaited here."""
        if m.command != _SET_INTERVAL or self._unanswered <= 0:
            return False
        self._unanswered -= 1
        return True

    def due(self, commands: Commands, now: float) -> list[Message]:
        """Return the requests, again until each has been answered."""
        if self._unanswered <= 0 or now < self._due:
            return []
        self._due = now + RETRY_S
        self._unanswered = len(self._wanted)
        return [
            commands.message(_SET_INTERVAL, (message_id, interval_us))
            for message_id, interval_us in self._wanted.items()
        ]


_CHECK_S = 5.0  # a stream that has brought less than half by then is asked for again
_REFUSED_S = 60.0  # before one that was refused is asked for again
_FASTEST_US = 30_000.0  # an ArduRover refuses what is faster than 40 Hz
_REQUEST_DATA_STREAM: dict[int, int] = {  # the older way, in groups
    mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED: mav.MAV_DATA_STREAM_POSITION,
    mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: mav.MAV_DATA_STREAM_POSITION,
    mav.MAVLINK_MSG_ID_ATTITUDE: mav.MAV_DATA_STREAM_EXTRA1,
    mav.MAVLINK_MSG_ID_SYS_STATUS: mav.MAV_DATA_STREAM_EXTENDED_STATUS,
    mav.MAVLINK_MSG_ID_GPS_RAW_INT: mav.MAV_DATA_STREAM_EXTENDED_STATUS,
}


class WatchedStreams:
    """Asks an external vehicle for telemetry, message by message, and sees that it comes.

    It is asked again when a stream stays away or comes at less than half its rate: before its
    estimator has an origin, after a reboot, or when another station has slowed it down. `also`:
    what else is wanted, by message id, and at which interval in us.
    """

    def __init__(self, rate_hz: float, also: Mapping[int, float] | None = None) -> None:
        interval_us = max(_FASTEST_US, 1e6 / rate_hz)
        # Few different intervals: ArduPilot has ten for each link, and rounds to the nearest.
        self._wanted = {
            mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED: interval_us,
            mav.MAVLINK_MSG_ID_ATTITUDE: 2 * interval_us,
            mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 5e5,
            mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5e5,
            mav.MAVLINK_MSG_ID_SYS_STATUS: 1e6,
            mav.MAVLINK_MSG_ID_GPS_RAW_INT: 1e6,
            mav.MAVLINK_MSG_ID_BATTERY_STATUS: 1e6,
            mav.MAVLINK_MSG_ID_MISSION_CURRENT: 1e6,
            **(also or {}),
        }
        self._request: Request | None = None
        self._asked = 0  # message id
        self.restart()

    def restart(self) -> None:
        """Ask for everything: the vehicle has forgotten what it was asked."""
        self._missing = list(self._wanted)
        self._counts = dict.fromkeys(self._wanted, 0)
        self._refused_at: dict[int, float] = {}
        self._window_from: float | None = None

    def hear(self, m: Message) -> None:
        """Count a message."""
        if m.get_msgId() in self._counts:
            self._counts[m.get_msgId()] += 1

    def due(self, commands: Commands, now: float) -> Iterator[Message]:
        """Have the next request made; yield what goes out beside the commands."""
        if self._request is not None:
            if not self._request.done:
                return
            if self._request.refused:
                yield from self._ask_the_older_way(commands, now)
            self._request = None
        if self._missing:
            self._window_from = None
            self._asked = self._missing.pop(0)
            params = (self._asked, self._wanted[self._asked])
            self._request = commands.ask(_SET_INTERVAL, params, "telemetry", now)
        elif self._window_from is None:
            self._window_from = now
            self._counts = dict.fromkeys(self._wanted, 0)
        elif now - self._window_from >= _CHECK_S:
            self._missing = [m for m in self._wanted if self._stays_away(m, now)]
            self._window_from = None

    def _stays_away(self, message_id: int, now: float) -> bool:
        if now - self._refused_at.get(message_id, -_REFUSED_S) < _REFUSED_S:
            return False
        return self._counts[message_id] < _CHECK_S * 1e6 / self._wanted[message_id] / 2

    def _ask_the_older_way(self, commands: Commands, now: float) -> Iterator[Message]:
        self._refused_at[self._asked] = now
        group = _REQUEST_DATA_STREAM.get(self._asked)
        if group is not None:
            to = (commands.system_id, mav.MAV_COMP_ID_AUTOPILOT1)
            rate = max(1, round(1e6 / self._wanted[self._asked]))
            yield mav.MAVLink_request_data_stream_message(*to, group, rate, 1)
