"""Has a vehicle that would not arm say why; by itself ArduPilot does so every 30 s only."""

from ...transport.mavlink import mav
from ..station import Station

_PAUSE_S = 5.0
_HEARD_S = 3.0  # nothing is asked of a vehicle that is not there


class Inquiry:
    """Asked once in a while as long as the vehicle waits; it moves nothing."""

    def __init__(self, station: Station) -> None:
        self._station = station
        self._due = 0.0

    def update(self, now: float) -> None:
        """Have it run its pre-arm checks aloud when they fail; never while it is armed."""
        station, status = self._station, self._station.status
        silent = status.heartbeat_at < 0 or now - status.heartbeat_at > _HEARD_S
        if silent or status.armed or status.prearm_ok is not False or station.problem:
            return
        if now >= self._due:
            self._due = now + _PAUSE_S
            station.command(mav.MAV_CMD_RUN_PREARM_CHECKS, (), "its pre-arm checks", now)
