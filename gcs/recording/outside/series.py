"""Told values between the moments they were told at: resampled to half a truth log's rate."""

import numpy as np

from ....vehicles.truth import RATE_HZ as TRUTH_HZ
from ...report.truth import Floats

RATE_HZ = TRUTH_HZ // 2
LONGEST_S = 3.0  # between two values that are joined; over a longer silence nothing is drawn
_SLACK = 1e-6  # of a period


class Series:
    """Values of one message, by time; `newest` is the time of the last, -inf before the first."""

    def __init__(self, width: int) -> None:
        self._time: list[float] = []
        self._rows: list[tuple[float, ...]] = []
        self._width = width
        self.newest = -np.inf

    def __len__(self) -> int:
        return len(self._time)

    @property
    def last(self) -> tuple[float, ...] | None:
        """Return the last row, if there is one."""
        return self._rows[-1] if self._rows else None

    def add(self, time: float, row: tuple[float, ...]) -> None:
        """Keep a row; one that is not newer than the last has been overtaken, and is dropped."""
        if time > self.newest:
            self._time.append(time)
            self._rows.append(row)
            self.newest = time

    def at(self, time: Floats) -> Floats:
        """Return the values at these times, a row each; before and after all: the nearest."""
        if not self._rows:
            return np.zeros((len(time), self._width))
        rows = np.array(self._rows)
        return np.column_stack([np.interp(time, self._time, c) for c in rows.T])

    def covers(self, time: Floats) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
        """Return which of these times lie between two values that were told soon after another."""
        if not self._time:
            return np.zeros(len(time), dtype=bool)
        told = np.array(self._time)
        after = np.clip(np.searchsorted(told, time), 1, max(1, len(told) - 1))
        if len(told) == 1:
            return np.asarray(time == told[0])
        inside = (time >= told[0]) & (time <= told[-1])
        return np.asarray(inside & (told[after] - told[after - 1] <= LONGEST_S))

    def forget(self, before: float) -> None:
        """Forget what is older, but for the last row of it."""
        keep = 0
        while keep + 1 < len(self._time) and self._time[keep + 1] <= before:
            keep += 1
        del self._time[:keep], self._rows[:keep]


def grid(after: float, until: float) -> Floats:
    """Return the times of rows after one moment, up to another."""
    first, last = np.floor(after * RATE_HZ + _SLACK) + 1, np.floor(until * RATE_HZ + _SLACK)
    return np.asarray(np.arange(first, last + 1) / RATE_HZ)


def turns(series: Series, time: Floats) -> Floats:
    """Return attitudes (w x y z) at these times; neighbours must be of one sign."""
    q = series.at(time)
    length = np.linalg.norm(q, axis=1, keepdims=True)
    return np.where(length > 0, q / np.maximum(length, 1e-12), [1.0, 0.0, 0.0, 0.0])
