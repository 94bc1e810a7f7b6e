"""How the fields of one kind of message become a payload and back, from the dialect's tables."""

from collections.abc import Callable
from functools import cache
from typing import Any

from fastcrc.crc16 import mcrf4xx

_SIZES = {"char": 1, "float": 4, "double": 8} | {
    f"{sign}int{bits}_t": bits // 8 for sign in ("", "u") for bits in (8, 16, 32, 64)
}


class Form:
    """The layout of one kind of message, and the functions that are written for it.

    `pack(message)` returns the whole payload with all its zeros; `read(data, at, system,
    component, sequence)` returns the message whose whole payload begins at `at`.
    """

    def __init__(
        self, kind: Any, pack: Callable[[Any], bytes], read: Callable[..., Any], number: int
    ) -> None:
        self.kind = kind
        self.pack = pack
        self.read = read
        self.number = number
        self.crc_extra = bytes((kind.crc_extra,))
        self.size: int = kind.unpacker.size


def make_form(kind: Any, base: Any) -> Form:
    """Return the form of a class that has the dialect's tables.

    Its messages are of a subclass, and of `base`: fields and methods are the same, but they are
    made, packed and read by code that is written for their fields.
    """
    code: dict[str, Any] = {
        "_new": object.__new__,
        "_pack": kind.unpacker.pack,
        "_text": _text,
        "_unpack": kind.unpacker.unpack_from,
    }
    # Compiled first: Ctrl-C in the exec of a text ends Python by SIGINT, caught or not.
    program = compile(_source(kind), f"<{kind.msgname}>", "exec")
    exec(program, code)  # noqa: S102 - as namedtuple does; of the dialect's names only
    code["__init__"].__defaults__ = kind.__init__.__defaults__
    body = {
        "__doc__": kind.__doc__,
        "__init__": code["__init__"],
        "__module__": base.__module__,
        "_fieldnames": kind.fieldnames,
        "_number": kind.id,
        "_type": kind.msgname,
    }
    code["_kind"] = type(kind.__name__, (base, kind), body)
    return Form(code["_kind"], code["pack"], code["read"], kind.id)


def _source(kind: Any) -> str:
    """Return Python for `__init__`, `pack` and `read`.

    Text is kept twice, as by pymavlink: `_name_raw` is what is sent, `name` is for reading.
    """
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    packed, unpacked, at = [], [], 0
    for name, array in zip(kind.ordered_fieldnames, kind.array_lengths, strict=True):
        end = at + 1
        if types[name] == "char":
            packed.append(f"_m._{name}_raw")
            unpacked.append(_assign(name, f"_v[{at}].rstrip(b'\\0')", "char"))
        elif array:
            end = at + array
            packed.append(f"*_m.{name}[:{array}]")
            unpacked.append(f"_m.{name} = list(_v[{at}:{end}])")
        else:
            packed.append(f"_m.{name}")
            unpacked.append(f"_m.{name} = _v[{at}]")
        at = end
    return "\n    ".join(
        (
            f"def __init__(_m, {', '.join(kind.fieldnames)}):",
            *(_assign(name, name, types[name]) for name in kind.fieldnames),
            f"\ndef pack(_m):\n    return _pack({', '.join(packed)})",
            "\ndef read(data, at, system, component, sequence):",
            "_m, _v = _new(_kind), _unpack(data, at)",
            *unpacked,
            "_m._system = system; _m._component = component; _m._sequence = sequence",
            "return _m",
        )
    )


def _assign(name: str, value: str, type_: str) -> str:
    if type_ == "char":
        return f"_m._{name}_raw = {value}; _m.{name} = _text(_m._{name}_raw)"
    return f"_m.{name} = {value}"


def _text(raw: Any) -> Any:
    return raw.split(b"\0", 1)[0].decode("ascii", errors="replace")


@cache
def base_size(kind: Any) -> int:
    """Return the payload bytes of a message without its extension fields.

    The dialect does not say where they begin, but `crc_extra`, by which two ends assure one
    another that they mean the same fields, is made of those before them only.
    """
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    text, size, found = f"{kind.msgname} ".encode(), 0, 0
    for name, array in zip(kind.ordered_fieldnames, kind.array_lengths, strict=True):
        text += f"{types[name]} {name} ".encode() + (bytes((array,)) if array else b"")
        size += _SIZES[types[name]] * (array or 1)
        crc = mcrf4xx(text)
        if crc & 0xFF ^ crc >> 8 == kind.crc_extra:
            found = size  # the last one counts: a shorter one is chance
    return found or size
