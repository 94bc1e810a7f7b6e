"""What an .rrd holds, as far as its file goes."""

import warnings
from pathlib import Path
from typing import Any

from .stream import TIMELINE


def ids_of(file: Path) -> set[str]:
    """Return the ids of the recordings in a file; raise RuntimeError when it is none."""
    return {entry.recording_id for entry in _reader(file).recordings()}


def has_begun(file: Path) -> bool:
    """Return whether anything that happened was recorded."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of one that has no end
        return any(TIMELINE in chunk.timeline_names for chunk in _reader(file).stream())


def _reader(file: Path) -> Any:
    from rerun.chunk import RrdReader

    return RrdReader(file)
