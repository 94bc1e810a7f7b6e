"""What comes to the recorder while a run goes on: over Zenoh, and in the run's event log."""

import json
import sys
from collections.abc import Callable, Collection
from math import isfinite
from pathlib import Path
from typing import Any

from ...transport.bus import Bus
from ...transport.wire import SNAPSHOT_HZ, Snapshot, WireError, unpack_snapshot
from .scene import Scene

QUEUE = 1 << 11  # snapshots between two batches of a run in a hurry
PER_ROBOT = 1 << 7  # and so many more for each, which may have a coordinator of its own
_SLACK = 1e-3  # of a moment: times are sums of steps


class Inbox:
    """Keeps what has come and is not recorded yet; from its making on nothing is missed.

    Each coordinator tells of its vehicles now and then, and those of one moment are handed over
    together: when all of `robots` are, or when later ones have come. Who is frozen misses some:
    nobody waits for a recording. Events come from their log, where all of them are.
    """

    def __init__(self, folder: Path, bus: Bus, robots: Collection[str]) -> None:
        self.now = 0.0  # s of fleet time, the newest that was told
        self._robots = frozenset(robots)
        self._snapshots = bus.queue("snapshot", QUEUE + PER_ROBOT * len(robots))
        self._moments: dict[int, list[Snapshot]] = {}  # not handed over yet, by 1/SNAPSHOT_HZ s
        self._log = (folder / "events.jsonl").open("rb")
        self._torn = b""  # the last line, as long as it has no end
        self._bad: set[str] = set()

    def deliver(self, scene: Scene, *, everything: bool = False) -> None:
        """Hand over what belongs together, or `everything` there is."""
        for key, data in self._snapshots.drain():
            self._try(key, self._sort, data)
        newest = max(self._moments, default=0)
        for moment in sorted(self._moments):
            told = self._moments[moment]
            states = {state.name: state for snapshot in told for state in snapshot.states}
            if everything or moment < newest - 1 or self._robots <= states.keys():
                del self._moments[moment]
                scene.add_states([*states.values()], max(snapshot.now for snapshot in told))
                scene.add_targets([target for snapshot in told for target in snapshot.targets])
        *lines, self._torn = (self._torn + self._log.read()).split(b"\n")
        for line in lines:
            self._try("events.jsonl", self._add_event, scene, line)

    def close(self) -> None:
        """Close the event log."""
        self._log.close()

    def _sort(self, data: bytes) -> None:
        snapshot = unpack_snapshot(data)
        if not isfinite(snapshot.now):
            raise WireError(f"snapshot: of no moment ({snapshot.now})")
        self.now = max(self.now, snapshot.now)
        moment = int(snapshot.now * SNAPSHOT_HZ + _SLACK)
        self._moments.setdefault(moment, []).append(snapshot)

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
