"""Which telemetry a link gets, and when: one `Streams` for each link."""

from ...transport.mavlink import mav
from ..config import SLICE_US

_LONGEST_US = 2**31 - 1  # what MESSAGE_INTERVAL can say

DEFAULT_RATES_HZ: dict[int, float] = {
    mav.MAVLINK_MSG_ID_HEARTBEAT: 1,
    mav.MAVLINK_MSG_ID_SYS_STATUS: 1,
    mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 1,
    mav.MAVLINK_MSG_ID_SYSTEM_TIME: 1,
    mav.MAVLINK_MSG_ID_ATTITUDE: 10,
    mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 10,
    mav.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: 4,
    mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 4,
    mav.MAVLINK_MSG_ID_GPS_RAW_INT: 2,
    mav.MAVLINK_MSG_ID_HOME_POSITION: 0.5,
    mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: 0.5,
    mav.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 0,
}
"""Unasked rates on a link that has spoken; 0 is sent only on request."""


class Streams:
    """Intervals and due times of one link, in microseconds of vehicle time.

    `spoken` false: heartbeats only, as on a port where nobody has answered yet.
    """

    def __init__(self, now_us: int, system_id: int, *, spoken: bool) -> None:
        self.spoken = spoken
        self._stagger = system_id * 7 % 50 * 2 * SLICE_US
        self._interval_us: dict[int, int] = {}
        self._due_us: dict[int, int] = {}
        self.next_due_us = now_us
        for message_id, rate in DEFAULT_RATES_HZ.items():
            self.set_interval(message_id, 1e6 / rate if rate else -1, now_us)

    def offers(self, message_id: int) -> bool:
        """Return whether this is a message that can be streamed."""
        return message_id in self._interval_us

    def interval_us(self, message_id: int) -> int:
        """Return the interval of a message, -1 when it is not sent."""
        return self._interval_us[message_id]

    def set_interval(self, message_id: int, interval_us: float, now_us: int) -> None:
        """Send a message every `interval_us`; 0 restores its default, a negative one stops it.

        Slow messages of different vehicles are spread over time, so that a hundred heartbeats
        do not fall on one tick.
        """
        if interval_us == 0:
            rate = DEFAULT_RATES_HZ[message_id]
            interval_us = 1e6 / rate if rate else -1
        interval = -1 if interval_us < 0 else int(min(max(SLICE_US, interval_us), _LONGEST_US))
        self._interval_us[message_id] = interval
        if interval < 0:
            self._due_us.pop(message_id, None)
        else:
            slow = interval >= 500_000
            offset = (self._stagger + message_id * SLICE_US) % interval if slow else 0
            self._due_us[message_id] = now_us + offset
        self._reschedule()

    def heard(self, now_us: int) -> None:
        """Start the default streams: the peer has spoken for the first time."""
        self.spoken = True
        self._due_us = {m: max(due, now_us) for m, due in self._due_us.items()}
        self._reschedule()

    def due(self, now_us: int) -> list[int]:
        """Return the ids of the messages to send now and schedule their next time."""
        if now_us < self.next_due_us:
            return []
        ready = []
        for message_id, due_us in self._due_us.items():
            if due_us <= now_us and (self.spoken or message_id == mav.MAVLINK_MSG_ID_HEARTBEAT):
                ready.append(message_id)
                interval = self._interval_us[message_id]
                following = due_us + interval
                self._due_us[message_id] = following if following > now_us else now_us + interval
        self._reschedule()
        return ready

    def _reschedule(self) -> None:
        heartbeat = mav.MAVLINK_MSG_ID_HEARTBEAT
        due = self._due_us if self.spoken else {heartbeat: self._due_us.get(heartbeat, 1 << 62)}
        self.next_due_us = min(due.values(), default=1 << 62)
