"""A frame in words: which message, which way, and what its fields say."""

import struct
from collections.abc import Iterator
from math import isfinite
from typing import Any, NamedTuple

from ...transport.mavlink import V2_MARKER, mav

GROUND_ID = 254
"""The system id of every coordinator; all others on its links are vehicles."""

_reader = mav.MAVLink(None)


class Header(NamedTuple):
    """What a frame says before its payload."""

    version: int  # of MAVLink
    flags: int
    sequence: int
    system_id: int
    component_id: int
    message_id: int


class FieldDifference(NamedTuple):
    """A field that two messages of one type give differently; what is in the header has a space."""

    name: str
    a: Any
    b: Any
    kind: str = ""  # of MAVLink, such as `float`; an array has its length too: `float[4]`


def header(frame: bytes) -> Header:
    """Return the header of a whole frame."""
    if frame[0] == V2_MARKER:
        flags, sequence, system, component = frame[2], frame[4], frame[5], frame[6]
        return Header(2, flags, sequence, system, component, int.from_bytes(frame[7:10], "little"))
    return Header(1, 0, *frame[2:6])


def from_ground(frame: bytes) -> bool:
    """Return whether a coordinator has sent it."""
    return header(frame).system_id == GROUND_ID


def is_damaged(frame: bytes) -> bool:
    """Return whether a frame's checksum is wrong; of a message of another dialect none can tell."""
    try:
        _reader.decode(bytearray(frame))
    except mav.MAVError:
        return True
    return False


def content(frame: bytes) -> bytes:
    """Return the frame without its sequence number and without its checksum, which covers that."""
    at = 4 if frame[0] == V2_MARKER else 2
    return frame[:at] + frame[at + 1 : -2]


def name_of(frame: bytes) -> str:
    """Return the message's name in the dialect."""
    number = header(frame).message_id
    kind = mav.mavlink_map.get(number)
    return kind.msgname if kind else f"message {number}"


def differences(a: bytes, b: bytes) -> list[FieldDifference]:
    """Return what two frames give differently, fields in the dialect's order, then the header.

    Both are of one type. NaN equals NaN, and -0 is not 0: it is other bytes.
    """
    found = [
        FieldDifference(name, x, y, kind)
        for (name, kind, x), (_, _, y) in zip(_fields(a), _fields(b), strict=False)
        if show(x, kind) != show(y, kind)
    ]
    words = ("MAVLink version", "flags", "sequence number", "system id", "component id")
    pairs = zip(words, header(a), header(b), strict=False)
    found += [FieldDifference(word, x, y) for word, x, y in pairs if x != y]
    return found or [FieldDifference("bytes of the payload", a.hex(), b.hex())]


def show(value: Any, kind: str) -> str:
    """Return a value in as few digits as tell it from every other value of its type."""
    if isinstance(value, list | tuple):
        inner = kind.partition("[")[0]
        return "[" + ", ".join(show(item, inner) for item in value) + "]"
    if kind.startswith("float") and isfinite(value):
        return _shortest(value)
    return repr(value)


def _shortest(value: float) -> str:
    for digits in range(6, 10):
        text = f"{value:.{digits}g}"
        if struct.pack("<f", float(text)) == struct.pack("<f", value):
            break
    return text


def _fields(frame: bytes) -> Iterator[tuple[str, str, Any]]:
    """Yield name, type and value of each field; a foreign message has its payload only."""
    try:
        message = _reader.decode(bytearray(frame))
    except mav.MAVError:
        message = None
    if message is None or message.get_msgId() < 0:
        start = 10 if frame[0] == V2_MARKER else 6
        yield "payload", "", frame[start:-2].hex()
        return
    kind = message.__class__
    lengths = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    for name, base in zip(kind.fieldnames, kind.fieldtypes, strict=True):
        array = f"[{lengths[name]}]" if lengths[name] and base != "char" else ""
        yield name, base + array, getattr(message, name)
