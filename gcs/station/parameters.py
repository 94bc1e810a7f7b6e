"""Parameters of one vehicle: read and written by name, in either encoding."""

import struct
from dataclasses import dataclass, field
from math import isclose

from ...transport.mavlink import Message, mav
from .commands import RETRY_S, TRIES
from .question import Question
from .stacks import FlightStack
from .status import Texts

NAME_LENGTH = 16
_INTEGERS = {
    mav.MAV_PARAM_TYPE_UINT8: "<Bxxx",
    mav.MAV_PARAM_TYPE_INT8: "<bxxx",
    mav.MAV_PARAM_TYPE_UINT16: "<Hxx",
    mav.MAV_PARAM_TYPE_INT16: "<hxx",
    mav.MAV_PARAM_TYPE_UINT32: "<I",
    mav.MAV_PARAM_TYPE_INT32: "<i",
}
_SINGLE = 1e-6  # relative: values travel as 32-bit floats
_LARGEST = 3.4e38  # of those
_WHOLE = 1e-9  # what is so near to an integer is one


@dataclass(slots=True)
class _Asked:
    """What is known of one name that was asked for."""

    question: Question
    value: float | None  # to write; None only reads
    next_try: float
    tries: int = 0
    kind: int | None = None  # MAV_PARAM_TYPE, once it is read
    before: float = 0.0  # what the vehicle had then


@dataclass(slots=True)
class ParameterClient:
    """Reads and writes parameters by name, each asked until the vehicle tells its value.

    A vehicle is silent about what it does not have. What is to be written is read before, since
    a vehicle takes a value in its own type only: PX4 refuses it in another, ArduPilot would cut a
    fraction off, or what is too large, and keep the rest.
    """

    name: str  # of the vehicle
    system_id: int
    heard: Texts
    stack: FlightStack | None = None
    _asked: dict[str, _Asked] = field(default_factory=dict)

    def read(self, name: str, now: float) -> Question:
        """Ask for a value."""
        return self._ask(name, None, f"parameter {name}", now)

    def write(self, name: str, value: float, now: float) -> Question:
        """Have a value set; it is accepted when the vehicle tells that very value."""
        return self._ask(name, float(value), f"parameter {name} = {value:g}", now)

    def hear(self, m: Message, now: float) -> None:
        """Take in a PARAM_VALUE."""
        name = m.param_id[:NAME_LENGTH].partition("\0")[0]
        asked = self._asked.get(name)
        if asked is None or self.stack is None:
            return
        question, value = asked.question, self._decoded(m)
        question.value = value
        if asked.value is None or _agree(value, asked.value, m.param_type):
            question.accepted = True
            del self._asked[name]
        elif asked.kind is None:
            asked.kind, asked.before, asked.next_try, asked.tries = m.param_type, value, now, 0
            if misfit := self._misfit(asked.value, asked.kind):
                self._refuse(name, f"{misfit}; it stays {value:g}")
        elif asked.tries >= 2:
            took = f"it took {value:g} instead, and had {asked.before:g} before"
            self._refuse(name, f"refused: it stays {value:g}" if value == asked.before else took)

    def due(self, now: float) -> list[Message]:
        """Return what is to be asked or asked again now."""
        out: list[Message] = []
        if not self._asked:
            return out
        for name, asked in list(self._asked.items()):
            if now < asked.next_try or self.stack is None:
                continue
            if asked.tries == TRIES:
                self._refuse(name, f"it has no parameter {name}, or does not answer")
                continue
            asked.tries += 1
            asked.next_try = now + RETRY_S
            out.append(self._message(name, asked))
        return out

    def _ask(self, name: str, value: float | None, what: str, now: float) -> Question:
        question = Question(what, self.heard, now)
        if value is not None and not abs(value) <= _LARGEST:
            question.problem = f"{self.name}: {what}: not a number that a vehicle knows"
            return question
        if not name or len(name) > NAME_LENGTH or not name.isascii():
            question.problem = f"{self.name}: {name!r} cannot be the name of a parameter"
            return question
        if older := self._asked.pop(name, None):
            older.question.problem = f"{self.name}: {older.question.what}: overtaken by {what}"
        self._asked[name] = _Asked(question, value, next_try=now)
        return question

    def _refuse(self, name: str, reason: str) -> None:
        question = self._asked.pop(name).question
        question.problem = f"{self.name}: {question.what}: {reason}"

    def _message(self, name: str, asked: _Asked) -> Message:
        head = (self.system_id, mav.MAV_COMP_ID_AUTOPILOT1, name.encode("ascii"))
        message: Message
        if asked.value is None or asked.kind is None:
            message = mav.MAVLink_param_request_read_message(*head, -1)
            return message
        value = self._encoded(asked.value, asked.kind)
        message = mav.MAVLink_param_set_message(*head, value, asked.kind)
        return message

    def _misfit(self, value: float, kind: int) -> str:
        """Return why a parameter of this type cannot have the value; "": it can."""
        form = _INTEGERS.get(kind)
        if form is None:
            return ""
        if abs(value - round(value)) > _WHOLE:
            return "it is an integer, and takes no fraction"
        try:
            struct.pack(form, round(value))
        except struct.error:
            return "it is an integer, of a type that this does not fit"
        (single,) = struct.unpack("<f", struct.pack("<f", round(value)))
        if not self._is_bytewise and single != round(value):
            return f"it is an integer that is told as {single:.0f}: it has too many digits"
        return ""

    @property
    def _is_bytewise(self) -> bool:
        return self.stack is not None and self.stack.bytewise_parameters

    def _decoded(self, m: Message) -> float:
        form = _INTEGERS.get(m.param_type)
        if form and self._is_bytewise:
            return float(struct.unpack(form, struct.pack("<f", m.param_value))[0])
        return float(m.param_value)

    def _encoded(self, value: float, kind: int) -> float:
        form = _INTEGERS.get(kind)
        if form is None:
            return value
        if not self._is_bytewise:
            return float(round(value))
        return float(struct.unpack("<f", struct.pack(form, round(value)))[0])


def _agree(value: float, wanted: float, kind: int) -> bool:
    if kind in _INTEGERS:
        return abs(value - wanted) <= _WHOLE
    return isclose(value, wanted, rel_tol=_SINGLE, abs_tol=1e-9)
