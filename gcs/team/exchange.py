"""Shares one coordinator's vehicles on Zenoh, and learns of everybody else's from it."""

import time

from ...transport.bus import Bus, Mailbox
from ...transport.errors import VehicleError
from ...transport.local_bus import LocalBus
from ...transport.wire import (
    CROWD,
    SNAPSHOT_HZ,
    VehicleState,
    WireError,
    pack_snapshot,
    pack_state,
    pack_target,
    pack_team,
    unpack_state,
)
from ...vehicles.grants import LIVENESS_S
from .coordinator import Coordinator

REPEAT_S = 0.05  # a state that somebody may have missed while joining is sent again
TARGET_HZ = 5  # of one vehicle on the bus, for those who watch; the vehicle gets every one
_LOOK_EVERY = 10  # ticks between two looks at who listens
_PRESENT_S = 3.0  # without a heartbeat for so long a vehicle is no longer present


class Exchange:
    """States and targets of a coordinator's own vehicles out, states of the others in."""

    def __init__(self, core: Coordinator, bus: Bus | LocalBus, *, lockstep: bool) -> None:
        own = tuple(core.members)
        self.alone = len(own) == len(core.scenario.robots)
        self._core = core
        self._bus = bus
        self._lockstep = lockstep
        self._target_every = max(1, round(core.scenario.team.rate_hz / TARGET_HZ))
        self._states = {n: bus.publisher(f"vehicle/{n}/state") for n in own}
        self._targets = {n: bus.publisher(f"vehicle/{n}/target") for n in own}
        self._team = bus.publisher("team") if self.alone else None
        self._snapshots = bus.publisher("snapshot", for_onlookers=True)
        snapshot_hz = SNAPSHOT_HZ / 2 if len(core.scenario.robots) > CROWD else SNAPSHOT_HZ
        self._snapshot_every = max(1, round(core.scenario.team.rate_hz / snapshot_hz))
        self._others = Mailbox() if self.alone else bus.latest("vehicle/*/state")
        self._tokens = {n: bus.declare_token(f"vehicle/{n}/alive") for n in own}
        self._present = dict.fromkeys(own, True)
        self._keys = {spec.name: f"vehicle/{spec.name}/state" for spec in core.scenario.robots}
        self._now = 0.0  # fleet time of this tick
        self._offered: list[VehicleState] = []  # our states of it
        self._packed: dict[str, bytes] = {}  # those that somebody wants
        self._followed: set[str] = set()  # whose states somebody listens to
        self._watched: set[str] = set()  # and whose targets

    def offer(self, now: float) -> None:
        """Begin a tick: publish our states, as far as somebody listens."""
        self._now = now
        states = self._offered = self._core.states()
        if self._core.sequence % _LOOK_EVERY == 1:
            self._look_who_listens()
        if self._followed:
            self._packed = {s.name: pack_state(s) for s in states if s.name in self._followed}
            self.repeat()
        if self._team and self._team.wanted:
            self._team.put(self.known())
        for name, member in self._core.members.items():
            heard = member.station.status.heartbeat_at
            present = now - (heard if heard > 0.0 else 0.0) < _PRESENT_S
            if present != self._present[name]:
                self._tell_presence(name, present)

    def known(self) -> bytes:
        """Return our states of this tick in one message, as far as there are any."""
        known = [state for state in self._offered if state.time >= 0]
        return pack_team(self._core.sequence, known)

    def gather(self, now: float) -> list[VehicleState]:
        """Return the states of all vehicles, in lockstep those of this very tick."""
        return self._offered if self.alone else self._gather(now)

    def publish_targets(self) -> None:
        """Say now and then, to those who watch, what our vehicles were asked to do."""
        sequence = self._core.sequence
        if sequence % self._snapshot_every == 0 and self._snapshots.wanted:
            known = [state for state in self._offered if state.time >= 0]
            asked = [member.target for member in self._core.members.values()]
            targets = [target for target in asked if target is not None]
            self._snapshots.put(pack_snapshot(sequence, self._now, known, targets))
        if not self._watched:
            return
        for turn, (name, publisher) in enumerate(self._targets.items(), self._core.sequence):
            if turn % self._target_every == 0 and name in self._watched:
                target = self._core.members[name].target
                if target:
                    publisher.put(pack_target(target))

    def repeat(self) -> None:
        """Send our newest states again, for coordinators whose subscription came too late."""
        for name, data in self._packed.items():
            self._states[name].put(data)

    def _look_who_listens(self) -> None:
        self._followed = {n for n, p in self._states.items() if not self.alone or p.wanted}
        self._watched = {n for n, p in self._targets.items() if p.wanted}

    def _tell_presence(self, name: str, present: bool) -> None:
        self._present[name] = present
        if present:
            self._tokens[name] = self._bus.declare_token(f"vehicle/{name}/alive")
        else:
            self._tokens[name].undeclare()

    def _gather(self, now: float) -> list[VehicleState]:
        deadline = time.monotonic() + 1.5 * LIVENESS_S  # its coordinator has its say first
        sequence, heard = self._core.sequence, self._others.latest
        team = {state.name: state for state in self._offered}
        missing = [name for name in self._keys if name not in team]
        while True:
            self._others.arrived.clear()
            late = []
            for name in missing:
                data = heard.get(self._keys[name])
                if data is None:
                    late.append(name)
                    continue
                try:
                    team[name] = unpack_state(data)
                except WireError as error:
                    self._core.tell(now, name, "bus", str(error))
                    del heard[self._keys[name]]
                if name not in team or team[name].sequence != sequence:
                    late.append(name)
            if not late or not self._lockstep:
                return [team[name] for name in self._keys if name in team]
            if time.monotonic() > deadline:
                raise VehicleError(f"no state of {', '.join(late)} came over Zenoh at {now:.2f} s")
            missing = late
            if not self._others.arrived.wait(REPEAT_S):
                self.repeat()
