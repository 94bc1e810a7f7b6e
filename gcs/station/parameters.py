"""Parameters of one vehicle: read and written by name, in either encoding."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import isclose, isfinite

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


@dataclass(slots=True)
class _Asked:
    """What is known of one name that was asked for."""

    question: Question
    value: float | None  # to write; None only reads
    next_try: float
    tries: int = 0
    written: bool = False


@dataclass(slots=True)
class ParameterClient:
    """Reads and writes parameters by name, each asked until the vehicle tells its value.

    A vehicle is silent about what it does not have. To write one it must be read before: a
    PX4 takes a value in its own type only.
    """

    name: str  # of the vehicle
    system_id: int
    heard: Texts
    stack: FlightStack | None = None
    _asked: dict[str, _Asked] = field(default_factory=dict)
    _types: dict[str, int] = field(default_factory=dict)

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
        if asked is None:
            return
        self._types[name] = m.param_type
        question, value = asked.question, self._decoded(m)
        question.value = value
        if asked.value is None or isclose(value, asked.value, rel_tol=_SINGLE, abs_tol=1e-9):
            question.accepted = True
            del self._asked[name]
        elif not asked.written:  # now its type is known
            asked.next_try, asked.tries = now, 0
        elif asked.tries >= 2:
            self._refuse(name, f"refused: it stays {value:g}")

    def due(self, now: float) -> Iterator[Message]:
        """Yield what is to be asked or asked again now."""
        for name, asked in list(self._asked.items()):
            if now < asked.next_try or self.stack is None:
                continue
            if asked.tries == TRIES:
                self._refuse(name, f"it has no parameter {name}, or does not answer")
                continue
            asked.tries += 1
            asked.next_try = now + RETRY_S
            try:
                message = self._message(name, asked)
            except struct.error:
                self._refuse(name, "it is an integer, of a type that this does not fit")
            else:
                yield message

    def _ask(self, name: str, value: float | None, what: str, now: float) -> Question:
        question = Question(what, self.heard, now)
        if value is not None and not isfinite(value):
            question.problem = f"{self.name}: {what}: not a number"
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
        kind = self._types.get(name)
        message: Message
        if asked.value is None or kind is None:
            message = mav.MAVLink_param_request_read_message(*head, -1)
            return message
        asked.written = True
        message = mav.MAVLink_param_set_message(*head, self._encoded(asked.value, kind), kind)
        return message

    def _decoded(self, m: Message) -> float:
        form = _INTEGERS.get(m.param_type)
        if form and self.stack is not None and self.stack.bytewise_parameters:
            return float(struct.unpack(form, struct.pack("<f", m.param_value))[0])
        return float(m.param_value)

    def _encoded(self, value: float, kind: int) -> float:
        form = _INTEGERS.get(kind)
        if form is None or self.stack is None or not self.stack.bytewise_parameters:
            return value
        return float(struct.unpack("<f", struct.pack(form, round(value)))[0])
