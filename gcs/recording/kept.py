"""The file of a recording that goes on: what was handed over to it is there, whatever comes."""

import os
import shutil
from contextlib import suppress
from pathlib import Path

from ...transport.errors import MavherdError
from .compact import compact
from .stream import Stream

_FLUSH_S = 5.0  # for what was recorded to reach the file
_FULL_BYTES = 1 << 20  # less room than that is none


class RecordingError(MavherdError):
    """A recording that cannot go on."""

    exit_code = 3


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
            self._stream.flush(_FLUSH_S)
        except RuntimeError as error:
            if "shut down" not in str(error):
                return  # it takes its time
            with suppress(RuntimeError):
                self._stream.end_file()
            os.truncate(self._part, self._safe)
            is_full = shutil.disk_usage(self._part.parent).free < _FULL_BYTES
            lost = f"{self._part.name} cannot be written any more"
            raise RecordingError("the disk is full" if is_full else lost) from None
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
