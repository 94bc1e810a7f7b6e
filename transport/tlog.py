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
    at = 0
    while at + _STAMP.size + 3 <= len(data):
        (time_us,) = _STAMP.unpack_from(data, at)
        start = at + _STAMP.size
        marker, length, flags = data[start : start + 3]
        if marker not in (0xFD, 0xFE):
            raise MavherdError(f"{path}: no MAVLink frame at byte {start} (not a tlog?)")
        overhead = 8 if marker == 0xFE else 25 if flags & 1 else 12
        at = start + length + overhead
        if at <= len(data):
            yield time_us, data[start:at]


def digest(paths: Iterable[Path]) -> str:
    """Return the SHA-256 over the frames of `paths`, in the order given, without time stamps."""
    sha = hashlib.sha256()
    for path in paths:
        for _, frame in read_tlog(path):
            sha.update(frame)
    return sha.hexdigest()
