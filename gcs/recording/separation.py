"""Separation while a run goes on: the smallest of each class, as truth arrives."""

from collections.abc import Mapping

import numpy as np

from ..report.contact import CLASSES, pair_class, separations
from ..report.truth import Floats, Track

RATE_HZ = 20
PATIENCE_S = 2.0  # of the run: who is further behind is left out


class LiveSeparation:
    """Collects truth by robot and gives out what all of it, or patience, allows to compute."""

    def __init__(self, kinds: Mapping[str, str]) -> None:
        self._kinds = dict(kinds)
        self._row = {name: i for i, name in enumerate(self._kinds)}
        self._samples: list[dict[int, Floats]] = [{} for _ in self._kinds]
        self._newest = dict.fromkeys(self._kinds, -1)
        self._done = -1

    def add(self, track: Track) -> None:
        """Keep the samples of `track` that fall on the time grid."""
        step = np.rint(track.time * RATE_HZ).astype(int)
        on_grid = np.flatnonzero(np.abs(track.time * RATE_HZ - step) < 0.11)  # of 100 Hz rows
        mine = self._samples[self._row[track.name]]
        for k in on_grid.tolist():
            mine.setdefault(int(step[k]), track.position[k])
        if len(on_grid):
            self._newest[track.name] = int(step[on_grid[-1]])

    def take(self, *, everything: bool = False) -> tuple[Floats, dict[str, Floats]]:
        """Return new times and, by class, the smallest separation then (NaN: nothing to say)."""
        newest = max(self._newest.values(), default=-1)
        late = newest - round(PATIENCE_S * RATE_HZ)
        until = newest if everything else max(min(self._newest.values(), default=-1), late)
        steps = range(self._done + 1, until + 1)
        if self._done < 0:
            first = min((min(s) for s in self._samples if s), default=0)
            steps = range(max(first, 0), until + 1)
        if not len(steps):
            return np.empty(0), {}
        position = np.full((len(self._samples), 3, len(steps)), np.nan)
        for row, mine in zip(position, self._samples, strict=True):
            for column, step in enumerate(steps):
                if (sample := mine.pop(step, None)) is not None:
                    row[:, column] = sample
        self._done = until
        return np.arange(steps.start, steps.stop) / RATE_HZ, self._smallest(position)

    def _smallest(self, position: Floats) -> dict[str, Floats]:
        kinds = list(self._kinds.values())
        best: dict[str, Floats] = {}
        for i in range(len(kinds) - 1):
            _, squared = separations(kinds, position, i, slice(i + 1, len(kinds)))
            for row, kind in zip(squared, kinds[i + 1 :], strict=True):
                label = pair_class(kinds[i], kind)
                best[label] = np.minimum(best.get(label, np.inf), row)
        found = {label: np.sqrt(best[label]) for label in CLASSES if label in best}
        return {label: np.where(np.isfinite(s), s, np.nan) for label, s in found.items()}
