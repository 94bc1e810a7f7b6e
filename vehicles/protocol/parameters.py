"""The parameter protocol on one link: list, read and set (mavlink.io, parameter service).

Integers travel as floats (ArduPilot) or as their bits in the float's place (PX4). What does not
exist is met with silence, as by ArduPilot 4.6.
"""

import struct
from collections.abc import Callable, Mapping
from zlib import crc32

from ...transport.errors import MavherdError
from ...transport.mavlink import Message, mav
from ..parameters.parameter import INT32, NAME_LENGTH, REAL32, Parameter, ParameterRefused
from ..parameters.store import Entry, Parameters
from .service import Handler

HASH_CHECK = "_HASH_CHECK"
"""PX4's checksum of all values: a ground station that knows it needs no list."""

_BURST = 20  # values in one call of `due`
_PATIENCE = 100  # reads and sets that are answered between two calls of `due`
_BANNER_INTERVAL = 1.0  # s
_NO_INDEX = 65535
_UINT32: int = mav.MAV_PARAM_TYPE_UINT32
_INTEGERS = {
    mav.MAV_PARAM_TYPE_UINT8: "<Bxxx",
    mav.MAV_PARAM_TYPE_INT8: "<bxxx",
    mav.MAV_PARAM_TYPE_UINT16: "<Hxx",
    mav.MAV_PARAM_TYPE_INT16: "<hxx",
    mav.MAV_PARAM_TYPE_UINT32: "<I",
    mav.MAV_PARAM_TYPE_INT32: "<i",
}


class ParameterService:
    """Answers PARAM_* on one link.

    `broadcast` sends a message to every link, `say` a warning to all; `on_list` is called when a
    list is asked for, at most once a second. `bytewise` is PX4's way with integers.
    """

    def __init__(
        self,
        parameters: Parameters,
        broadcast: Callable[[Message], None],
        say: Callable[[str], None],
        *,
        bytewise: bool = False,
        on_list: Callable[[], None] | None = None,
    ) -> None:
        self.handlers: Mapping[str, Handler] = {
            "PARAM_REQUEST_LIST": self._on_list,
            "PARAM_REQUEST_READ": self._on_read,
            "PARAM_SET": self._on_set,
        }
        self._parameters = parameters
        self._count = len(parameters)
        self._broadcast = broadcast
        self._say = say
        self._bytewise = bytewise
        self._announce = on_list
        self._now = 0.0
        self._announced_at = -_BANNER_INTERVAL
        self._next = self._count  # place in the list that goes out next
        self._hash_due = False
        self._answered = 0  # reads and sets since the last `due`

    @property
    def busy(self) -> bool:
        """Whether a list is under way."""
        return self._hash_due or self._next < self._count

    def due(self, now: float) -> list[Message]:
        """Return the next values of a list that was asked for."""
        self._now = now
        self._answered = 0
        out: list[Message] = []
        if self._hash_due:
            self._hash_due = False
            out.append(self._hash_check())
        if self._next < self._count:
            end = min(self._count, self._next + _BURST)
            out += [self._value(self._parameters.at(i)) for i in range(self._next, end)]
            self._next = end
        return out

    def _on_list(self, _: Message) -> list[Message]:
        """Begin the list, also one that is under way."""
        self._next = 0
        self._hash_due = self._bytewise
        if self._announce and self._now - self._announced_at >= _BANNER_INTERVAL:
            self._announced_at = self._now
            self._announce()
        return []

    def _on_read(self, m: Message) -> list[Message]:
        if self._is_too_much():
            return []
        if m.param_index >= 0:
            known = m.param_index < self._count
            return [self._value(self._parameters.at(m.param_index))] if known else []
        name = _name(m)
        if name == HASH_CHECK and self._bytewise:
            return [self._hash_check()]
        return [self._value(self._parameters.entry(name))] if name in self._parameters else []

    def _on_set(self, m: Message) -> list[Message]:
        """Set and tell everybody; what is refused is told to the sender, and why to all."""
        if self._is_too_much():
            return []
        name = _name(m)
        if name == HASH_CHECK and self._bytewise:  # the station knows our values already
            self._next, self._hash_due = self._count, False
            return []
        if name not in self._parameters:
            return []
        try:
            self._parameters.set(name, self._number(m, self._parameters.entry(name).parameter))
        except ParameterRefused as reason:
            self._say(str(reason))
            return [self._value(self._parameters.entry(name))]
        except MavherdError as trouble:  # it is set, but could not be kept
            self._say(str(trouble))
        self._broadcast(self._value(self._parameters.entry(name)))
        return []

    def _is_too_much(self) -> bool:
        """Count a request; return whether the peer sends more than anybody needs."""
        self._answered += 1
        return self._answered > _PATIENCE

    def _number(self, m: Message, parameter: Parameter) -> float:
        """Return the value in a PARAM_SET, whatever type the sender takes it for.

        But for the bits of an integer meant for a float: PX4 refuses them, and MAVSDK knows.
        """
        form = _INTEGERS.get(m.param_type)
        if form and self._bytewise:
            if parameter.type == REAL32:
                raise ParameterRefused(f"{parameter.name}: is no integer")
            return float(struct.unpack(form, struct.pack("<f", m.param_value))[0])
        return float(m.param_value)

    def _value(self, entry: Entry) -> Message:
        place, parameter, value, _ = entry
        if self._bytewise and parameter.type == INT32:
            value = _bits("<i", int(value))
        return _param_value(parameter.name, value, parameter.type, self._count, place)

    def _hash_check(self) -> Message:
        value = _bits("<I", checksum(self._parameters))
        return _param_value(HASH_CHECK, value, _UINT32, self._count, _NO_INDEX)


def checksum(parameters: Parameters) -> int:
    """Return PX4's checksum: a CRC-32 from 0, not inverted, over names and values by name."""
    crc = 0xFFFFFFFF
    for _, parameter, value, _ in sorted(parameters, key=lambda entry: entry.parameter.name):
        if parameter.live:
            continue
        real = parameter.type == REAL32
        packed = struct.pack("<f", value) if real else struct.pack("<i", int(value))
        crc = crc32(packed, crc32(parameter.name.encode("ascii"), crc))
    return crc ^ 0xFFFFFFFF


def _param_value(name: str, value: float, type_: int, count: int, index: int) -> Message:
    message: Message = mav.MAVLink_param_value_message(
        name.encode("ascii"), value, type_, count, index
    )
    return message


def _bits(form: str, value: int) -> float:
    """Return the float whose bits are those of an integer."""
    number: float = struct.unpack("<f", struct.pack(form, value))[0]
    return number


def _name(m: Message) -> str:
    """Return a parameter's name, which ends with a NUL or after 16 characters."""
    name: str = m.param_id
    return name[:NAME_LENGTH].partition("\0")[0]
