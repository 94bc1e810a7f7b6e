"""How external vehicles are left when a run is broken off: at hold, then as the scenario says.

Nobody ends their processes, and what stops talking to them leaves them to their own failsafes.
"""

from collections.abc import Callable, Mapping
from math import hypot

from ...scenarios.schema import RobotSpec, Scenario
from ...transport.frames import Triple
from ...transport.wire import Phase, VehicleState
from ...vehicles.flight.modes import Mode
from ..laws import HOLD, Command, Nominal
from ..station import Request
from ..team.member import Member
from .aside import below, place_aside
from .braking import STANDING, Brake

WATCH_S = 60.0  # for a vehicle to come down, or back
_HOLD_S = 3.0  # for a vehicle to enter its hold mode, before it is told to end without
_CLEAR_S = 20.0  # for a copter to get clear of who is below it, before it lands all the same
_SLOW = 0.3  # m/s, of a copter that begins to land
_RETRY_S = 1.0
_STANDS_S = 3.0  # so long, and a rover on its way home has arrived

_OURS = (Mode.GUIDED, Mode.AUTO, Mode.TAKEOFF, Mode.HOLD)  # modes that we have put it into
_ENDING = (Mode.LAND, Mode.RTL)  # it is on its way down already, or home
_LAST_MODE = {"land": Mode.LAND, "return": Mode.RTL}


class StayPut:
    """Has a vehicle stay where it is, under the law.

    That is one of our own, until its process is ended, or one that nobody has told to arm.
    """

    direct: Command | None = None

    def __init__(self, member: Member, now: float) -> None:
        self.phase = member.mission.phase
        position = member.state(0).position
        self._nominal = Nominal(position) if member.mission.nominal(now) else None

    def nominal(self, now: float) -> Nominal | None:
        """Return the place, None where nobody steered it."""
        return self._nominal

    def update(self, now: float, me: VehicleState, team: Mapping[str, VehicleState]) -> None:
        """Do nothing."""


class ComeToRest:
    """Brings one external vehicle to hold, then does `at_end` (land, hold, return) with it.

    Rovers stop and disarm for `land`, and are braked before they are put on hold. A copter that
    would land on somebody moves aside first. Each step is confirmed by the vehicle's heartbeat. A
    vehicle in a mode that we have not put it into has a pilot, who keeps it.
    """

    def __init__(self, member: Member, scenario: Scenario, at_end: str, now: float) -> None:
        self.phase = member.mission.phase
        self.direct: Command | None = None
        self.done = False
        self._spec: RobotSpec = member.spec
        self._station = member.station
        self._tell = member.tell
        self._at_end = at_end
        self._last_mode = _LAST_MODE.get(at_end)
        self._fence = scenario.fence
        self._rovers = {spec.name for spec in scenario.robots if spec.kind == "rover"}
        self._brake = Brake()
        self._nominal: Nominal | None = None  # where a copter gets clear
        self._clear_by: float | None = None
        self._stuck = False
        self._timeout = scenario.team.state_timeout_s
        self._give_up_at = now + WATCH_S
        self._hold_until = now + _HOLD_S
        self._holds = False
        self._request: Request | None = None
        self._retry_at = 0.0
        self._stands_since = now
        # An arming that is under way would be asked for again, and might still succeed.
        self._may_arm = self.phase is Phase.STARTING and not self._station.status.armed
        if self._may_arm:
            self._tell("rest", "is not to arm any more")
        elif not self._station.status.armed:
            self._finish("")
        elif self._has_pilot():
            self._leave_to_pilot()
        elif self._is_ending():
            self._tell("rest", f"is in {self._station.mode_name()} already")
        else:
            then = "" if at_end == "hold" else f", then {self._end_in_words()}"
            self._tell("rest", f"is brought to hold{then}")

    def nominal(self, now: float) -> Nominal | None:
        """Return the place where it gets clear to land; None: nobody steers it any more."""
        return self._nominal

    def update(self, now: float, me: VehicleState, team: Mapping[str, VehicleState]) -> None:
        """Go one step further; `done` says that no more will be done."""
        if self.done:
            return
        if hypot(*me.velocity) > STANDING:
            self._stands_since = now
        self._nominal = None
        self.direct = HOLD if self._station.in_mode(Mode.GUIDED) else None
        if self._may_arm:
            self._insist(now, self._station.disarm)
            self._may_arm = self._request is None or not self._request.done
        elif not me.armed:
            self._finish("is disarmed")
        elif now > self._give_up_at:
            self._finish(f"is still armed, in {self._station.mode_name()}")
        elif self._is_ending():
            self._watch(now)
        elif self._has_pilot():
            self._leave_to_pilot()
        elif not self._holds:
            self._hold(now, me)
        elif self._at_end == "hold":
            self._finish("holds, armed")
        elif self._last_mode is Mode.LAND and self._gets_clear(now, me, team):
            pass
        elif self._last_mode is not None and not self._disarms_at_once():
            self._insist(now, self._land if self._at_end == "land" else self._return)
        else:
            self._insist(now, self._station.disarm)

    def _hold(self, now: float, me: VehicleState) -> None:
        brakes = self._spec.kind == "rover" and self._station.in_mode(Mode.GUIDED)
        if brakes and not self._brake.stands(now, me.velocity):
            self._hold_until = now + _HOLD_S
            return
        if self._station.in_mode(Mode.HOLD) or now > self._hold_until:
            self._holds = True
            self._request = None
            if not self._station.in_mode(Mode.HOLD):
                self._tell("rest", f"does not hold: it is in {self._station.mode_name()}")
            return
        self._insist(now, lambda at: self._station.set_mode(Mode.HOLD, at))

    def _gets_clear(self, now: float, me: VehicleState, team: Mapping[str, VehicleState]) -> bool:
        """Return whether it must not land yet; it then moves, under the law, to where it can."""
        under = below(me, team, self._rovers) if self._spec.kind == "quadcopter" else ""
        if self._clear_by is None:
            if not under:
                return False
            self._clear_by = now + _CLEAR_S
            self._tell("rest", f"moves aside to land: {under} is below")
        if now > self._clear_by:
            self._tell_stuck(under)
            return False
        guided = self._station.in_mode(Mode.GUIDED)
        if not under:
            return guided and hypot(*me.velocity) > _SLOW  # it brakes
        if not guided:
            self.direct = HOLD  # some want to see set-points first
            self._insist(now, lambda at: self._station.set_mode(Mode.GUIDED, at))
        elif place := place_aside(me, team, self._rovers, self._fence):
            self._go_aside(now, place, team)
        return True

    def _go_aside(self, now: float, place: Triple, team: Mapping[str, VehicleState]) -> None:
        """Go there, under the law, which would hold for ever beside one of whom nothing is known.

        So it does where the others' coordinators have ended: then nobody moves any more.
        """
        if any(now - other.time > self._timeout for other in team.values()):
            self.direct = Command(position=place)
        else:
            self._nominal = Nominal(place)

    def _tell_stuck(self, under: str) -> None:
        if under and not self._stuck:
            self._tell("rest", f"lands all the same: {under} is below")
        self._stuck = True

    def _is_ending(self) -> bool:
        return any(self._station.in_mode(mode) for mode in _ENDING)

    def _has_pilot(self) -> bool:
        return not any(self._station.in_mode(mode) for mode in (*_OURS, *_ENDING))

    def _leave_to_pilot(self) -> None:
        self._finish(f"is in {self._station.mode_name()}: left to its pilot")

    def _disarms_at_once(self) -> bool:
        """Return whether its end is to stand and disarm: a rover's."""
        return self._spec.kind == "rover" and self._at_end == "land"

    def _watch(self, now: float) -> None:
        """See a vehicle down, which then disarms itself; a rover that is home does not."""
        self.phase = Phase.LANDING
        if self._spec.kind == "rover" and now - self._stands_since > _STANDS_S:
            self._insist(now, self._station.disarm)

    def _land(self, now: float) -> Request:
        return self._station.land(now)

    def _return(self, now: float) -> Request:
        return self._station.set_mode(Mode.RTL, now)

    def _insist(self, now: float, send: Callable[[float], Request]) -> None:
        """Ask, and ask again as long as it does not show."""
        if self._request is None or (self._request.done and now >= self._retry_at):
            self._request = send(now)
            self._retry_at = now + _RETRY_S

    def _end_in_words(self) -> str:
        if self._at_end == "return":
            return "return"
        return "disarm" if self._spec.kind == "rover" else "land"

    def _finish(self, text: str) -> None:
        self.done = True
        self.direct = None
        if text:
            self._tell("rest", text)
