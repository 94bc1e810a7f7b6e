"""Lands a vehicle where it is, or stops a rover, and sees it disarmed. No I/O."""

from collections.abc import Callable

from ...transport.wire import VehicleState
from ...vehicles.flight.modes import Mode
from ..station import Request, Station, StationError
from .errors import TakenOver

_RETRY_S = 1.0
_TRIES = 5


class Landing:
    """Call `go_on` once a tick until it returns True."""

    def __init__(self, station: Station, *, flies: bool) -> None:
        self._station = station
        self._flies = flies
        self._mode = Mode.LAND if flies else Mode.HOLD
        self._began = False  # the mode was seen: from then on another one is somebody's wish
        self._request: Request | None = None
        self._retry_at = 0.0
        self._tries = 0

    def go_on(self, now: float, me: VehicleState) -> bool:
        """Return whether it is down and disarmed; raise StationError when it refuses."""
        station = self._station
        if not me.armed:
            return True
        if station.in_mode(self._mode):
            self._began = True
            if not self._flies:
                self._ask("disarming", now, lambda: station.disarm(now))
        elif self._began:
            raise TakenOver(
                f"{station.name}: left {self._mode.name} for {station.mode_name()} at {now:.1f} s; "
                "arm() takes it back"
            )
        elif self._flies:
            self._ask("landing", now, lambda: station.land(now))
        else:
            self._ask("mode", now, lambda: station.set_mode(Mode.HOLD, now))
        return False

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
