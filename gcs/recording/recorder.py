"""The recorder: a process of its own that watches a run, writes `run.rrd` and serves viewers.

`python -m mavherd.gcs.recording.recorder RUN_FOLDER ZENOH_ENDPOINT RUN_ID`, `--serve PORT` for
viewers on loopback, `--no-file` for nobody else. It follows the vehicles' truth logs and the event
log, and looks at snapshots on Zenoh, so nobody ever waits for it. `RUN_FOLDER/scenario.yaml` says
who takes part.

What it says, a line each: `ready` when it listens, `serving` when viewers may come, `lost viewers:
REASON` when none may any more, `lost REASON` when no more can be recorded, `done` when all is
recorded that can be. It finishes when it is told so, with the word `finish` or, in a hurry, any
other, or when its standard input ends; until that ends viewers are served.
"""

import argparse
import os
import select
import signal
import sys
import time
from collections import deque
from contextlib import suppress
from pathlib import Path

from ...scenarios.loader import load_scenario
from ...transport.bus import Bus
from ...transport.errors import MavherdError
from ..complaint import INSTALL
from ..report.truth import TruthTail, read_all
from .inbox import Inbox
from .kept import KeptFile, part_of
from .scene import Scene
from .stage import stage_of
from .stream import RecordingError, Stream

PERIOD_S = 0.7  # of wall time, between batches; who is killed loses less than a second
FINISH = b"finish\n"
SERVED_S, SERVED_CROWD_S = 0.2, 0.5  # between batches that somebody watches
FINE, COARSE = 2, 5  # rows of the 100 Hz truth that become one in the recording
_FACTOR_S = 2.0  # of wall time, over which the real-time factor is measured


class Speed:
    """How many times as fast as real time fleet time has gone of late."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, float]] = deque()  # wall and fleet time

    def at(self, wall: float, now: float) -> float | None:
        """Return the factor, None as long as time stands still or was seen once only."""
        seen = self._seen
        if seen and now <= seen[-1][1]:
            return None
        seen.append((wall, now))
        while len(seen) > 2 and wall - seen[1][0] >= _FACTOR_S:
            seen.popleft()
        began, first = seen[0]
        return (now - first) / (wall - began) if wall > began else None


class Recorder:
    """Moves what has arrived since the last batch into the scene."""

    def __init__(self, folder: Path, robots: list[str], inbox: Inbox, scene: Scene) -> None:
        every = COARSE if scene.stage.crowded else FINE
        self._tails = [TruthTail(folder / "vehicles" / n / "truth.bin", every) for n in robots]
        self._inbox = inbox
        self._scene = scene
        self._speed = Speed()

    def batch(self, *, everything: bool = False) -> bool:
        """Record what is new; return whether there was any truth.

        `everything`: also what waits for what belongs to it.
        """
        tracks = read_all(self._tails)
        for track in tracks:
            self._scene.add_truth(track)
        self._inbox.deliver(self._scene, everything=everything)
        if (factor := self._speed.at(time.monotonic(), self._inbox.now)) is not None:
            self._scene.add_clock(self._inbox.now, factor)
        self._scene.flush(everything=everything)
        return bool(tracks)

    def finish(self) -> None:
        """Record all that is left."""
        while self.batch():
            pass
        self.batch(everything=True)
        self._inbox.close()
        for tail in self._tails:
            tail.close()


def record(args: argparse.Namespace) -> None:
    """Record the run until standard input says otherwise; serve viewers until its end."""
    folder: Path = args.folder
    scenario = load_scenario(folder / "scenario.yaml")
    whole = folder / "run.rrd"
    with Bus.client(args.endpoint, args.run_id) as bus:
        robots = [spec.name for spec in scenario.robots]
        inbox = Inbox(folder, bus, robots)
        _say("ready")  # Rerun takes longer to import than the others to start
        try:
            file = None if args.no_file else part_of(whole)
            stream = Stream(args.run_id, file=file, serve=args.serve)
        except MavherdError as error:
            raise RecordingError(f"it cannot be begun: {error}") from None
        kept = None if args.no_file else KeptFile(stream, whole)
        show = Show(stream) if args.serve is not None else None
        scene = Scene(stream, stage_of(scenario))
        recorder = Recorder(folder, robots, inbox, scene)
        period = SERVED_CROWD_S if scene.stage.crowded else SERVED_S
        told = False
        while not told and (kept or show):  # the first batch comes at once: it may be the last
            recorder.batch()
            if show and not show.goes_on():
                show = None
            if kept and not _handed_over(kept, needed=show is None):
                kept = None
            told = _told(period if show else PERIOD_S)
        recorder.finish()
    word = _next_word()
    if kept:
        kept.finish(in_hurry=word != FINISH)
    _say("done")
    while show and word:
        word = _next_word()
    stream.close()


class Show:
    """What is served to viewers, as long as it is."""

    def __init__(self, stream: Stream) -> None:
        self._stream = stream
        self._is_on = False

    def goes_on(self) -> bool:
        """Hand over what was recorded, say how it goes; return whether anybody may still come."""
        try:
            if self._is_on:
                self._stream.flush_served()
            elif self._stream.answers():
                self._is_on = True
                _say("serving")
        except RecordingError as error:
            _say(f"lost viewers: {error}")
            self._stream.end_served()
            return False
        return True


def _handed_over(kept: KeptFile, *, needed: bool) -> bool:
    """Return whether all that was recorded is in the file; only who has viewers goes on if not."""
    try:
        kept.hand_over()
    except RecordingError as error:
        if needed:
            raise
        _say(f"lost {error}")
        return False
    return True


def _told(timeout: float) -> bool:
    """Wait at most `timeout` seconds to be told to finish."""
    readable, _, _ = select.select([sys.stdin], [], [], timeout)
    return bool(readable)


def _next_word() -> bytes:
    """Wait for what is said on standard input; nothing is its end."""
    return os.read(sys.stdin.fileno(), 4096)


def _say(line: str) -> None:
    with suppress(BrokenPipeError):  # the launcher is dead
        os.write(sys.stdout.fileno(), f"{line}\n".encode())


def main(argv: list[str]) -> int:
    """Run the recorder process; return its exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches us too: the launcher decides
    os.nice(19)  # nobody waits for the recording, so it takes what the run leaves
    parser = argparse.ArgumentParser(prog="python -m mavherd.gcs.recording.recorder")
    parser.add_argument("folder", type=Path)
    parser.add_argument("endpoint")
    parser.add_argument("run_id")
    parser.add_argument("--serve", type=int, metavar="PORT")
    parser.add_argument("--no-file", action="store_true")
    try:
        record(parser.parse_args(argv))
    except (MavherdError, OSError) as error:
        _say(f"lost {error}")
        print(f"mavherd recorder: {error}", file=sys.stderr)
        return error.exit_code if isinstance(error, MavherdError) else 3
    except ModuleNotFoundError as error:
        if error.name != "rerun":
            raise
        lack = f"rerun is not installed, so no run.rrd: {INSTALL}"
        print(f"mavherd recorder: {lack}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
