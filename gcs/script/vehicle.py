"""One vehicle as a script sees it."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from ...transport.frames import quaternion_to_enu, swap_ned_enu, yaw_of
from ..station import Station
from ..station.question import Question
from ..team.coordinator import Member
from ..team.mission import START_PATIENCE_S
from .errors import FleetError, Refused
from .orders import Arm, Fly, Follow, Goto, Hold, Land, Move, Order, TakeOff
from .parameters import ParamValues
from .scripted import Scripted
from .values import Path, Position, State, Velocity, finite, triple
from .waiting import DEFAULT_S, Asking, Ear, Waiting, done_or_raise, unknown

if TYPE_CHECKING:
    from .fleet import Fleet

_LATE_S = 2.0  # the vehicle's own reason comes a little later than the end of our patience


class Vehicle:
    """One vehicle of a fleet: tell it what to do, and wait until it has done it.

    Positions are ENU in metres from the fleet origin, headings radians counter-clockwise from
    east, time-outs seconds of the vehicle's own time. A call raises `Refused` with the vehicle's
    reason, `TimedOut`, `LinkLost`, or `TakenOver` when a pilot or a failsafe has changed the mode.
    """

    def __init__(self, fleet: "Fleet", member: Member, conduct: Scripted) -> None:
        self.name = member.spec.name
        self.kind = member.spec.kind  # quadcopter | rover
        self.system_id = member.spec.system_id
        self.member = member
        self.conduct = conduct
        self.param = ParamValues(self.station, self._ask)
        self._fleet = fleet
        self._ear = Ear(self.station)

    @property
    def station(self) -> Station:
        """The MAVLink client behind it, in local NED: for what this class does not offer."""
        return self.member.station

    # Orders

    def arm(self, timeout: float = START_PATIENCE_S) -> None:
        """Take command: guided mode (PX4: OFFBOARD), then armed. Waits while it is not ready.

        This also takes a vehicle back from a pilot; one that flies already holds where it is.
        """
        self._fleet.await_all([self.begin_arm(timeout)])

    def takeoff(self, up: float, timeout: float = DEFAULT_S) -> None:
        """Climb to `up` metres above the fleet origin."""
        self._fleet.await_all([self.begin_takeoff(up, timeout)])

    def goto(
        self,
        east: float,
        north: float,
        up: float | None = None,
        *,
        wait: bool = True,
        timeout: float = DEFAULT_S,
    ) -> None:
        """Go to a place and stay there, giving way to others; without `up` at the present height.

        Waits until it is within 0.2 m; with wait=False it returns at once (see `wait_arrival`).
        """
        height = None if up is None else finite(up, "up")
        place = Goto(finite(east, "east"), finite(north, "north"), height)
        waiting = self._give(place, "goto", timeout)
        if wait:
            self._fleet.await_all([waiting])

    def velocity(self, east: float = 0.0, north: float = 0.0, up: float = 0.0) -> None:
        """Move at this velocity (m/s, at most what the vehicle can) until told otherwise.

        Without a climb it keeps its height; a rover has none. Returns at once.
        """
        self._give(Move(triple((east, north, up))), "velocity")

    def follow(self, path: Path) -> None:
        """Follow a moving target: path(t) gives its (position, velocity) t seconds from now on.

        Returns at once. `path` is called at every tick, so it should be quick; when it raises,
        the vehicle holds and the script's next wait raises what it has raised.
        """
        self._give(Follow(path), "follow")

    def hold(self) -> None:
        """Stay where it is, from now on."""
        self._give(Hold(), "hold")

    def mission(self, points: Sequence[Sequence[float]], timeout: float | None = None) -> None:
        """Upload (east, north, up) waypoints, fly them in AUTO, then stay at the last.

        In AUTO the vehicle flies on its own: others give way to it, it does not. Without a
        `timeout` the mission may take as long as it likes.
        """
        if not points:
            raise ValueError("mission: expected at least one (east, north, up) waypoint, got none")
        order = Fly(tuple(triple(point) for point in points))
        self._fleet.await_all([self._give(order, "mission", timeout)])

    def land(self, timeout: float = DEFAULT_S) -> None:
        """Land here and wait until disarmed; a rover stops and disarms."""
        self._fleet.await_all([self.begin_land(timeout)])

    # The same without waiting, for several vehicles at once

    def begin_arm(self, timeout: float = START_PATIENCE_S) -> Waiting:
        """Begin to arm; pass what it returns to `fleet.await_all`."""
        return self._give(Arm(timeout), "arm", timeout + _LATE_S)

    def begin_takeoff(self, up: float, timeout: float = DEFAULT_S) -> Waiting:
        """Begin to climb."""
        return self._give(TakeOff(finite(up, "up"), timeout), "takeoff", timeout + _LATE_S)

    def begin_land(self, timeout: float = DEFAULT_S) -> Waiting:
        """Begin to land."""
        return self._give(Land(), "land", timeout)

    def arrival(self, timeout: float = DEFAULT_S) -> Waiting:
        """Return the wait for the last order to be done."""
        task = self.conduct.task
        return Waiting(self, "arrival", done_or_raise(self, task, "arrival"), timeout)

    # Waiting

    def wait_arrival(self, timeout: float = DEFAULT_S) -> None:
        """Wait until the last order (a goto, say) is done."""
        self._fleet.await_all([self.arrival(timeout)])

    def wait_mode(self, mode: str, timeout: float = DEFAULT_S) -> None:
        """Wait until the vehicle is in a mode, by its flight stack's name: LAND, LOITER, HOLD."""
        modes = self.station.modes
        known = [name for _, name in modes.rows.values()] if modes else []
        if mode not in known:
            raise FleetError(f"{self.name}: {unknown('mode', mode, known)}")
        what = f"wait for mode {mode}"
        self._fleet.await_all([Waiting(self, what, lambda: self.mode == mode, timeout)])

    def wait_message(self, name: str, timeout: float = 5.0) -> dict[str, Any]:
        """Return the fields of the next MAVLink message of that name; asks for it when needed."""
        self._ear.expect(name)
        asking = Asking(self.station, self._ear, name, lambda: self._fleet.time)
        self._fleet.await_all([Waiting(self, f"wait for {name}", asking, timeout)])
        return self._ear.fields(name)

    # Telemetry

    @property
    def state(self) -> State:
        """What the vehicle last said of itself, all at once."""
        with self._fleet.lock:
            status = self.station.status
            return State(
                self.name,
                status.position_at,
                Position(*swap_ned_enu(status.position)),
                Velocity(*swap_ned_enu(status.velocity)),
                yaw_of(quaternion_to_enu(status.quaternion)),
                self.station.mode_name(),
                status.armed,
                status.battery_remaining,
                status.battery_v,
            )

    @property
    def position(self) -> Position:
        """Where it is, m from the fleet origin."""
        return self.state.position

    @property
    def mode(self) -> str:
        """The mode it is in, as its flight stack calls it."""
        return self.station.mode_name()

    @property
    def armed(self) -> bool:
        """Whether its motors may turn."""
        return self.station.status.armed

    @property
    def arrived(self) -> bool:
        """Whether the last order is done; raises the error it has ended with."""
        return done_or_raise(self, self.conduct.task, "arrival")()

    @property
    def autopilot(self) -> str:
        """Its flight stack: ardupilot, px4 or generic; whose parameters and modes it has."""
        stack = self.station.stack
        return stack.name if stack else "unknown"

    def __repr__(self) -> str:
        return f"<{self.name}: {self.kind}, system {self.system_id}, {self.mode}>"

    def _give(self, order: Order, what: str, timeout: float | None = None) -> Waiting:
        with self._fleet.lock:
            task = self.conduct.give(order)
        return Waiting(self, what, done_or_raise(self, task, what), timeout)

    def _ask(self, what: str, ask: Callable[[float], Question]) -> Question:
        with self._fleet.lock:
            question = ask(self._fleet.time)
        self._fleet.await_all([Waiting(self, what, lambda: question.done, DEFAULT_S)])
        if question.refused:
            raise Refused(question.error)
        return question
