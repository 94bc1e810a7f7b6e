"""Flies a mission: upload it, start it in AUTO, take command again at its end. No I/O."""

from collections.abc import Sequence

from ...transport.frames import Origin, Triple
from ...transport.wire import VehicleState
from ...vehicles.flight.modes import Mode
from ..station import Question, Request, Station, StationError, plan
from ..team.mission import START_PATIENCE_S
from ..team.starter import Starter
from .errors import TakenOver

_TRIES = 5  # a PX4 thinks about a mission for a while before it would fly it
_RETRY_S = 1.0
_GRACE_S = 2.0  # between leaving AUTO by itself and telling that the last item is reached


class Flight:
    """Call `go_on` once a tick until it returns True; `starter` is busy at its end."""

    def __init__(
        self, station: Station, points: Sequence[Triple], origin: Origin, ground: float
    ) -> None:
        self.starter: Starter | None = None  # takes command again
        self._station = station
        self._items = plan(points, station.kind, origin, ground)
        self._clearing: Question | None = None
        self._upload: Question | None = None
        self._request: Request | None = None
        self._tries = 0
        self._retry_at = 0.0
        self.began = False  # AUTO was seen
        self._left_at: float | None = None

    @property
    def modes(self) -> tuple[Mode, ...]:
        """The modes that the vehicle may be in because of it; empty before AUTO is asked for.

        PX4 goes to HOLD by itself at the end of a mission, and for one that it does not like.
        """
        if self._request is None:
            return ()
        return (Mode.AUTO,) if self.began and not self.starter else (Mode.AUTO, Mode.HOLD)

    def go_on(self, now: float, me: VehicleState) -> bool:
        """Return whether it is through and in command; raise StationError when it refuses."""
        station = self._station
        if self.starter:
            return self.starter.arm(now, me)
        if self._upload is None and not self._is_cleared(now):
            return False
        if self._upload is None:
            self._upload = station.missions.upload(self._items, now)
        elif self._upload.refused:
            raise StationError(self._upload.error)
        elif self._upload.accepted and self._is_through(now, me):
            self.starter = Starter(station, station.kind, START_PATIENCE_S)
        return False

    def _is_cleared(self, now: float) -> bool:
        """Return whether a new list will be flown from its beginning.

        Where a mission was broken off, a vehicle goes on with the item that it was at, of whatever
        list; and PX4 does not fly the same list twice. What an external one has flown before is
        not known.
        """
        missions = self._station.missions
        if self._clearing is None:
            if not self._station.external and (missions.complete or not missions.count):
                return True
            self._clearing = missions.clear(now)
        return self._clearing.done  # it may well refuse: the new list says it better

    def _is_through(self, now: float, me: VehicleState) -> bool:
        """Start the mission; return whether the last item is reached."""
        station, missions = self._station, self._station.missions
        if self.began and (missions.reached >= missions.count - 1 or missions.complete):
            return True
        if station.in_mode(Mode.AUTO):
            self.began, self._left_at = True, None
        elif self.began:
            self._check_left(now, me)
        elif self._request is None or (self._request.refused and now >= self._retry_at):
            if self._tries == _TRIES and self._request:
                raise StationError(self._request.error)
            self._tries += 1
            self._retry_at = now + _RETRY_S
            self._request = station.set_mode(Mode.AUTO, now)
        return False

    def _check_left(self, now: float, me: VehicleState) -> None:
        """Raise TakenOver when AUTO was left before the end, and not by reaching it."""
        station = self._station
        self._left_at = now if self._left_at is None else self._left_at
        if not me.armed or now - self._left_at > _GRACE_S:
            what = f"left AUTO for {station.mode_name()}" if me.armed else "was disarmed"
            raise TakenOver(
                f"{station.name}: {what} in its mission, after item {station.missions.reached} of "
                f"{station.missions.count} (arm() takes it back)"
            )
