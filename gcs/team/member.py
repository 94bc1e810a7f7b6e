"""One vehicle of a coordinator: its station, what it does next, its law."""

from collections.abc import Callable, Mapping
from typing import Protocol

from ...scenarios.paths import top_speed
from ...scenarios.schema import RobotSpec, Scenario
from ...transport.frames import quaternion_to_enu, swap_ned_enu, swap_yaw
from ...transport.wire import Phase, Target, VehicleState
from ..laws import Command, Law, Nominal, Peer, make_law
from ..safety.clearance import Clearance
from ..station import Station, StationError, Tap, stack_of
from .fence import confine, confine_along
from .mission import Tell
from .setpoints import Setpoint, form_of, full, setpoint

LOST_S = 10.0  # a vehicle silent for so long ends the run


class Event(dict[str, object]):
    """One line of events.jsonl: t (s), vehicle (name or None), kind, text."""


class Conduct(Protocol):
    """What one vehicle does next: a mission, the orders of a script, an orderly end."""

    @property
    def phase(self) -> Phase:
        """How far it is."""
        ...

    @property
    def direct(self) -> Command | None:
        """What to send as it is, past the law, while there is no nominal target."""
        ...

    def nominal(self, now: float) -> Nominal | None:
        """Return where the vehicle would go were it alone; None while nobody steers it."""
        ...

    def update(self, now: float, me: VehicleState, team: Mapping[str, VehicleState]) -> None:
        """Decide what comes next; `team` holds everybody who is known, `me` included."""
        ...


MakeConduct = Callable[[RobotSpec, Scenario, Station, Tell], Conduct]


class Member:
    """One vehicle of this coordinator.

    `mission` may be replaced by another conduct at any time. `problem` says why the vehicle is
    not steered at the moment; "": it is. `complaint` is that of its line, if it has one.
    """

    def __init__(
        self,
        spec: RobotSpec,
        scenario: Scenario,
        tap: Tap | None,
        events: list[Event],
        conduct: MakeConduct,
        *,
        strict: bool = True,
    ) -> None:
        team = scenario.team
        self.spec = spec
        self.station = Station(
            spec.name,
            spec.system_id,
            team.rate_hz,
            tap,
            kind=spec.kind,
            stack=stack_of(spec.autopilot),
            origin=scenario.origin if spec.external else None,
        )
        self.mission: Conduct = conduct(spec, scenario, self.station, self.tell)
        self.v_max = top_speed(spec)
        self.law: Law = make_law(
            team.law,
            kind=spec.kind,
            v_max=self.v_max,
            state_timeout=team.state_timeout_s,
            params=team.law_params,
        )
        self.clearance = (
            Clearance(spec, scenario, self.station, self.tell, lasts=not strict)
            if spec.external
            else None
        )
        self.complaint = ""
        self.problem = ""
        self.now = 0.0
        self._fence = scenario.fence
        self._follows_all = not spec.external  # our own do
        self._events = events
        self._silent_s = team.state_timeout_s
        self._silent_since: float | None = None
        self._asked: tuple[float, Nominal, Command] | None = None  # when, and of what it came

    @property
    def prepared(self) -> bool:
        """Whether it may be steered: our own vehicles always, others once they are cleared."""
        return self.clearance is None or self.clearance.given

    @property
    def is_lost(self) -> bool:
        """Whether it has been silent for too long."""
        return self.now - max(0.0, self.station.status.heartbeat_at) > LOST_S

    def tell(self, kind: str, text: str) -> None:
        """Note an event of this vehicle."""
        self._events.append(Event(t=self.now, vehicle=self.spec.name, kind=kind, text=text))

    def state(self, sequence: int) -> VehicleState:
        """Return what it says of itself, in ENU; a negative time says unknown."""
        status = self.station.status
        known = status.heartbeat_at >= 0 and self.prepared
        return VehicleState(
            self.spec.name,
            self.spec.system_id,
            sequence,
            status.position_at if known else -1.0,
            swap_ned_enu(status.position),
            swap_ned_enu(status.velocity),
            quaternion_to_enu(status.quaternion),
            status.custom_mode,
            status.armed,
            self.mission.phase,
        )

    def watch(self, now: float) -> None:
        """Pass on what the vehicle says; raise StationError when it must be given up."""
        self.now = now
        if self._is_well(now):
            return
        for at, severity, text in self.station.new_texts():
            event = Event(t=at, vehicle=self.spec.name, kind="text", text=text, severity=severity)
            self._events.append(event)
        self._watch_link()
        if self.clearance:
            begun = self.mission.phase is not Phase.WAITING
            self.clearance.update(now, self.complaint, begun=begun)
        if self.is_lost and self.prepared:
            silent = now - max(0.0, self.station.status.heartbeat_at)
            raise StationError(f"{self.spec.name}: no heartbeat for {silent:.0f} s")

    def _is_well(self, now: float) -> bool:
        """Return whether there is nothing to tell, which is so nearly always."""
        if self.clearance or self._silent_since is not None or self.station.has_new_texts:
            return False
        status = self.station.status
        in_touch = now - status.heard_at <= self._silent_s
        return in_touch and now - status.heartbeat_at <= LOST_S

    def _watch_link(self) -> None:
        """Tell when the vehicle falls silent, once it has sent positions, and when it is back."""
        status = self.station.status
        since = self._silent_since
        if since is not None and status.heard_at > since:
            self.tell("link", f"link back after {status.heard_at - since:.1f} s")
            self._silent_since = None
        silent = self.now - status.heard_at > self._silent_s
        if silent and self._silent_since is None and status.position_at >= 0:
            self._silent_since = status.heard_at
            self.tell("link", "link silent")

    def steer(self, me: Peer, neighbours: list[Peer], now: float) -> None:
        """Send what its conduct and its law make of the moment."""
        nominal = self.mission.nominal(now)
        if nominal is None:
            self._asked = None
            if direct := self.mission.direct:
                self._send(me, direct, now)
            return
        self._asked = (now, nominal, self._send(me, self.law(me, neighbours, nominal), now))

    @property
    def target(self) -> Target | None:
        """What it was asked to do last, None while nobody steers it; for those who watch."""
        if self._asked is None:
            return None
        now, nominal, command = self._asked
        return Target(
            self.spec.name,
            now,
            nominal.position,
            nominal.velocity,
            command.velocity or (0.0, 0.0, 0.0),
            command.feed_forward,
        )

    def _send(self, me: Peer, command: Command, now: float) -> Command:
        """Send `command` in the form that the vehicle follows; return it as the fence leaves it."""
        if self._fence:
            command = confine(self._fence, me.position, command)
        position, velocity, acceleration, yaw, yaw_rate, forward = (
            full(command) if self._follows_all else self._formed(me, command)
        )
        along_nose = None
        if forward is not None:
            if self._fence:
                forward = confine_along(self._fence, me.position, me.heading, forward)
            along_nose = (forward, 0.0, 0.0)
        self.station.send_target(
            now,
            position=None if position is None else swap_ned_enu(position),
            velocity=along_nose or (None if velocity is None else swap_ned_enu(velocity)),
            acceleration=None if acceleration is None else swap_ned_enu(acceleration),
            yaw=None if yaw is None else swap_yaw(yaw),
            yaw_rate=None if yaw_rate is None else -yaw_rate,
        )
        return command

    def _formed(self, me: Peer, command: Command) -> Setpoint:
        return setpoint(form_of(self.spec, self.station.stack), command, me, self.v_max)
