"""Takes a vehicle back from the mission that its script has given it. No I/O."""

from ...transport.wire import VehicleState
from ...vehicles.flight.modes import Mode
from ..laws import HOLD
from ..safety.takeover import Taken, loss
from ..station import Request, Station, StationError

_TRIES = 5
_RETRY_S = 1.0
_SHOWN_S = 3.0  # from a yes to the HEARTBEAT that shows it


class Recall:
    """Call `go_on` once a tick until it returns True; stream `direct` meanwhile.

    AUTO may have been asked for a moment ago and show only later: so GUIDED is asked for even
    where it shows, and only what is heard after the answer counts. `modes` are those that the
    mission may have put it into; any other is a pilot's.
    """

    direct = HOLD  # AUTO does not heed it; some flight stacks want to see it before GUIDED

    def __init__(self, station: Station, modes: tuple[Mode, ...]) -> None:
        self._station = station
        self._modes = (*modes, Mode.GUIDED)
        self._began_at: float | None = None
        self._request: Request | None = None
        self._asked_at = 0.0
        self._answered_at: float | None = None
        self._tries = 0

    def go_on(self, now: float, me: VehicleState) -> bool:
        """Return whether it is in GUIDED; raise Taken when it is a pilot's, StationError if not."""
        station, request = self._station, self._request
        self._began_at = now if self._began_at is None else self._began_at
        if not me.armed or not any(station.in_mode(mode) for mode in self._modes):
            raise Taken(loss(station, now, Mode.AUTO))
        if request is None:
            stack = station.stack
            if stack is None or now - self._began_at >= stack.stream_first_s:
                self._ask(now)
            return False
        if request.accepted:
            self._answered_at = now if self._answered_at is None else self._answered_at
            heard = station.status.heartbeat_at > self._answered_at
            if heard and station.in_mode(Mode.GUIDED):
                return True
        if request.done and now >= self._asked_at + (_SHOWN_S if request.accepted else _RETRY_S):
            self._ask(now)
        return False

    def _ask(self, now: float) -> None:
        if self._tries == _TRIES and self._request:
            raise StationError(
                self._request.error or f"{self._station.name}: does not leave its mission"
            )
        self._tries += 1
        self._asked_at, self._answered_at = now, None
        self._request = self._station.set_mode(Mode.GUIDED, now)
