"""MAVLink's messages, enums and constants. The only module that imports pymavlink.

All of it is its generated dialect, as attributes under the same names and made known on first
use; but the classes of messages are subclasses that cost less (see `form`).
"""

import sys
from functools import cached_property
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as _pymavlink

from .form import Form, make_form

mav: Any = sys.modules[__name__]
"""This module, which has attributes of many names."""

_forms: dict[Any, Form] = {}  # by class


class LeanMessage(_pymavlink.MAVLink_message):  # type: ignore[misc]
    """What messages of all kinds share. Who sent one is told by the codec that reads it.

    Without fields that say whom it is for, it is for everybody.
    """

    target_system = target_component = 0

    _number = 0
    _system = _component = _sequence = 0
    # What pymavlink's constructor sets, and nobody changes in most of them:
    _payload = _crc = _link_id = _instances = None
    _msgbuf = b""
    _signed = False

    def get_msgId(self) -> int:  # noqa: N802 - pymavlink's name
        """Return the number of this kind of message."""
        return self._number

    def get_srcSystem(self) -> int:  # noqa: N802
        """Return the sender's system id."""
        return self._system

    def get_srcComponent(self) -> int:  # noqa: N802
        """Return the sender's component id."""
        return self._component

    def get_seq(self) -> int:
        """Return the sequence number."""
        return self._sequence

    @cached_property
    def _header(self) -> Any:
        """What pymavlink's own methods look at."""
        return _pymavlink.MAVLink_header(
            self._number,
            seq=self._sequence,
            srcSystem=self._system,
            srcComponent=self._component,
        )


def form_of(kind: Any) -> Form:
    """Return the form of a class of messages: ours, pymavlink's, or one with the same tables."""
    form = _forms.get(kind)
    if form is None:
        form = _forms[kind] = make_form(kind, LeanMessage)
        _forms[form.kind] = form
    return form


def form_numbered(number: int) -> Form | None:
    """Return the form of the dialect's message with this number, if there is one."""
    kind = _pymavlink.mavlink_map.get(number)
    return form_of(kind) if kind else None


def __getattr__(name: str) -> Any:
    value = getattr(_pymavlink, name)
    if isinstance(value, type) and getattr(value, "fieldnames", None):
        value = form_of(value).kind
    globals()[name] = value
    return value
