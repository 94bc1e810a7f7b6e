"""How near the robots of a run came to one another over time, from when all were ready."""

from typing import NamedTuple

import numpy as np

from ..report.contact import CLASSES, align, pair_class, separations
from ..report.truth import Floats
from .lineup import ComparedRun

RATE_HZ = 10


class Nearness(NamedTuple):
    """The smallest separation of each class of pairs; of those classes that have any."""

    time: Floats  # (t,) s since all were ready
    smallest: dict[str, Floats]  # (t,) m; NaN where no two are at one level


def nearness(run: ComparedRun) -> Nearness:
    """Return how near the robots came until the run's work was done."""
    tracks = run.tracks
    time, position = align(tracks, run.ready_at, run.done_at, RATE_HZ)
    kinds = [track.kind for track in tracks]
    smallest = {label: np.full(len(time), np.inf) for label in CLASSES}
    for i in range(len(tracks) - 1):
        _, squared = separations(kinds, position, i, slice(i + 1, len(tracks)))
        for row, kind in zip(squared, kinds[i + 1 :], strict=True):
            best = smallest[pair_class(kinds[i], kind)]
            np.minimum(best, row, out=best)
    seen = {label: row for label, row in smallest.items() if np.isfinite(row).any()}
    metres = {label: np.sqrt(np.where(np.isfinite(r), r, np.nan)) for label, r in seen.items()}
    return Nearness(time - run.ready_at, metres)
