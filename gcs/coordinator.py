"""The coordinator: vehicles' MAVLink in, shared states in and out, setpoints out. No I/O.

Central and distributed runs are this same class with different vehicle lists. ENU on this side;
the stations speak NED, and the border is here.
"""

from collections.abc import Mapping

from ..scenarios.schema import RobotSpec, Scenario
from ..transport.frames import quaternion_to_enu, swap_ned_enu, swap_yaw, yaw_of
from ..transport.wire import Phase, Target, VehicleState
from ..vehicles.build import parameter_values
from .laws import HOLD, Command, Law, Peer, make_law
from .mission import Mission
from .station import Station, StationError, Tap

LOST_S = 10.0  # a vehicle silent for so long ends the run
_STILL = (0.0, 0.0, 0.0)
_VERTICAL = (Phase.STARTING, Phase.LANDING)


class Event(dict[str, object]):
    """One line of events.jsonl: t (s), vehicle (name or None), kind, text."""


class Member:
    """One vehicle of this coordinator: its station, mission and law."""

    def __init__(
        self, spec: RobotSpec, scenario: Scenario, tap: Tap | None, events: list[Event]
    ) -> None:
        team = scenario.team
        self.spec = spec
        self.station = Station(spec.name, spec.system_id, team.rate_hz, tap)
        self.mission = Mission(spec, scenario, self.station, self._tell)
        v_max = parameter_values(spec.kind, spec.profile, spec.params)["v_max"]
        self.law: Law = make_law(
            team.law,
            kind=spec.kind,
            v_max=v_max,
            state_timeout=team.state_timeout_s,
            params=team.law_params,
        )
        self.target: Target | None = None
        self.now = 0.0
        self._events = events

    def _tell(self, kind: str, text: str) -> None:
        self._events.append(Event(t=self.now, vehicle=self.spec.name, kind=kind, text=text))


class Coordinator:
    """Steers its own vehicles among all vehicles of the scenario."""

    def __init__(
        self, scenario: Scenario, own: tuple[str, ...], taps: Mapping[str, Tap] | None = None
    ) -> None:
        self.scenario = scenario
        self.events: list[Event] = []  # the caller takes them
        self._kinds = {spec.name: spec.kind for spec in scenario.robots}
        self.members = {
            spec.name: Member(spec, scenario, (taps or {}).get(spec.name), self.events)
            for spec in scenario.robots
            if spec.name in own
        }
        self.sequence = 0  # the tick

    def receive(self, name: str, data: bytes, now: float) -> None:
        """Take in what one of its vehicles sent."""
        self.members[name].station.receive(data, now)

    def states(self) -> list[VehicleState]:
        """Begin a tick: return the states of its own vehicles; a negative time says unknown."""
        self.sequence += 1
        return [self._state(member) for member in self.members.values()]

    def tick(self, now: float, states: list[VehicleState]) -> dict[str, bytes]:
        """Decide with everybody's `states` and return what to send to each own vehicle.

        Raises StationError when a vehicle cannot start or has fallen silent.
        """
        team = {state.name: state for state in states if state.time >= 0}
        complete = len(team) == len(self.scenario.robots)
        peers = {name: self._peer(state, now) for name, state in team.items()}
        for name, member in self.members.items():
            member.now = now
            self._watch(member, now)
            me = team.get(name)
            if me is not None and complete:
                member.mission.update(now, me, team)
                neighbours = [peer for other, peer in peers.items() if other != name]
                self._steer(member, peers[name], neighbours, now)
        return {name: m.station.transmit(now) for name, m in self.members.items()}

    @property
    def finished(self) -> bool:
        """Whether every own vehicle is done."""
        return all(m.mission.phase is Phase.DONE for m in self.members.values())

    def tell(self, now: float, vehicle: str | None, kind: str, text: str) -> None:
        """Note an event."""
        self.events.append(Event(t=now, vehicle=vehicle, kind=kind, text=text))

    def take_events(self) -> list[Event]:
        """Return and forget what has happened since the last call."""
        taken = self.events[:]
        self.events.clear()
        return taken

    def _state(self, member: Member) -> VehicleState:
        status = member.station.status
        return VehicleState(
            member.spec.name,
            member.spec.system_id,
            self.sequence,
            status.position_at if status.heartbeat_at >= 0 else -1.0,
            swap_ned_enu(status.position),
            swap_ned_enu(status.velocity),
            quaternion_to_enu(status.quaternion),
            status.custom_mode,
            status.armed,
            member.mission.phase,
        )

    def _peer(self, state: VehicleState, now: float) -> Peer:
        kind = self._kinds[state.name]
        return Peer(
            state.system_id,
            kind,
            state.position,
            state.velocity,
            yaw_of(state.quaternion),
            max(0.0, now - state.time),
            kind == "quadcopter" and state.phase in _VERTICAL,
        )

    def _watch(self, member: Member, now: float) -> None:
        """Pass on what the vehicle says; give up on one that has been silent for too long."""
        for at, severity, text in member.station.new_texts():
            self.events.append(
                Event(t=at, vehicle=member.spec.name, kind="text", text=text, severity=severity)
            )
        silent = now - max(0.0, member.station.status.heartbeat_at)
        if silent > LOST_S:
            raise StationError(f"{member.spec.name}: no heartbeat for {silent:.0f} s")

    def _steer(self, member: Member, me: Peer, neighbours: list[Peer], now: float) -> None:
        nominal = member.mission.nominal(now)
        if nominal is None:
            member.target = None
            return
        command = member.law(me, neighbours, nominal)
        self._send(member, command, now)
        member.target = Target(
            member.spec.name,
            now,
            nominal.position,
            nominal.velocity,
            command.velocity or _STILL,
            command.feed_forward,
        )

    def _send(self, member: Member, command: Command, now: float) -> None:
        if command == HOLD:
            command = Command(velocity=_STILL)
        member.station.send_target(
            now,
            position=_ned(command.position),
            velocity=_ned(command.velocity),
            acceleration=_ned(command.acceleration),
            yaw=None if command.yaw is None else swap_yaw(command.yaw),
            yaw_rate=None if command.yaw_rate is None else -command.yaw_rate,
        )


def _ned(v: tuple[float, float, float] | None) -> tuple[float, float, float] | None:
    return None if v is None else swap_ned_enu(v)


def check_laws(scenario: Scenario) -> None:
    """Raise LawError now, not in a process of its own, when the team's law cannot be made."""
    for kind in {spec.kind for spec in scenario.robots}:
        make_law(scenario.team.law, kind=kind, v_max=1.0, params=scenario.team.law_params)
