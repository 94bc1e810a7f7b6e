"""The file of a recording that goes on: what was handed over to it is there, whatever comes."""

import os
from contextlib import suppress
from pathlib import Path

from .compact import compact
from .stream import RecordingError, Stream

_FLUSH_S = 5.0  # for what was recorded to reach the file


class KeptFile:
    """The file `whole` that `stream` writes, under its name with `.part` until it is complete."""

    def __init__(self, stream: Stream, whole: Path) -> None:
        self._stream = stream
        self._whole = whole
        self._part = part_of(whole)
        self._safe = 0  # bytes that can be read

    def hand_over(self) -> None:
        """Have all that was recorded reach the file; raise RecordingError when it cannot.

        The file then holds what was handed over before, and nothing is written to it any more.
        """
        try:
            self._stream.flush_file(_FLUSH_S)
        except RecordingError:
            with suppress(RecordingError):
                self._stream.end_file(_FLUSH_S)
            os.truncate(self._part, self._safe)
            raise
        self._safe = self._part.stat().st_size

    def finish(self, *, in_hurry: bool) -> None:
        """Complete the file and, if there is time, make it small."""
        self.hand_over()
        self._stream.end_file()
        self._part.rename(self._whole)
        if not in_hurry:
            compact(self._whole)


def part_of(whole: Path) -> Path:
    """Return the name of a file that is not complete."""
    return whole.with_name(f"{whole.name}.part")
