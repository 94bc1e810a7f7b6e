"""What comes to the recorder while a run goes on: over Zenoh, and in the run's event log."""

import json
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from ...scenarios.schema import Scenario
from ...transport.bus import Bus, Queue
from ...transport.wire import (
    VehicleState,
    WireError,
    unpack_snapshot,
    unpack_state,
    unpack_target,
)
from .scene import Scene

HZ = 10  # of fleet time: so much is recorded of what comes each tick
QUEUE = 1 << 11  # of what comes at that rate, between two batches of a run in a hurry


class Inbox:
    """Keeps what has come and is not recorded yet; from its making on nothing is missed.

    A central coordinator tells everything at once, now and then; where robots are steered `apart`,
    each coordinator tells of its own. Who is frozen misses some: nobody waits for a recording.
    Events come from their log, where all of them are.
    """

    def __init__(self, folder: Path, bus: Bus, scenario: Scenario, *, apart: bool = False) -> None:
        self.now = 0.0  # s of fleet time, the newest that was told
        self._every = max(1, round(scenario.team.rate_hz / HZ))
        self._snapshots = self._states = self._targets = None
        if apart:
            size = QUEUE * len(scenario.robots)
            self._states = bus.queue("vehicle/*/state", size)
            self._targets = bus.queue("vehicle/*/target", size)
        else:
            self._snapshots = bus.queue("snapshot", QUEUE)
        self._log = (folder / "events.jsonl").open("rb")
        self._torn = b""  # the last line, as long as it has no end
        self._bad: set[str] = set()

    def deliver(self, scene: Scene) -> None:
        """Hand everything over."""
        for key, data in self._drain(self._snapshots):
            self._try(key, self._add_snapshot, scene, data)
        ticks: dict[int, list[VehicleState]] = {}
        for key, data in self._drain(self._states):
            self._try(key, self._sort, data, ticks)
        for states in ticks.values():
            self.now = max(self.now, *(state.time for state in states))
            scene.add_states(states, self.now)
        for key, data in self._drain(self._targets):
            self._try(key, self._add_target, scene, data)
        *lines, self._torn = (self._torn + self._log.read()).split(b"\n")
        for line in lines:
            self._try("events.jsonl", self._add_event, scene, line)

    def close(self) -> None:
        """Close the event log."""
        self._log.close()

    def _drain(self, queue: Queue | None) -> Iterable[tuple[str, bytes]]:
        return queue.drain() if queue else ()

    def _add_snapshot(self, scene: Scene, data: bytes) -> None:
        snapshot = unpack_snapshot(data)
        self.now = snapshot.now
        scene.add_states(snapshot.states, snapshot.now)
        scene.add_targets(snapshot.targets)

    def _sort(self, data: bytes, ticks: dict[int, list[VehicleState]]) -> None:
        """Put a state to those of its tick, if that is to be recorded."""
        state = unpack_state(data)
        if state.sequence % self._every == 0:
            ticks.setdefault(state.sequence, []).append(state)

    def _add_target(self, scene: Scene, data: bytes) -> None:
        scene.add_targets([unpack_target(data)])

    def _add_event(self, scene: Scene, line: bytes) -> None:
        try:
            event: dict[str, Any] = json.loads(line)
            said = {"kind": str(event["kind"]), "text": str(event["text"])}
            event = {**event, **said, "t": float(event["t"]), "vehicle": event["vehicle"]}
        except (ValueError, KeyError, TypeError) as error:
            raise WireError(f"no event: {error!r}") from None
        scene.add_event(event)

    def _try(self, key: str, take: Callable[..., None], *what: Any) -> None:
        """Take one sample; complain once per key about those that are none."""
        try:
            take(*what)
        except WireError as error:
            if key not in self._bad:
                self._bad.add(key)
                print(f"mavherd recorder: {key}: {error}", file=sys.stderr, flush=True)
