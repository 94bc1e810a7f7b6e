"""All parameters in one file, packed as ArduPilot's `@PARAM/param.pck`: a list in two seconds.

A header (magic, number here, number in all; 16 bits each, little-endian), then for each: type in
the low and flags in the high half of a byte; letters shared with the name before in the low half
and the number of others, less one, in the high half of the next; those letters; the value; and,
where flag 1 says so, the default. Zero bytes between two entries are padding; we need none.
"""

import struct

from .parameter import INT8, INT16, INT32, REAL32, Parameter
from .store import Parameters

_HEADER = struct.Struct("<HHH")
_MAGIC = 0x671B
_MAGIC_WITH_DEFAULTS = 0x671C
_HAS_DEFAULT = 1 << 4
_MOST_SHARED = 15
_TYPES = {INT8: (1, "<b"), INT16: (2, "<h"), INT32: (3, "<i"), REAL32: (4, "<f")}


def pack(
    parameters: Parameters, *, with_defaults: bool = False, start: int = 0, count: int = 0
) -> bytes:
    """Return the packed parameters from place `start` on, `count` of them (0: all the others)."""
    total = len(parameters)
    end = min(total, start + count) if count else total
    places = range(min(start, total), end)
    magic = _MAGIC_WITH_DEFAULTS if with_defaults else _MAGIC
    out = [_HEADER.pack(magic, len(places), total)]
    last = ""
    for place in places:
        _, parameter, value, default = parameters.at(place)
        out.append(_entry(parameter, last, value, default if with_defaults else value))
        last = parameter.name
    return b"".join(out)


def _entry(parameter: Parameter, last: str, value: float, default: float) -> bytes:
    """Return one parameter; its default only where that differs."""
    name, shared = parameter.name, 0
    most = min(len(name) - 1, len(last), _MOST_SHARED)
    while shared < most and name[shared] == last[shared]:
        shared += 1
    code, form = _TYPES[parameter.type]
    flags = _HAS_DEFAULT if default != value else 0
    head = bytes((code | flags, shared | (len(name) - shared - 1) << 4))
    values = (value, default) if flags else (value,)
    return head + name[shared:].encode("ascii") + b"".join(_value(form, v) for v in values)


def _value(form: str, value: float) -> bytes:
    return struct.pack(form, value if form == "<f" else int(value))
