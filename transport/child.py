"""What a process does that the launcher has started, before anything else."""

import gc
import os
from pathlib import Path

GC_THRESHOLD = 50_000  # objects; the loops make no cycles, so looking for them seldom is enough


def settle() -> None:
    """Take all that was imported for granted: nobody searches it for garbage any more."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(GC_THRESHOLD)


def log_to(path: str) -> None:
    """Have whatever this process prints appended to a file."""
    with Path(path).open("ab", buffering=0) as log:
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
