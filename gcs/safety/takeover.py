"""Whether a vehicle is still ours to steer: a pilot who takes over must win."""

from ...transport.mavlink import mav
from ...vehicles.flight.modes import Mode
from ..station import Request, Station, StationError, said_since
from ..station.status import Texts

SILENT_S = 0.9  # of its link; vehicles that need a stream fail safe after 1 s, some sooner
_AFTER_S = 5.0  # from the end of a silence to the HEARTBEAT that tells what it has led to
_SETTLED_S = 0.5  # after a silence: a HEARTBEAT in GUIDED says that it has led to nothing
_PAUSE_S = 1.0  # first: PX4 comes back by itself when set-points flow again
_TRIES = 5
_RETRY_S = 1.0
_RECENT_S = 5.0
_GUIDED = Mode.GUIDED  # looked up once, since asked in every tick


class Taken(StationError):  # noqa: N818 - reads as what has happened
    """A vehicle that is not in our hands any more."""


def loss(station: Station, now: float, mode: Mode = Mode.GUIDED) -> str:
    """Return how a vehicle we had in `mode` got out of our hands, with what it says about it."""
    what = f"left {station.mode_name(mode)} for {station.mode_name()}"
    if not station.status.armed:
        what = "disarmed itself"
    return f"{station.name}: {what} at {now:.1f} s{_reasons(station, now)}"


def _reasons(station: Station, now: float) -> str:
    """Return its warnings of late, and all that it has said since it was last seen ours."""
    s = station.status
    said = [t for t in s.texts if t[0] >= s.changed_after or t[1] <= mav.MAV_SEVERITY_WARNING]
    return said_since(Texts(said), now - _RECENT_S, mav.MAV_SEVERITY_INFO)


class Grip:
    """Sees that a vehicle stays armed in GUIDED.

    Whoever takes it out of GUIDED wins. But when that happened while its link was silent it was
    its own failsafe: then it is asked back, a few times, as long as it is armed.
    """

    def __init__(self, station: Station) -> None:
        self._station = station
        self._checked_at: float | None = None
        self._silent_at: float | None = None
        self._request: Request | None = None
        self._lost = False
        self._tries = 0
        self._try_at = 0.0

    def check(self, now: float) -> bool:
        """Return whether the vehicle is in our hands; False while it is being asked back.

        Raises Taken when somebody else has it. To be called in every tick.
        """
        status = self._station.status
        paused = self._checked_at is not None and now - self._checked_at > SILENT_S
        self._checked_at = now
        if paused or now - status.heard_at > SILENT_S:
            self._silent_at = now
        if status.armed and self._station.in_mode(_GUIDED):
            heard = -1.0 if self._silent_at is None else status.heartbeat_at - self._silent_at
            if self._lost or heard > _SETTLED_S:
                self._request, self._tries, self._lost, self._silent_at = None, 0, False, None
            return True
        if not self._lost:
            if not self._was_silent(now):
                raise Taken(loss(self._station, now))
            self._lost = True
            self._try_at = now + _PAUSE_S
        self._ask_back(now)
        return False

    def _was_silent(self, now: float) -> bool:
        return self._silent_at is not None and now - self._silent_at < _AFTER_S

    def _ask_back(self, now: float) -> None:
        waits = now < self._try_at or (self._request and not self._request.done)
        if waits and self._station.status.armed:
            return
        if not self._station.status.armed or self._tries == _TRIES:
            reason = self._request.problem if self._request else ""
            why = f" and does not come back{f' ({reason})' if reason else ''}"
            text = f"{loss(self._station, now)}, while its link was silent,{why}"
            raise Taken(text)
        self._tries += 1
        self._try_at = now + _RETRY_S
        self._request = self._station.set_mode(Mode.GUIDED, now)
