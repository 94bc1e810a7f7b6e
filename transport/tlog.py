"""Telemetry logs as ground stations write them: 8 bytes of big-endian microseconds, one frame."""

import hashlib
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path

from .errors import MavherdError

_STAMP = struct.Struct(">Q")


class TlogWriter:
    """Writes `NAME.tlog.part` and renames it to `NAME.tlog` when it is complete."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._part = path.with_name(path.name + ".part")
        self._file = self._part.open("wb", buffering=1 << 14)

    def write(self, time_us: int, frame: bytes) -> None:
        """Append one frame, sent or received at `time_us` (UTC)."""
        self._file.write(_STAMP.pack(time_us) + frame)

    def close(self) -> None:
        """Finish the file under its final name."""
        self._file.close()
        self._part.rename(self._path)


def read_tlog(path: Path) -> Iterator[tuple[int, bytes]]:
    """Yield time (microseconds, UTC) and frame of each entry; a torn last entry ends it."""
    data = path.read_bytes()
    for at, end in _entries(data, path):
        (time_us,) = _STAMP.unpack_from(data, at)
        yield time_us, data[at + _STAMP.size : end]


def torn_at(path: Path) -> int | None:
    """Return the byte where the entry begins of which the end is missing; None: it is whole.

    An empty log is torn at byte 0: no link is without a message.
    """
    data = path.read_bytes()
    end = max((end for _, end in _entries(data, path)), default=0)
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


def _entries(data: bytes, path: Path) -> Iterator[tuple[int, int]]:
    """Yield where each whole entry begins and ends."""
    at = 0
    while at + _STAMP.size + 3 <= len(data):
        start = at + _STAMP.size
        marker, length, flags = data[start : start + 3]
        if marker not in (0xFD, 0xFE):
            doubt = "the log is damaged here or just before" if at else "not a tlog?"
            raise MavherdError(f"{path}: no MAVLink frame at byte {start} ({doubt})")
        overhead = 8 if marker == 0xFE else 25 if flags & 1 else 12
        end = start + length + overhead
        if end <= len(data):
            yield at, end
        at = end
