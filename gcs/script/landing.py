"""Lands a vehicle where it is, or stops a rover, and sees it disarmed. No I/O."""

from collections.abc import Callable
from math import hypot

from ...transport.wire import VehicleState
from ...vehicles.flight.modes import Mode
from ..safety.braking import STANDING, Brake
from ..station import Request, Station, StationError
from .errors import TakenOver

_RETRY_S = 1.0
_TRIES = 5
_ROLLS_S = 5.0  # at most, on hold; one that still says it moves does not know better


class Landing:
    """Call `go_on` once a tick until it returns True."""

    def __init__(self, station: Station, *, flies: bool) -> None:
        self._station = station
        self._flies = flies
        self._mode = Mode.LAND if flies else Mode.HOLD
        self._began_at: float | None = None  # the mode was seen: another one is somebody's wish
        self._brake = Brake() if station.external and not flies else None
        self._brakes = False
        self._request: Request | None = None
        self._retry_at = 0.0
        self._tries = 0

    def go_on(self, now: float, me: VehicleState) -> bool:
        """Return whether it is down and disarmed; raise StationError when it refuses."""
        station = self._station
        if not me.armed:
            return True
        if station.in_mode(self._mode):
            self._began_at = now if self._began_at is None else self._began_at
            stands = hypot(*me.velocity) < STANDING or now - self._began_at > _ROLLS_S
            if not self._flies and stands:
                self._ask("disarming", now, lambda: station.disarm(now))
        elif self._began_at is not None or (self._brakes and not station.in_mode(Mode.GUIDED)):
            left = Mode.GUIDED if self._brakes else self._mode
            raise TakenOver(
                f"{station.name}: left {left.name} for {station.mode_name()} at {now:.1f} s; "
                "arm() takes it back"
            )
        elif self._flies:
            self._ask("landing", now, lambda: station.land(now))
        elif self._is_to_brake(now, me):
            self._brakes = True
        else:
            self._brakes = False
            self._ask("mode", now, lambda: station.set_mode(Mode.HOLD, now))
        return False

    def _is_to_brake(self, now: float, me: VehicleState) -> bool:
        if self._brake is None or not self._station.in_mode(Mode.GUIDED):
            return False
        return not self._brake.stands(now, me.velocity)

    def _ask(self, what: str, now: float, send: Callable[[], Request]) -> None:
        request = self._request
        if request is not None and request.what.startswith(what):
            if not request.refused or now < self._retry_at:
                return
            self._tries += 1
            if self._tries == _TRIES:
                raise StationError(request.error)
        self._request = send()
        self._retry_at = now + _RETRY_S
