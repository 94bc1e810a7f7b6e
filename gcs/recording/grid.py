"""Brings the robots' truth, which comes robot by robot, onto one time axis."""

from math import ceil, floor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..report.truth import Floats, Track

RATE_HZ = 20
PATIENCE_S = 2.0  # of the run: who is further behind is left out
_GAP_S = 1.0  # between two samples, beyond which nothing is known
_FIELDS = ("position", "velocity", "quaternion")
_COLUMNS = 10  # of all these
_SLACK = 1e-3  # of a step: times are sums of steps
_NEVER = -(1 << 40)  # no step yet


class Aligned(NamedTuple):
    """What all robots did at the same times; NaN where a robot's truth is not known."""

    time: Floats  # (t,)
    position: Floats  # (robots, t, 3)
    velocity: Floats  # (robots, t, 3)
    quaternion: Floats  # (robots, t, 4) w x y z


class Grid:
    """Collects tracks and gives out the times for which all, or patience, allow it."""

    def __init__(self) -> None:
        self._row: dict[str, int] = {}
        self._table = np.full((0, 64, _COLUMNS), np.nan)  # from step `_base` on
        self._base: int | None = None  # of the first column; None: nothing has come
        self._newest: NDArray[np.int_] = np.empty(0, dtype=int)  # step, by robot
        self._last: list[Track | None] = []  # by robot, what came last
        self._pending: list[Track] = []

    @property
    def names(self) -> tuple[str, ...]:
        """Return the robots in the order of their rows."""
        return tuple(self._row)

    def add_robot(self, name: str) -> None:
        """Make room for one more robot; before it came nothing is known of it."""
        self._row[name] = len(self._row)
        empty = np.full((1, *self._table.shape[1:]), np.nan)
        self._table = np.concatenate([self._table, empty])
        self._newest = np.append(self._newest, _NEVER)
        self._last.append(None)

    def add(self, track: Track) -> None:
        """Keep what `track` says of the steps that it passes."""
        if len(track):
            self._pending.append(track)

    def take(self, *, everything: bool = False) -> Aligned:
        """Return the times that are new since the last call."""
        self._settle()
        if self._base is None:
            return _cut(self._table[:, :0], 0)
        newest, slowest = int(self._newest.max()), int(self._newest.min())
        late = newest - round(PATIENCE_S * RATE_HZ)
        until = newest if everything else max(slowest, late)
        count = max(0, until + 1 - self._base)
        found = _cut(self._table[:, :count], self._base)
        rest = np.full_like(self._table, np.nan)
        rest[:, : self._table.shape[1] - count] = self._table[:, count:]
        self._table = rest
        self._base += count
        return found

    def _settle(self) -> None:
        """Move what is pending into the table, all robots at once where rows fall on steps."""
        tracks, self._pending = self._pending, []
        if not tracks:
            return
        rows = np.array([self._row[track.name] for track in tracks])
        exact = np.concatenate([track.time for track in tracks]) * RATE_HZ
        step = np.rint(exact).astype(int)
        on = np.abs(exact - step) < _SLACK
        row = np.repeat(rows, [len(track) for track in tracks])[on]
        begin = np.array([ceil(track.time[0] * RATE_HZ - _SLACK) for track in tracks])
        end = np.array([floor(track.time[-1] * RATE_HZ + _SLACK) for track in tracks])
        if self._base is None:
            self._base = int(begin.min())
        known = self._newest[rows]
        wanted = np.zeros(len(self._last), dtype=int)
        np.add.at(wanted, rows, end - np.where(known == _NEVER, begin - 1, known))
        is_regular = np.bincount(row, minlength=len(wanted)) == wanted
        kept = is_regular[row] & (step[on] >= self._base)
        values = [np.concatenate([getattr(track, name) for track in tracks]) for name in _FIELDS]
        found = np.concatenate(values, axis=1)[on][kept]
        self._write(row[kept], step[on][kept], found)
        for track, k, first, last in zip(tracks, rows.tolist(), begin, end, strict=True):
            if not is_regular[k]:
                self._add_between(k, track, int(first), int(last))
            self._last[k] = track
            self._newest[k] = max(self._newest[k], last)

    def _add_between(self, row: int, track: Track, first: int, last: int) -> None:
        """Move one track whose samples lie between the steps."""
        time, values = track.time, np.concatenate([getattr(track, f) for f in _FIELDS], axis=1)
        if (past := self._last[row]) is not None:
            before = [getattr(past, name)[-1:] for name in _FIELDS]
            time = np.concatenate([past.time[-1:], time])
            values = np.concatenate([np.concatenate(before, axis=1), values])
            first = int(self._newest[row]) + 1
        steps = np.arange(max(first, self._base or 0), last + 1)
        if len(steps):
            self._write(row, steps, _sample(time, values, steps / RATE_HZ))

    def _write(self, row: int | NDArray[np.int_], steps: NDArray[np.int_], values: Floats) -> None:
        if not len(steps) or self._base is None:
            return
        columns = steps - self._base
        short = int(columns.max()) + 1 - self._table.shape[1]
        if short > 0:
            more = max(short, self._table.shape[1])
            room = np.full((len(self._table), more, _COLUMNS), np.nan)
            self._table = np.concatenate([self._table, room], axis=1)
        self._table[row, columns] = values


def _sample(time: Floats, values: Floats, wanted: Floats) -> Floats:
    """Return values at the `wanted` times: between samples, the attitude of the nearer one."""
    after = np.clip(np.searchsorted(time, wanted - _SLACK / RATE_HZ), 1, max(1, len(time) - 1))
    if len(time) == 1:
        return np.repeat(values, len(wanted), axis=0)
    before = after - 1
    span = time[after] - time[before]
    share = np.clip((wanted - time[before]) / np.where(span > 0, span, 1.0), 0.0, 1.0)
    found: Floats = values[before] + (values[after] - values[before]) * share[:, None]
    nearer = np.where(share < 0.5, before, after)
    found[:, 6:] = values[nearer, 6:]
    found[(span > _GAP_S) & (np.minimum(share, 1 - share) > _SLACK)] = np.nan
    return found


def _cut(table: Floats, first: int) -> Aligned:
    table = table.copy()
    time = (first + np.arange(table.shape[1])) / RATE_HZ
    return Aligned(time, table[..., 0:3], table[..., 3:6], table[..., 6:10])
