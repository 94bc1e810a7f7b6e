"""Telemetry logs of whatever ground station: MAVProxy, QGroundControl, Mission Planner, ours.

They hold 8 bytes of big-endian microseconds before each frame, both directions, several systems,
MAVLink 1 and 2; some begin with rubbish, have holes, or end in the middle of a frame.
"""

import mmap
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from ....transport.errors import MavherdError
from ....transport.mavlink import V1_MARKER, V2_MARKER, Codec, Message

_STAMP = struct.Struct(">Q")
_HEAD = _STAMP.size
_LONGEST = 300  # bytes of an entry
_LEAST = _HEAD + 8  # of an entry
_FRUITLESS = 1 << 20  # bytes without one message: not a tlog
_LATEST_US = 1 << 52  # in the year 2112
_OTHERS = {  # how files begin that are something else
    b"\xa3\x95": "an ArduPilot dataflash log, which holds no MAVLink (record a tlog in the ground "
    "station, or look at it with mavlogdump.py or UAV Log Viewer)",
    b"ULog": "a PX4 ULog, which holds no MAVLink (record a tlog in the ground station, or look at "
    "it with PlotJuggler or Flight Review)",
    b"RRF": "a Rerun recording already (mavherd view shows it)",
    b"\x89MCAP": "an MCAP file (rerun mcap convert reads it)",
}


class LogError(MavherdError):
    """A file that is no telemetry log. The text says what it may be, and the cure."""


class Entry(NamedTuple):
    """One message of a log."""

    time_us: int  # as stamped, UTC
    message: Message


class Log:
    """One log. While `entries` goes on, `share` of it is read; `skipped` bytes were no messages.

    `torn` says afterwards that the last frame is cut short.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.share = 0.0
        self.skipped = 0
        self.torn = False
        try:
            self.size = path.stat().st_size
            with path.open("rb") as file:
                head = file.read(_LONGEST)
        except OSError as error:
            raise LogError(f"{path}: {(error.strerror or str(error)).lower()}") from None
        if not self.size:
            raise LogError(f"{path}: empty")
        for magic, what in _OTHERS.items():
            if head.startswith(magic):
                raise LogError(f"{path}: this is {what}")
        if head[0] in (V1_MARKER, V2_MARKER) and _begins_with_message(head):
            raise LogError(
                f"{path}: this is MAVLink without time stamps, as MAVProxy's .tlog.raw (take the"
                " .tlog that was written beside it)"
            )

    def entries(self) -> Iterator[Entry]:
        """Yield what is good in the log; raise LogError when nothing is."""
        codec = Codec(0)
        found = 0
        with self.path.open("rb") as file, _mapped(file.fileno()) as data:
            at = 0
            while at + _LEAST <= self.size:
                end = _end(data, at)
                if end > self.size and found and self.size - at < _LONGEST:
                    self.torn = True
                    break
                frame = data[at + _HEAD : end] if end else b""
                messages = codec.decode(frame, stream=False) if frame and end <= self.size else []
                if len(messages) == 1 and not codec.bad_bytes:
                    found += 1
                    yield Entry(_STAMP.unpack_from(data, at)[0], messages[0])
                    at = end
                elif end and _end(data, end):  # of a dialect that is not ours
                    codec.bad_bytes = 0
                    at = end
                else:
                    codec.bad_bytes = 0
                    was, at = at, _next(data, at + 1)
                    self.skipped += at - was
                self.share = at / self.size
                if not found and at > _FRUITLESS:
                    break
            else:
                self.torn = self.torn or at < self.size
        self.share = 1.0
        if not found:
            what = "this is no tlog: no MAVLink message with a time stamp is in it"
            raise LogError(f"{self.path}: {what}")


def _begins_with_message(data: bytes) -> bool:
    codec = Codec(0)
    return bool(codec.decode(data)) and not codec.bad_bytes


def _mapped(descriptor: int) -> mmap.mmap:
    return mmap.mmap(descriptor, 0, access=mmap.ACCESS_READ)


def _end(data: mmap.mmap, at: int) -> int:
    """Return where the entry at `at` would end, 0 if none can begin there."""
    start = at + _HEAD
    if start + 3 > len(data):
        return 0
    marker, length, flags = data[start], data[start + 1], data[start + 2]
    if marker not in (V1_MARKER, V2_MARKER) or _STAMP.unpack_from(data, at)[0] > _LATEST_US:
        return 0
    if marker == V1_MARKER:
        return start + length + 8
    return 0 if flags & ~1 else start + length + (25 if flags else 12)


def _next(data: mmap.mmap, at: int) -> int:
    """Return where the next entry may begin: eight bytes before a marker."""
    found = [data.find(bytes([m]), at + _HEAD) for m in (V1_MARKER, V2_MARKER)]
    places = [place for place in found if place >= 0]
    return min(places) - _HEAD if places else len(data)
