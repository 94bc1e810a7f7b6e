"""The recorder: a process of its own that watches a run and writes `run.rrd` for Rerun.

`python -m mavherd.gcs.recording.recorder RUN_FOLDER ZENOH_ENDPOINT RUN_ID`. It listens on Zenoh and
follows the vehicles' truth logs, so nobody ever waits for it. It prints "ready" when it listens,
and finishes the file when its standard input ends. `RUN_FOLDER/robots.json` says who takes part.
"""

import json
import os
import select
import signal
import sys
from collections.abc import Callable
from pathlib import Path

from ...transport.bus import Bus, Queue
from ...transport.errors import MavherdError
from ...transport.wire import WireError, unpack_target, unpack_team
from ..report.truth import TruthTail
from .robots import RecordedRobot, read_robots
from .scene import Scene

PERIOD_S = 0.25  # of wall time, between batches; longer for a large team, whose batches cost more
PERIOD_PER_ROBOT_S = 0.02
QUEUE = 1 << 16  # samples between two batches; a run may go much faster than real time


class Inbox:
    """What has come over Zenoh and is not recorded yet; from its making on nothing is missed."""

    def __init__(self, bus: Bus) -> None:
        self.team = bus.queue("team", QUEUE)
        self.targets = bus.queue("vehicle/*/target", QUEUE)
        self.events = bus.queue("events", QUEUE)


class Recorder:
    """Moves what has arrived since the last batch into the scene."""

    def __init__(
        self, folder: Path, robots: list[RecordedRobot], inbox: Inbox, scene: Scene
    ) -> None:
        self._scene = scene
        self._tails = [TruthTail(folder / "vehicles" / r.name / "truth.bin") for r in robots]
        self._inbox = inbox
        self._bad: set[str] = set()

    def batch(self) -> bool:
        """Record what is new; return whether there was any truth."""
        moved = False
        for tail in self._tails:
            track = tail.read()
            if track is not None and len(track):
                self._scene.add_truth(track)
                moved = True
        self._drain(self._inbox.team, lambda data: self._scene.add_states(unpack_team(data)[1]))
        self._drain(self._inbox.targets, lambda data: self._scene.add_target(unpack_target(data)))
        self._drain(self._inbox.events, lambda data: self._scene.add_event(*_unpack_event(data)))
        self._scene.flush()
        return moved

    def finish(self) -> None:
        """Record all that is left and end the recording."""
        while self.batch():
            pass
        for tail in self._tails:
            tail.close()
        self._scene.close()

    def _drain(self, queue: Queue, record: Callable[[bytes], None]) -> None:
        """Record every sample; complain once per key about those that are none."""
        for key, payload in queue.drain():
            try:
                record(payload)
            except WireError as error:
                if key not in self._bad:
                    self._bad.add(key)
                    print(f"mavherd recorder: {key}: {error}", file=sys.stderr)


def _unpack_event(data: bytes) -> tuple[float, str | None, str, str]:
    try:
        event = json.loads(data)
        return float(event["t"]), event["vehicle"], str(event["kind"]), str(event["text"])
    except (ValueError, KeyError, TypeError) as error:
        raise WireError(f"event: {error!r}") from None


def record(folder: Path, endpoint: str, run_id: str) -> None:
    """Record the run in `folder` until standard input ends."""
    robots = read_robots(folder)
    part = folder / "run.rrd.part"
    with Bus.client(endpoint, run_id) as bus:
        inbox = Inbox(bus)
        print("ready", flush=True)  # Rerun takes longer to import than the others to start
        recorder = Recorder(folder, robots, inbox, Scene(part, run_id, robots))
        period = max(PERIOD_S, PERIOD_PER_ROBOT_S * len(robots))
        while not _stdin_ended(period):
            recorder.batch()
        recorder.finish()
    part.rename(folder / "run.rrd")


def _stdin_ended(timeout: float) -> bool:
    """Wait at most `timeout` seconds for the end of standard input."""
    readable, _, _ = select.select([sys.stdin], [], [], timeout)
    return bool(readable) and not os.read(sys.stdin.fileno(), 4096)


def main(argv: list[str]) -> int:
    """Run the recorder process; return its exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches us too: the launcher decides
    os.nice(19)  # nobody waits for the recording, so it takes what the run leaves
    if len(argv) != 3:
        print(
            "usage: python -m mavherd.gcs.recording.recorder RUN_FOLDER ENDPOINT RUN_ID",
            file=sys.stderr,
        )
        return 2
    try:
        record(Path(argv[0]), argv[1], argv[2])
    except MavherdError as error:
        print(f"mavherd recorder: {error}", file=sys.stderr)
        return error.exit_code
    except ModuleNotFoundError as error:
        if error.name != "rerun":
            raise
        hint = "pip install 'mavherd[view]'"
        print(f"mavherd recorder: rerun is not installed, so no run.rrd: {hint}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
