"""What one robot of a scenario does next: start, take off, wait for all, move, land, disarm."""

from collections.abc import Callable, Collection, Mapping
from math import dist, hypot

from ...scenarios.route import Route
from ...scenarios.schema import Hold, RobotSpec, Scenario
from ...transport.frames import Triple
from ...transport.wire import Phase, VehicleState
from ...vehicles.flight.modes import Mode
from ..laws import HOLD, Command, Nominal
from ..safety.aside import COPTER_ROOM, ROVER_ROOM
from ..safety.braking import Brake
from ..safety.takeover import Grip, loss
from ..station import Request, Station, StationError
from .starter import Starter

ARRIVED = 0.2  # m
START_PATIENCE_S = 30.0  # for a vehicle that refuses to arm to change its mind
_RETRY_S = 1.0
_SHOWN_S = 3.0  # from a yes to the HEARTBEAT that shows it
_PARKED_ROOM = 0.5  # m, from where a quadcopter lands to one that has landed

# A phase costs more to look up in its class than to compare.
_ACTIVE = Phase.ACTIVE
_ON_PATH = (_ACTIVE, Phase.DWELL)
_STEERED = (*_ON_PATH, Phase.READY, Phase.RETURNING)

Tell = Callable[[str, str], None]
"""Takes the kind of an event (phase, wait) and its text."""


class Mission:
    """Drives one vehicle's station through its part of a scenario. Positions are ENU.

    The pad is the spec's nominal start, wherever the seed has put the vehicle. `direct` is what to
    send past any law while there is no nominal target; None: nothing.
    """

    def __init__(self, spec: RobotSpec, scenario: Scenario, station: Station, tell: Tell) -> None:
        self.spec = spec
        self.phase = Phase.WAITING
        self.direct: Command | None = None
        self._station = station
        self._tell = tell
        self._flies = spec.kind == "quadcopter"
        self._movers = {r.name for r in scenario.robots if not isinstance(r.path, Hold)}
        self._rovers = {r.name for r in scenario.robots if r.kind == "rover"}
        patience = scenario.team.ready_timeout_s if spec.external else START_PATIENCE_S
        self._starter = Starter(station, spec.kind, patience)
        self._grip = Grip(station)
        self._brake = Brake() if spec.external and not self._flies else None
        self._route = Route(spec.path, spec, scenario.team)
        start = Nominal(*self._route.at(-1.0))
        self._post = start if self._route.duration is None else None  # it has no other point
        self._height = start.position[2] if self._flies else 0.0
        self._request: Request | None = None
        self._asked_at = 0.0
        self._began_at = 0.0  # when all were ready
        self._phase_at = 0.0
        self._stand: Triple = (0.0, 0.0, 0.0)  # where to stay in a phase without a path
        self._last: Triple = (0.0, 0.0, 0.0)  # where it was when it was last steered
        self._told_wait = False
        self._awaited = ""  # who it waits for
        self._lands = False  # it was seen to: from then on another mode is somebody's wish

    def nominal(self, now: float) -> Nominal | None:
        """Return where the robot would go were it alone; None while nobody steers it."""
        if self.phase in _ON_PATH:
            if self._post is not None:
                return self._post
            return Nominal(*self._route.at(now - self._began_at))
        return Nominal(self._stand) if self.phase in _STEERED else None

    def update(self, now: float, me: VehicleState, team: Mapping[str, VehicleState]) -> None:
        """Decide the phase from what is known now; `team` holds everybody, `me` included.

        Raises StationError when the vehicle cannot be brought to start, or somebody else takes it.
        """
        if self.phase in _STEERED:
            self._last = me.position
            if not self._grip.check(now):
                return
        self._go_on(now, me, team)
        self.direct = None if self.phase in _STEERED else self._stream()

    def _go_on(self, now: float, me: VehicleState, team: Mapping[str, VehicleState]) -> None:
        if self.phase is _ACTIVE:  # most of the time
            if self._has_ended(now, me, team):
                self._enter(Phase.DWELL, now)
            return
        match self.phase:
            case Phase.WAITING:
                self._enter(Phase.STARTING, now)
            case Phase.STARTING:
                self._start(now, me)
            case Phase.READY:
                if self._have_come_to(Phase.READY, team, team):
                    self._began_at = now
                    self._enter(Phase.ACTIVE, now)
            case Phase.DWELL:
                if now - self._phase_at >= self.spec.dwell_s:
                    self._leave(now, me, team)
            case Phase.RETURNING:
                if dist(me.position, self._stand) < ARRIVED and self._is_clear_below(me, team):
                    self._enter(Phase.LANDING, now)
            case Phase.LANDING:
                self._land(now, me)

    def _enter(self, phase: Phase, now: float) -> None:
        self.phase = phase
        self._phase_at = now
        self._request = None
        self._told_wait = False
        self._tell("phase", phase.name.lower())

    def _stream(self) -> Command | None:
        """Return what to send in a phase without a target, None where silence is right."""
        if self.phase is Phase.STARTING:
            return self._starter.direct
        stack, status = self._station.stack, self._station.status
        if self._brake and self.phase is Phase.LANDING:
            return HOLD if status.armed and self._station.in_mode(Mode.GUIDED) else None
        waits = self.phase in (Phase.LANDING, Phase.DONE) and status.armed
        if waits and stack and stack.needs_stream and self._station.in_mode(Mode.GUIDED):
            return Command(position=self._last)  # until it lands; silence would be a failsafe
        return None

    def _start(self, now: float, me: VehicleState) -> None:
        starter = self._starter
        if starter.arm(now, me) and (not self._flies or starter.climb(now, me, self._height)):
            self._stand = (me.position[0], me.position[1], self._height)
            self._enter(Phase.READY, now)

    def _has_ended(self, now: float, me: VehicleState, team: Mapping[str, VehicleState]) -> bool:
        if self._post is None:
            return now - self._began_at >= (self._route.duration or 0.0)
        if isinstance(self.spec.path, Hold):
            through = self._have_come_to(Phase.DWELL, self._movers, team)
        else:
            through = True
        return through and self._is_at(self._post.position, me)

    def _have_come_to(
        self, phase: Phase, names: Collection[str], team: Mapping[str, VehicleState]
    ) -> bool:
        """Return whether all of these have; who had not the last time is looked at first."""
        if self._awaited in names and team[self._awaited].phase < phase:
            return False
        self._awaited = next((name for name in names if team[name].phase < phase), "")
        return not self._awaited

    def _is_at(self, place: Triple, me: VehicleState) -> bool:
        axes = 3 if self._flies else 2
        return dist(me.position[:axes], place[:axes]) < ARRIVED

    def _leave(self, now: float, me: VehicleState, team: Mapping[str, VehicleState]) -> None:
        """Go on after the dwell: fly home, land, or, once nobody moves any more, stop."""
        if self._flies and self.spec.then == "return":
            pad = self.spec.start
            self._stand = (pad.east, pad.north, me.position[2])
            self._enter(Phase.RETURNING, now)
        elif self._flies and self.spec.then == "land":
            if self._is_clear_below(me, team):
                self._enter(Phase.LANDING, now)
        elif self._have_come_to(Phase.DWELL, team, team):
            # Until then a standing robot stays coordinated, so that it gives way.
            self._enter(Phase.DONE if self._flies else Phase.LANDING, now)

    def _is_clear_below(self, me: VehicleState, team: Mapping[str, VehicleState]) -> bool:
        last = team.get(self._awaited)  # most likely it still is in the way
        if last is not None and self._told_wait and self._is_in_the_way(last, me):
            return False
        self._awaited = next((o.name for o in team.values() if self._is_in_the_way(o, me)), "")
        if self._awaited and not self._told_wait:
            self._told_wait = True
            self._tell("wait", f"waits to land: {self._awaited} is near")
        return not self._awaited

    def _is_in_the_way(self, other: VehicleState, me: VehicleState) -> bool:
        away = hypot(other.position[0] - me.position[0], other.position[1] - me.position[1])
        return other.name != me.name and away < self._landing_room(other)

    def _landing_room(self, other: VehicleState) -> float:
        """Return the room to keep from `other`; one that flies on gives way itself."""
        if other.name in self._rovers:
            return ROVER_ROOM
        if other.phase is Phase.LANDING:
            return COPTER_ROOM
        return _PARKED_ROOM if other.phase is Phase.DONE else 0.0

    def _land(self, now: float, me: VehicleState) -> None:
        """Land (a rover only stops), and be done once disarmed."""
        station, mode = self._station, Mode.LAND if self._flies else Mode.HOLD
        if not me.armed:
            self._enter(Phase.DONE, now)
        elif station.in_mode(mode):
            self._lands = True
            if not self._flies:
                self._ask("disarming", now, lambda: station.disarm(now))
        elif self._lands:
            raise StationError(loss(station, now, mode))
        elif self._flies:
            self._ask("landing", now, lambda: station.land(now))
        elif self._brake and not self._brake.stands(now, me.velocity):
            self._grip.check(now)
        else:
            self._ask("mode", now, lambda: station.set_mode(mode, now))

    def _ask(self, what: str, now: float, send: Callable[[], Request]) -> None:
        """Make a request once, and again some time after a refusal or a yes that does not show."""
        request = self._request
        if request is not None and request.what.startswith(what):
            pause = _RETRY_S if request.refused else _SHOWN_S
            if not request.done or now < self._asked_at + pause:
                return
        self._request = send()
        self._asked_at = now
