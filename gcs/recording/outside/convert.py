"""Recordings of telemetry logs."""

import heapq
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from ...patience import Bar
from ..stream import Stream
from .instruments import LOOK_S
from .logs import Entry, Log, LogError
from .watch import Outside

_FLUSH_S = 5.0  # of the log, between batches
_LEAP_S = 86_400.0  # over a longer pause the clock was set, or another flight begins
_PAUSE_S = 1.0  # that is shown instead


class Converted(NamedTuple):
    """What came of it."""

    vehicles: list[str]
    seconds: float
    remarks: list[str]  # on what is not as it should be


class LogClock:
    """Seconds since the first message; `leaps` counts where stamps went back, or on for a day."""

    def __init__(self) -> None:
        self.leaps = 0
        self._now = 0.0
        self._last_us: int | None = None

    def read(self, time_us: int) -> float:
        """Return the moment of a message, never before that of the one before."""
        if self._last_us is not None:
            step = (time_us - self._last_us) * 1e-6
            if step < -_PAUSE_S or step > _LEAP_S:
                self.leaps += 1
                step = _PAUSE_S
            elif step < 0:  # one of several links: a little late
                return self._now
            self._now += step
        self._last_us = time_us
        return self._now


def convert_logs(paths: Sequence[Path], output: Path, bar: Bar) -> Converted:
    """Write one recording of telemetry logs, whose vehicles are shown together.

    Raises LogError when one of them is none, or no vehicle is in any. What was written of `output`
    by then is for the caller to remove.
    """
    logs = [Log(path) for path in paths]
    clock = LogClock()
    stream = None
    outside: Outside | None = None
    now = flush_at = look_at = 0.0
    for path, entry in _merged(logs):
        now = clock.read(entry.time_us)
        if outside is None:
            run_id = f"{paths[0].stem}-{entry.time_us}"
            stream = Stream(run_id, file=output, start=entry.time_us * 1e-6)
            outside = Outside(stream, ", ".join(p.name for p in paths), live=False)
        if now >= look_at:
            outside.look(now)
            look_at = now + LOOK_S
        outside.hear(entry.message, path.name, now)
        if now >= flush_at:
            outside.flush(now)
            flush_at = now + _FLUSH_S
            bar.reach(sum(log.share * log.size for log in logs) / sum(log.size for log in logs))
    if outside is not None:
        outside.close(now)
    if outside is None or not outside.vehicles:
        names = ", ".join(map(str, paths))
        raise LogError(f"{names}: no vehicle in it, no heartbeat of an autopilot")
    return Converted([v.name for v in outside.vehicles.values()], now, _remarks(logs, clock))


def _merged(logs: Sequence[Log]) -> Iterator[tuple[Path, Entry]]:
    """Yield the messages of several logs in the order of their stamps."""
    if len(logs) == 1:
        return ((logs[0].path, entry) for entry in logs[0].entries())
    flows = [((e.time_us, n, e) for e in log.entries()) for n, log in enumerate(logs)]
    ordered = heapq.merge(*flows, key=lambda item: item[:2])
    return ((logs[n].path, entry) for _, n, entry in ordered)


def _remarks(logs: Sequence[Log], clock: LogClock) -> list[str]:
    remarks = []
    for log in logs:
        if log.torn:
            remarks.append(f"{log.path}: its last message is cut short; the rest is converted")
        if log.skipped:
            remarks.append(f"{log.path}: {log.skipped} bytes that are no messages are left out")
    if clock.leaps:
        times = "once" if clock.leaps == 1 else f"{clock.leaps} times"
        remarks.append(f"the clock of its stamps leapt {times}; {_PAUSE_S:g} s is shown instead")
    return remarks
