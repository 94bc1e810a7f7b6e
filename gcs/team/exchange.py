"""Shares one coordinator's vehicles on Zenoh, and learns of everybody else's from it."""

import time
from collections.abc import Mapping

from ...transport.bus import Bus, Mailbox, Publisher
from ...transport.errors import VehicleError
from ...transport.wire import (
    VehicleState,
    WireError,
    pack_state,
    pack_target,
    pack_team,
    unpack_state,
)
from ...vehicles.process import LIVENESS_S
from .coordinator import Coordinator

REPEAT_S = 0.05  # a state that somebody may have missed while joining is sent again
TARGET_HZ = 5  # on the bus, for those who watch; the vehicles get every one
_LOOK_EVERY = 10  # ticks between two looks at who listens
_PRESENT_S = 3.0  # without a heartbeat for so long a vehicle is no longer present


class Exchange:
    """States and targets of a coordinator's own vehicles out, states of the others in."""

    def __init__(self, core: Coordinator, bus: Bus, *, lockstep: bool) -> None:
        own = tuple(core.members)
        self.alone = len(own) == len(core.scenario.robots)
        self._core = core
        self._bus = bus
        self._lockstep = lockstep
        self._target_every = max(1, round(core.scenario.team.rate_hz / TARGET_HZ))
        self._states = {n: bus.publisher(f"vehicle/{n}/state") for n in own}
        self._targets = {n: bus.publisher(f"vehicle/{n}/target") for n in own}
        self._team: Publisher | None = bus.publisher("team") if self.alone else None
        self._others = Mailbox() if self.alone else bus.latest("vehicle/*/state")
        self._tokens = {n: bus.declare_token(f"vehicle/{n}/alive") for n in own}
        self._present = dict.fromkeys(own, True)
        self._packed: dict[str, bytes] = {}  # our states of this tick
        self._followed: set[str] = set()  # whose states somebody listens to
        self._watched: set[str] = set()  # and whose targets

    def share(self, now: float) -> list[VehicleState]:
        """Begin a tick: publish our states, return everybody's; in lockstep those of this tick."""
        states = self._core.states()
        packed = self._packed = {state.name: pack_state(state) for state in states}
        self._publish(packed, now)
        if not self._team:
            return self._gather(now, packed)
        known = [packed[state.name] for state in states if state.time >= 0]
        self._team.put(pack_team(self._core.sequence, known))
        return states

    def publish_targets(self) -> None:
        """Say now and then, to those who watch, what our vehicles were asked to do."""
        for turn, (name, publisher) in enumerate(self._targets.items(), self._core.sequence):
            target = self._core.members[name].target
            if target and turn % self._target_every == 0 and name in self._watched:
                publisher.put(pack_target(target))

    def repeat(self) -> None:
        """Send our newest states again, for coordinators whose subscription came too late."""
        for name, data in self._packed.items():
            self._states[name].put(data)

    def _publish(self, packed: Mapping[str, bytes], now: float) -> None:
        if self._core.sequence % _LOOK_EVERY == 1:
            self._followed = {n for n, p in self._states.items() if not self.alone or p.wanted}
            self._watched = {n for n, p in self._targets.items() if p.wanted}
        for name in self._followed:
            self._states[name].put(packed[name])
        for name, member in self._core.members.items():
            silent = now - max(0.0, member.station.status.heartbeat_at)
            if self._present[name] != (silent < _PRESENT_S):
                self._present[name] = silent < _PRESENT_S
                if self._present[name]:
                    self._tokens[name] = self._bus.declare_token(f"vehicle/{name}/alive")
                else:
                    self._tokens[name].undeclare()

    def _gather(self, now: float, own: Mapping[str, bytes]) -> list[VehicleState]:
        """Return the states of all vehicles, in lockstep those of this very tick."""
        deadline = time.monotonic() + LIVENESS_S
        names = [r.name for r in self._core.scenario.robots]
        while True:
            self._others.arrived.clear()
            heard = self._others.latest
            team = {}
            for name in names:
                data = own.get(name) or heard.get(f"vehicle/{name}/state")
                if data is None:
                    continue
                try:
                    team[name] = unpack_state(data)
                except WireError as error:
                    self._core.tell(now, name, "bus", str(error))
                    del heard[f"vehicle/{name}/state"]
            late = [
                name
                for name in names
                if name not in team or team[name].sequence != self._core.sequence
            ]
            if not late or not self._lockstep:
                return list(team.values())
            if time.monotonic() > deadline:
                raise VehicleError(f"no state of {', '.join(late)} came over Zenoh at {now:.2f} s")
            if not self._others.arrived.wait(REPEAT_S):
                self.repeat()
