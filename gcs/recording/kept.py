"""The file of a recording that goes on: what was handed over to it is there, whatever comes."""

import os
from pathlib import Path

from .compact import compact
from .stream import RecordingError, Stream

_FLUSH_S = 3.0  # for what was recorded to reach the file
_LAST_FLUSH_S = 15.0
_TRIES = 3  # times in a row that it did not, and the file is given up


class KeptFile:
    """The file `whole` that `stream` writes, under its name with `.part` until it is complete."""

    def __init__(self, stream: Stream, whole: Path) -> None:
        self._stream = stream
        self._whole = whole
        self._part = part_of(whole)
        self._safe = 0  # bytes that can be read
        self._late = 0  # times in a row

    def hand_over(self, patience_s: float = _FLUSH_S, tries: int = _TRIES) -> None:
        """Have all that was recorded reach the file; raise RecordingError when it cannot.

        The file then holds what was handed over before, and nothing is written to it any more.
        """
        try:
            in_time = self._stream.flush_file(patience_s)
            self._late = 0 if in_time else self._late + 1
            if self._late >= tries:
                raise self._stream.lost()
        except RecordingError:
            os.truncate(self._part, self._safe)
            raise
        if in_time:
            self._safe = self._part.stat().st_size

    def finish(self, *, in_hurry: bool) -> None:
        """Complete the file and, if there is time, make it small; see `hand_over`."""
        self.hand_over(_LAST_FLUSH_S, tries=1)
        self._stream.end_file()
        self._part.rename(self._whole)
        if not in_hurry:
            compact(self._whole)


def part_of(whole: Path) -> Path:
    """Return the name of a file that is not complete."""
    return whole.with_name(f"{whole.name}.part")
