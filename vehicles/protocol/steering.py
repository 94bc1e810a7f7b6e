"""Setpoints, sticks and heartbeats: what ground stations stream at a vehicle."""

from ...transport.mavlink import Message, mav
from ..flight.autopilot import Autopilot
from .service import Handler


class SteeringService:
    """Hands targets and stick positions to the autopilot; nothing is answered."""

    def __init__(self, autopilot: Autopilot) -> None:
        self._autopilot = autopilot
        self.handlers: dict[str, Handler] = {
            "SET_POSITION_TARGET_LOCAL_NED": self._on_target,
            "SET_POSITION_TARGET_GLOBAL_INT": self._on_target,
            "SET_ATTITUDE_TARGET": self._on_target,
            "MANUAL_CONTROL": self._on_sticks,
            "RC_CHANNELS_OVERRIDE": self._on_sticks,
            "HEARTBEAT": self._on_heartbeat,
        }

    def _on_target(self, m: Message) -> list[Message]:
        self._autopilot.follow(m)
        return []

    def _on_sticks(self, m: Message) -> list[Message]:
        self._autopilot.pilot.take(m, self._autopilot.now)
        return []

    def _on_heartbeat(self, m: Message) -> list[Message]:
        if m.type == mav.MAV_TYPE_GCS:
            self._autopilot.failsafes.heard_station(m.get_srcSystem(), self._autopilot.now)
        return []
