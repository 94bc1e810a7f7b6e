"""Steers one vehicle by a script's orders: the conduct of every vehicle that a script owns.

No I/O. ENU. A new order takes the place of the one before; while nobody gives one, the last holds.
"""

from collections.abc import Mapping
from math import dist

from ...scenarios.schema import RobotSpec, Scenario
from ...transport.frames import Triple, swap_ned_enu
from ...transport.wire import Phase, VehicleState
from ...vehicles.flight.modes import Mode
from ..laws import HOLD, Command, Nominal
from ..safety.takeover import Grip, Taken
from ..station import Station, StationError
from ..team.mission import ARRIVED, Tell
from ..team.starter import Starter
from .errors import FleetError, Refused, TakenOver
from .flight import Flight
from .landing import Landing
from .obstacle import CLIMB_M, Situation, filled, obstacle
from .orders import STEERED, Arm, Fly, Follow, Goto, Hold, Land, Move, Order, Rest, TakeOff, Task
from .recall import Recall
from .values import Path, triple

_STILL: Triple = (0.0, 0.0, 0.0)
_LEAD_M = 0.25  # of a velocity's target: makes up for one that is not quite reached
_SAME_HEIGHT_M = 0.5


class Scripted:
    """Does what a script says, one order at a time, and says when it is done."""

    def __init__(self, spec: RobotSpec, scenario: Scenario, station: Station, tell: Tell) -> None:
        self.spec = spec
        self.phase = Phase.WAITING
        self.task = Task(Rest(), done=True)
        self.flies = spec.kind == "quadcopter"
        self.airborne = False
        self._was_armed = False
        self.commanded = False  # by us, not by a pilot: it is ours to bring to rest
        self._origin = scenario.origin
        self._taken = False  # by a pilot or a failsafe, until arm() takes it back
        self._fence = scenario.fence
        self._ground = spec.start.up or 0.0
        self._station = station
        self._tell = tell
        self._grip = Grip(station)
        self._starter: Starter | None = None
        self._flight: Flight | None = None  # as long as the vehicle may be on it
        self._recall: Recall | None = None  # from that flight, before the next order
        self._landing: Landing | None = None
        self._failure: BaseException | None = None  # of the script's own code
        self._target: Triple = _STILL
        self._velocity: Triple = _STILL
        self._moved_at = 0.0

    def give(self, order: Order) -> Task:
        """Take an order in place of the present one; its task tells what becomes of it.

        Raises Refused when the vehicle is in no state for it, TakenOver when it is not ours.
        """
        if problem := obstacle(order, self._situation()):
            lost = self.task.error
            if isinstance(lost, TakenOver) and not self._station.status.armed:
                raise TakenOver(str(lost))  # between two orders: nobody has been told how
            error = TakenOver if self._taken else Refused
            raise error(f"{self.spec.name}: {problem}")
        if isinstance(order, TakeOff) and self.airborne:
            order = Goto(None, None, order.up)
        self.task = Task(order)
        self._recall_for(order)
        return self.task

    def raise_failure(self) -> None:
        """Raise what the script's own code has raised in a tick; once."""
        failure, self._failure = self._failure, None
        if failure:
            raise failure

    @property
    def direct(self) -> Command | None:
        """What to send past the law while there is no nominal target; None: nothing."""
        if self._recall:
            return self._recall.direct
        match self.task.order:
            case Arm() | TakeOff() if self._starter:
                return self._starter.direct
            case Fly() if self._flight and self._flight.starter:
                return self._flight.starter.direct
            case Land() if self._station.in_mode(Mode.GUIDED):
                return HOLD  # until it lands; silence would be a failsafe of PX4
        return None

    def nominal(self, now: float) -> Nominal | None:
        """Return where the vehicle would go were it alone; None while nobody steers it."""
        # It waits for AUTO where it is: silence would be a failsafe of PX4.
        waits = self._flight and isinstance(self.task.order, Fly) and not self._flight.began
        if self.task.begun_at < 0 or not (waits or self._is_steered()):
            return None
        return Nominal(self._target, self._velocity)

    def update(self, now: float, me: VehicleState, team: Mapping[str, VehicleState]) -> None:
        """Go on with the order; one that fails is ended, and who can be steered holds."""
        task = self.task
        try:
            if self._recall and not self._is_recalled(self._recall, now, me):
                return
            if task.begun_at < 0:
                task.begun_at = now
                self._begin(task.order, me)
            if self._is_steered() and not self._has_grip(now, me):
                return
            self._go_on(task, now, me)
        except FleetError as error:
            self._end(task, error, me)
        except Taken as error:
            self._end(task, _taken_over(error), me)
        except StationError as error:
            self._end(task, Refused(str(error)), me)

    def _recall_for(self, order: Order) -> None:
        """Have it leave the script's own mission before the order, where that would not do it."""
        flight = self._flight
        itself = isinstance(order, Arm) or (isinstance(order, Land) and self.flies)
        if flight is None or not flight.modes or itself:
            self._flight = self._recall = None
        elif self._recall is None:
            self._recall = Recall(self._station, flight.modes)

    def _is_recalled(self, recall: Recall, now: float, me: VehicleState) -> bool:
        """Return whether the order may begin; raise StationError when the vehicle is not had."""
        try:
            if not recall.go_on(now, me):
                return False
        except StationError:
            self._recall = None
            if not isinstance(self.task.order, Land):  # it stops without
                raise
        self._flight = self._recall = None
        self._grip = Grip(self._station)
        return True

    def _begin(self, order: Order, me: VehicleState) -> None:
        station = self._station
        self._velocity = _STILL
        match order:
            case Arm() | TakeOff():
                self._was_armed = me.armed  # what the vehicle says of landing may be a second old
                if isinstance(order, Arm) or self._starter is None:
                    self._starter = Starter(station, self.spec.kind, order.patience_s)
                self.commanded, self._taken = True, False
                self._enter(Phase.STARTING)
            case Goto():
                self._target = filled(order, me.position, flies=self.flies)
            case Hold():
                self._target = me.position
            case Move():
                height = self._target[2]  # the one that was meant, if it is about there
                if abs(height - me.position[2]) > _SAME_HEIGHT_M:
                    height = me.position[2]
                self._target = (me.position[0], me.position[1], height)
                self._moved_at = self.task.begun_at
            case Fly():
                self._target = me.position
                self._flight = Flight(station, order.points, self._origin, self._ground)
            case Land():
                self._landing = Landing(station, flies=self.flies)
                self._enter(Phase.LANDING)

    def _go_on(self, task: Task, now: float, me: VehicleState) -> None:
        match task.order:
            case Arm() if self._starter and self._starter.arm(now, me) and not task.done:
                self._armed(task, me)
            case TakeOff(up=up) if self._starter and not task.done:
                armed = self._starter.arm(now, me)
                if armed and self._starter.climb(now, me, up):
                    self._target = (me.position[0], me.position[1], up)
                    task.done = True
                    self._take_command()
            case Goto():
                axes = 3 if self.flies else 2
                task.done |= dist(me.position[:axes], self._target[:axes]) < ARRIVED
            case Hold():
                task.done = True
            case Move(velocity=velocity):
                self._move(velocity, now, me)
                task.done = True
            case Follow(path=path):
                self._follow(task, path, now, me)
            case Fly(points=points) if self._flight and self._flight.go_on(now, me):
                east, north, up = points[-1]  # AUTO counts it as reached from metres away
                task.order = Goto(east, north, up)
                self._target = (east, north, up if self.flies else me.position[2])
                self._flight = None
                self._take_command()
            case Land() if self._landing and self._landing.go_on(now, me):
                task.done = True
                self._ended(Phase.DONE)

    def _armed(self, task: Task, me: VehicleState) -> None:
        self.airborne = self.flies and self._was_armed and self._is_up(me)
        if self.airborne or not self.flies:
            task.order, self._target = Hold(), me.position
            self._take_command()
        task.done = True

    def _take_command(self) -> None:
        """From here on it is steered."""
        self.airborne = self.flies
        self._grip = Grip(self._station)
        self._enter(Phase.ACTIVE)

    def _ended(self, phase: Phase) -> None:
        """From here on nobody steers it."""
        self.airborne = False
        self._flight = None
        self.task.order = Rest()
        self._enter(phase)

    def _is_steered(self) -> bool:
        """Return whether the vehicle has a target of ours, and must follow it."""
        task = self.task
        return isinstance(task.order, STEERED) or (isinstance(task.order, TakeOff) and task.done)

    def _has_grip(self, now: float, me: VehicleState) -> bool:
        try:
            return self._grip.check(now)
        except Taken as error:
            self._tell("problem", str(error))
            if not me.armed:
                self._ended(Phase.DONE)
            raise _taken_over(error) from None

    def _move(self, velocity: Triple, now: float, me: VehicleState) -> None:
        """Move the target along, ahead of the vehicle by no more than it may have to catch up."""
        dt, self._moved_at = now - self._moved_at, now
        east, north, up = velocity
        self._velocity = (east, north, up if self.flies else 0.0)
        ahead = [
            min(_LEAD_M, max(-_LEAD_M, there + v * dt - here))
            for there, v, here in zip(self._target, self._velocity, me.position, strict=True)
        ]
        height = self._target[2] if up == 0.0 and self.flies else me.position[2] + ahead[2]
        self._target = (me.position[0] + ahead[0], me.position[1] + ahead[1], height)

    def _follow(self, task: Task, path: Path, now: float, me: VehicleState) -> None:
        try:
            position, velocity = path(now - task.begun_at)
            (east, north, up), self._velocity = triple(position), triple(velocity)
        except Exception as error:  # the script's own: raised where it waits
            self._target, self._velocity = me.position, _STILL
            task.order, self._failure = Hold(), error
            error.add_note(f"in the path that {self.spec.name} follows; it holds")
            self._tell("problem", f"the path to follow has raised {error!r}: holds")
        else:
            self._target = (east, north, up if self.flies else me.position[2])

    def _end(self, task: Task, error: FleetError, me: VehicleState) -> None:
        """Leave an order that cannot be done: hold where that is still ours, else let it be."""
        task.error = task.error or error
        self.airborne = self.airborne or (self.flies and me.armed and self._is_up(me))
        if isinstance(error, TakenOver):
            self.commanded, self._taken, self._flight = False, True, None
        if not me.armed:
            self._ended(Phase.WAITING)
        elif self._station.in_mode(Mode.GUIDED) and (self.airborne or not self.flies):
            task.order, self._target, self._velocity = Hold(), me.position, _STILL
        else:
            task.order = Rest()

    def _situation(self) -> Situation:
        station = self._station
        east, north, up = swap_ned_enu(station.status.position)
        return Situation(
            flies=self.flies,
            armed=station.status.armed,
            commanded=station.in_mode(Mode.GUIDED) or self._is_on_own_mission(),
            mode=station.mode_name(),
            airborne=self.airborne,
            place=(east, north, up + 0.0),  # not -0
            fence=self._fence,
        )

    def _is_on_own_mission(self) -> bool:
        """Return whether the script itself has put it into the mode that it is in."""
        modes = self._flight.modes if self._flight else ()
        return any(self._station.in_mode(mode) for mode in modes)

    def _is_up(self, me: VehicleState) -> bool:
        landed = self._station.status.landed
        if landed is None:
            return me.position[2] > (self.spec.start.up or 0.0) + CLIMB_M
        return not landed

    def _enter(self, phase: Phase) -> None:
        if phase is not self.phase:
            self.phase = phase
            self._tell("phase", phase.name.lower())


def _taken_over(error: Taken) -> TakenOver:
    return TakenOver(f"{error} (arm() takes it back)")
