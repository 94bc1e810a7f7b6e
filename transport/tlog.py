"""Telemetry logs as ground stations write them: 8 bytes of big-endian microseconds, one frame."""

import hashlib
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path

from .errors import MavherdError

STAMP = struct.Struct(">Q")
"""What precedes each frame: microseconds, UTC."""


_FLUSH_US = 500_000  # of log time between two flushes: so much is lost when we are killed


class TlogWriter:
    """Writes `NAME.tlog.part` and renames it to `NAME.tlog` when it is complete."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._part = path.with_name(path.name + ".part")
        self._file = self._part.open("wb", buffering=1 << 14)
        self._flush_at = 0

    def write(self, time_us: int, frame: bytes) -> None:
        """Append one frame, sent or received at `time_us` (UTC)."""
        self._file.write(STAMP.pack(time_us) + frame)
        if time_us >= self._flush_at:
            self._flush_at = time_us + _FLUSH_US
            self._file.flush()

    def close(self) -> None:
        """Finish the file under its final name."""
        self._file.close()
        self._part.rename(self._path)

    def discard(self) -> None:
        """Leave no file."""
        self._file.close()
        self._part.unlink(missing_ok=True)


def read_tlog(path: Path) -> Iterator[tuple[int, bytes]]:
    """Yield time (microseconds, UTC) and frame of each entry; a torn last entry ends it."""
    data = path.read_bytes()
    for at, end in entries(data, path):
        (time_us,) = STAMP.unpack_from(data, at)
        yield time_us, data[at + STAMP.size : end]


def entries(data: bytes, path: Path) -> Iterator[tuple[int, int]]:
    """Yield where each whole entry in `data`, which is from `path`, begins and ends."""
    at = 0
    while at + STAMP.size + 3 <= len(data):
        start = at + STAMP.size
        marker, length, flags = data[start : start + 3]
        if marker not in (0xFD, 0xFE):
            doubt = "the log is damaged here or just before" if at else "not a tlog?"
            raise MavherdError(f"{path}: no MAVLink frame at byte {start} ({doubt})")
        overhead = 8 if marker == 0xFE else 25 if flags & 1 else 12
        end = start + length + overhead
        if end <= len(data):
            yield at, end
        at = end


def torn_at(path: Path) -> int | None:
    """Return the byte where the entry begins of which the end is missing; None: it is whole.

    An empty log is torn at byte 0: no link is without a message.
    """
    data = path.read_bytes()
    end = max((end for _, end in entries(data, path)), default=0)
    return None if data and end == len(data) else end


def tear(at: int) -> str:
    """Return what is to be said of a log that is torn at this byte."""
    return f"torn at byte {at}, where the last message is cut short" if at else "empty"


def digest(paths: Iterable[Path]) -> str:
    """Return the SHA-256 over the frames of `paths`, in the order given, without time stamps."""
    sha = hashlib.sha256()
    for path in paths:
        for _, frame in read_tlog(path):
            sha.update(frame)
    return sha.hexdigest()
