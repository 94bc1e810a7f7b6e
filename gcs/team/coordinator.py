"""The coordinator: vehicles' MAVLink in, shared states in and out, setpoints out. No I/O.

Central and distributed runs are this same class with different vehicle lists. ENU on this side;
the stations speak NED, and the border is at each member.
"""

from collections.abc import Mapping

from ...scenarios.schema import Scenario
from ...transport.frames import yaw_of
from ...transport.wire import Phase, VehicleState
from ..laws import LAWS, LawError, Peer, make_law, reach_of
from ..safety.rest import ComeToRest, StayPut
from ..station import StationError, Tap
from .member import LOST_S, Conduct, Event, MakeConduct, Member
from .mission import Mission
from .neighbours import WORTH_IT, Neighbours

__all__ = ["LOST_S", "Conduct", "Coordinator", "Event", "MakeConduct", "Member", "check_laws"]

_VERTICAL = (Phase.STARTING, Phase.LANDING)
_LATE = 1.5  # periods between two ticks: more is late
_FORGET = 0.97  # of a lateness is left after a tick on time


class Coordinator:
    """Steers its own vehicles among all vehicles of the scenario, each by its `conduct`.

    `strict`: nobody begins before all are known, and a vehicle that is lost or refuses ends the
    run. Otherwise (scripts) such a vehicle has a `problem` while that lasts; the others go on.
    With `index_from` own vehicles times all, neighbours are found by an index.
    """

    def __init__(
        self,
        scenario: Scenario,
        own: tuple[str, ...],
        taps: Mapping[str, Tap] | None = None,
        conduct: MakeConduct = Mission,
        *,
        strict: bool = True,
        index_from: float = WORTH_IT,
    ) -> None:
        self.scenario = scenario
        self.events: list[Event] = []  # the caller takes them
        self._kinds = {spec.name: spec.kind for spec in scenario.robots}
        self.members = {
            spec.name: Member(
                spec,
                scenario,
                (taps or {}).get(spec.name),
                self.events,
                conduct,
                strict=strict,
            )
            for spec in scenario.robots
            if spec.name in own
        }
        crowd = len(self.members) * len(scenario.robots)
        timeout = scenario.team.state_timeout_s
        self._index = Neighbours(timeout) if crowd >= index_from else None
        self.sequence = 0  # the tick
        self._strict = strict
        self._ticked_at: float | None = None
        self._lateness = 0.0  # s, the worst of late, fading: who was late will be so again
        self._resting: dict[str, ComeToRest] = {}

    def receive(self, name: str, data: bytes, now: float) -> None:
        """Take in what one of its vehicles sent."""
        self.members[name].station.receive(data, now)

    def states(self) -> list[VehicleState]:
        """Begin a tick: return the states of its own vehicles; a negative time says unknown."""
        self.sequence += 1
        return [member.state(self.sequence) for member in self.members.values()]

    def tick(self, now: float, states: list[VehicleState]) -> dict[str, bytes]:
        """Decide with everybody's `states` and return what to send to each own vehicle."""
        self.decide(now, states)
        return self.transmit(now)

    def decide(self, now: float, states: list[VehicleState]) -> None:
        """Find out with everybody's `states` what each own vehicle is to do next.

        Raises StationError when a vehicle cannot start or has fallen silent.
        """
        self._note_lateness(now)
        team = {state.name: state for state in states if state.time >= 0}
        complete = len(team) == len(self.scenario.robots) or not self._strict
        around = self._look_around(team, now) if complete else {}
        for name, member in self.members.items():
            me = team.get(name)
            try:
                member.watch(now)
                if me is not None and complete:
                    member.mission.update(now, me, team)
                    member.problem = ""
            except StationError as error:
                if self._strict:
                    raise
                self._give_up(member, str(error))
                if me is not None and name in self._resting:  # which goes on whatever is wrong
                    member.mission.update(now, me, team)
            if name in around:
                member.steer(*around[name], now)

    def transmit(self, now: float) -> dict[str, bytes]:
        """Return what to send to each own vehicle, beside its setpoint what is due."""
        return {name: m.station.transmit(now) for name, m in self.members.items()}

    @property
    def prepared(self) -> bool:
        """Whether every own vehicle may be steered: external ones, once they are cleared."""
        return all(member.prepared for member in self.members.values())

    @property
    def finished(self) -> bool:
        """Whether every own vehicle is done."""
        return all(m.mission.phase is Phase.DONE for m in self.members.values())

    def come_to_rest(self, now: float, at_end: str) -> None:
        """Break off: bring external vehicles that are under way to rest; see `at_rest`.

        From here on a vehicle that is lost or refuses does not keep the others from it.
        """
        self._strict = False
        for name, member in self.members.items():
            member.now = now
            if not member.spec.external or member.mission.phase is Phase.WAITING:
                member.mission = StayPut(member, now)
            else:
                self.bring_to_rest(name, now, at_end)

    def bring_to_rest(self, name: str, now: float, at_end: str) -> ComeToRest:
        """Bring one vehicle to rest, which from here on goes on whatever is wrong with it."""
        member = self.members[name]
        member.now = now
        rest = ComeToRest(member, self.scenario, at_end, now)
        member.mission = self._resting[name] = rest
        return rest

    @property
    def at_rest(self) -> bool:
        """Whether all that `come_to_rest` has begun is done, or cannot be.

        It cannot with vehicles that are lost, nor with those that reboot: nothing holds of them.
        """
        members = self.members
        return all(
            rest.done or members[name].is_lost or not members[name].prepared
            for name, rest in self._resting.items()
        )

    def tell(self, now: float, vehicle: str | None, kind: str, text: str) -> None:
        """Note an event."""
        self.events.append(Event(t=now, vehicle=vehicle, kind=kind, text=text))

    def take_events(self) -> list[Event]:
        """Return and forget what has happened since the last call."""
        taken = self.events[:]
        self.events.clear()
        return taken

    def _look_around(
        self, team: Mapping[str, VehicleState], now: float
    ) -> dict[str, tuple[Peer, list[Peer]]]:
        """Return own vehicles that are known, each with those of the others who may matter."""
        kinds, late = self._kinds, self._lateness
        peers: list[Peer] = []
        for name, system_id, _, time, position, velocity, q, _, _, phase in team.values():
            kind = kinds[name]
            vertical = kind == "quadcopter" and phase in _VERTICAL
            age = now - time if now > time else 0.0
            peers.append(Peer(system_id, kind, position, velocity, yaw_of(q), age, vertical, late))
        own = [(i, name) for i, name in enumerate(team) if name in self.members]
        if self._index is None:
            return {name: (peers[i], peers[:i] + peers[i + 1 :]) for i, name in own}
        timeout = self.scenario.team.state_timeout_s
        oldest = max((p.age for p in peers if p.age <= timeout), default=0.0)
        reaches = [reach_of(self.members[name].law, oldest, late) for _, name in own]
        near = self._index.of(peers, [i for i, _ in own], reaches)
        return {name: (peers[i], n) for (i, name), n in zip(own, near, strict=True)}

    def _note_lateness(self, now: float) -> None:
        """Remember by how much this tick is later than it should be; never so in lockstep."""
        if self._ticked_at is not None:
            late = now - self._ticked_at - _LATE / self.scenario.team.rate_hz
            self._lateness = max(late, _FORGET * self._lateness, 0.0)
        self._ticked_at = now

    def _give_up(self, member: Member, problem: str) -> None:
        if not member.problem:
            member.tell("problem", problem)
        member.problem = problem


def check_laws(scenario: Scenario) -> None:
    """Raise LawError now, not in a process of its own, when the team's law cannot be made."""
    team = scenario.team
    try:
        for kind in {spec.kind for spec in scenario.robots}:
            make_law(team.law, kind=kind, v_max=1.0, params=team.law_params)
    except LawError as error:
        place = team.law_params_at if team.law in LAWS else team.law_at
        raise LawError(f"{place}: {error}" if place else str(error)) from None
