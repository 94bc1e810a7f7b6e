"""How near the robots of a run came to one another over time, from when all were ready."""

from typing import NamedTuple

import numpy as np

from ..report.contact import align, smallest_by_class
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
    smallest = smallest_by_class(kinds, position)
    seen = {label: row for label, row in smallest.items() if np.isfinite(row).any()}
    metres = {label: np.where(np.isfinite(r), r, np.nan) for label, r in seen.items()}
    return Nearness(time - run.ready_at, metres)
