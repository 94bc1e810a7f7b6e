"""Asks an outside vehicle for telemetry where it tells nothing of itself. No I/O.

What is sent are heartbeats, requests for message rates and, at most, for data streams. The
heartbeats are those of a companion computer: by a ground station's, which come and go, vehicles
with a failsafe would tell that they have lost one.
"""

from collections import deque
from typing import Any

from ....transport.mavlink import Codec, Message, mav
from ...station.commands import Commands
from ...station.station import SYSTEM_ID
from ...station.streams import WatchedStreams

COMPONENT_ID: int = mav.MAV_COMP_ID_ONBOARD_COMPUTER  # beside a coordinator, which is 190
RATE_HZ = 20.0  # of positions; attitudes come at half of it
SLOW_RATE_HZ = 6.0  # over a serial line, which may be a slow radio
_INTERVALS_US = {  # few different ones: see WatchedStreams
    mav.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 2e5,
    mav.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: 2e5,
    mav.MAVLINK_MSG_ID_VFR_HUD: 5e5,
    mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: 1e6,
}
_HEARTBEAT: Any = mav.MAVLink_heartbeat_message
_SILENT_S = 3.0  # nothing is asked of a vehicle that is not there


class Asking:
    """What is said to one vehicle on one link."""

    def __init__(self, system_id: int, rate_hz: float) -> None:
        self.codec = Codec(SYSTEM_ID, COMPONENT_ID)
        self._commands = Commands(f"sys{system_id}", system_id, deque())
        self._streams = WatchedStreams(rate_hz, _INTERVALS_US)
        self._heard_at = 0.0
        self._boots = 0

    def hear(self, m: Message, now: float) -> None:
        """Take in a message of the vehicle."""
        self._heard_at = now
        self._streams.hear(m)
        if m.get_type() == "COMMAND_ACK" and _is_for_us(m):
            self._commands.take_ack(m, now)

    def restart(self) -> None:
        """Ask for everything again: the vehicle has rebooted."""
        self._streams.restart()

    def due(self, now: float) -> list[bytes]:
        """Return the frames that are to be sent now."""
        if now - self._heard_at > _SILENT_S:
            return []
        messages = [*self._streams.due(self._commands, now), *self._commands.due(now)]
        return self.codec.frames(messages)


def heartbeat() -> Message:
    """Return the heartbeat of somebody who listens."""
    message: Message = _HEARTBEAT(
        mav.MAV_TYPE_ONBOARD_CONTROLLER, mav.MAV_AUTOPILOT_INVALID, 0, 0, mav.MAV_STATE_ACTIVE, 3
    )
    return message


def _is_for_us(m: Message) -> bool:
    return m.target_system in (0, SYSTEM_ID) and m.target_component in (0, COMPONENT_ID)
