"""How often messages go out when nobody has asked for each of them: defaults and groups."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from ...transport.mavlink import Message, mav
from ..flight.autopilot import Autopilot
from .service import Handler

if TYPE_CHECKING:
    from .streams import Streams

DEFAULT_RATES_HZ: Mapping[int, float] = {
    mav.MAVLINK_MSG_ID_HEARTBEAT: 1,
    mav.MAVLINK_MSG_ID_SYS_STATUS: 1,
    mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 1,
    mav.MAVLINK_MSG_ID_SYSTEM_TIME: 1,
    mav.MAVLINK_MSG_ID_MISSION_CURRENT: 1,
    mav.MAVLINK_MSG_ID_ATTITUDE: 10,
    mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 10,
    mav.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: 4,
    mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 4,
    mav.MAVLINK_MSG_ID_VFR_HUD: 4,
    mav.MAVLINK_MSG_ID_GPS_RAW_INT: 2,
    mav.MAVLINK_MSG_ID_HOME_POSITION: 0.5,
    mav.MAVLINK_MSG_ID_BATTERY_STATUS: 0.5,
    mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: 0.5,
}
"""Unasked rates on a link that has spoken; the estimator's message (1 Hz) depends on the
personality. All other messages are sent on request only."""

_ESTIMATOR_HZ = 1.0
_ESTIMATORS = {mav.MAVLINK_MSG_ID_EKF_STATUS_REPORT, mav.MAVLINK_MSG_ID_ESTIMATOR_STATUS}
"""Each flight stack has one of them."""

GROUPS: Mapping[str, tuple[int, ...]] = {
    "RAW_SENS": (
        mav.MAVLINK_MSG_ID_RAW_IMU,
        mav.MAVLINK_MSG_ID_SCALED_IMU2,
        mav.MAVLINK_MSG_ID_SCALED_IMU3,
        mav.MAVLINK_MSG_ID_SCALED_PRESSURE,
        mav.MAVLINK_MSG_ID_SCALED_PRESSURE2,
    ),
    "EXT_STAT": (
        mav.MAVLINK_MSG_ID_SYS_STATUS,
        mav.MAVLINK_MSG_ID_POWER_STATUS,
        mav.MAVLINK_MSG_ID_MEMINFO,
        mav.MAVLINK_MSG_ID_MISSION_CURRENT,
        mav.MAVLINK_MSG_ID_GPS_RAW_INT,
        mav.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT,
        mav.MAVLINK_MSG_ID_FENCE_STATUS,
        mav.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT,
    ),
    "RC_CHAN": (
        mav.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW,
        mav.MAVLINK_MSG_ID_RC_CHANNELS,
        mav.MAVLINK_MSG_ID_RC_CHANNELS_RAW,  # by which DroneKit knows the channels
    ),
    "POSITION": (
        mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
        mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
    ),
    "EXTRA1": (
        mav.MAVLINK_MSG_ID_ATTITUDE,
        mav.MAVLINK_MSG_ID_SIMSTATE,
        mav.MAVLINK_MSG_ID_AHRS2,
    ),
    "EXTRA2": (mav.MAVLINK_MSG_ID_VFR_HUD,),
    "EXTRA3": (
        mav.MAVLINK_MSG_ID_AHRS,
        mav.MAVLINK_MSG_ID_SYSTEM_TIME,
        mav.MAVLINK_MSG_ID_TERRAIN_REPORT,
        mav.MAVLINK_MSG_ID_BATTERY_STATUS,
        mav.MAVLINK_MSG_ID_EKF_STATUS_REPORT,
        mav.MAVLINK_MSG_ID_ESTIMATOR_STATUS,
        mav.MAVLINK_MSG_ID_VIBRATION,
        mav.MAVLINK_MSG_ID_ESC_TELEMETRY_1_TO_4,
    ),
}
"""ArduPilot's groups, as the parameters SRn_... and REQUEST_DATA_STREAM know them."""

DATA_STREAMS: Mapping[int, tuple[str, ...]] = {
    mav.MAV_DATA_STREAM_ALL: tuple(GROUPS),
    mav.MAV_DATA_STREAM_RAW_SENSORS: ("RAW_SENS",),
    mav.MAV_DATA_STREAM_EXTENDED_STATUS: ("EXT_STAT",),
    mav.MAV_DATA_STREAM_RC_CHANNELS: ("RC_CHAN",),
    mav.MAV_DATA_STREAM_POSITION: ("POSITION",),
    mav.MAV_DATA_STREAM_EXTRA1: ("EXTRA1",),
    mav.MAV_DATA_STREAM_EXTRA2: ("EXTRA2",),
    mav.MAV_DATA_STREAM_EXTRA3: ("EXTRA3",),
}
"""MAV_DATA_STREAM to groups; other streams are nobody's."""

_GROUP_OF = {message_id: name for name, ids in GROUPS.items() for message_id in ids}


class Rates:
    """What one link gets unasked: the vehicle's own rates, unless SRn_... parameters say else.

    A group's parameter is in Hz. 0 leaves each message of the group at the vehicle's own rate,
    more sends every message of the group so often, less (-1) sends none of it. `channel` is n;
    the last one counts for all beyond, and the coordinator's own link has none.
    """

    def __init__(self, autopilot: Autopilot, channel: int | None) -> None:
        channels = autopilot.settings.stream_rates
        self._groups = {} if channel is None else channels[min(channel, len(channels) - 1)]
        self._seen: dict[str, float] | None = None
        estimator = autopilot.personality.estimator_message
        self._own = {**DEFAULT_RATES_HZ, estimator: _ESTIMATOR_HZ}
        self._foreign = _ESTIMATORS - {estimator}
        self.messages = tuple(dict.fromkeys((*self._own, *self.among(_GROUP_OF))))

    def among(self, message_ids: Iterable[int]) -> list[int]:
        """Return those messages of a group that this flight stack has in it."""
        return [message_id for message_id in message_ids if message_id not in self._foreign]

    def hz(self, message_id: int) -> float:
        """Return how often a message goes out unasked; 0: not at all."""
        group = self._groups.get(_GROUP_OF.get(message_id, ""), 0.0)
        return max(0.0, group) if group else self._own.get(message_id, 0.0)

    def have_changed(self) -> bool:
        """Return whether somebody has set a parameter since the last look."""
        if self._seen == self._groups:
            return False
        self._seen = dict(self._groups)
        return True


class RateService:
    """Answers the legacy REQUEST_DATA_STREAM, by which older stations set whole groups."""

    def __init__(self, streams: "Streams") -> None:
        self._streams = streams
        self.handlers: dict[str, Handler] = {"REQUEST_DATA_STREAM": self._on_request}

    def _on_request(self, m: Message) -> list[Message]:
        """Set the rate of a group, or of all; ArduPilot acknowledges none of it either."""
        if m.start_stop not in (0, 1):
            return []
        rate = m.req_message_rate if m.start_stop else 0
        for group in DATA_STREAMS.get(m.req_stream_id, ()):
            self._streams.ask(GROUPS[group], rate)
        return []
