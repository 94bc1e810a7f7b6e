"""Short words to write the tables of parameters with: one line, one parameter."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from ..flight.settings import Action
from .parameter import INT8, INT16, INT32, REAL32, Parameter

ON_OFF = {0: "Disabled", 1: "Enabled"}
_LIMITS = {INT8: 127.0, INT16: 32767.0, INT32: 2147483647.0, REAL32: 1e9}


def row(
    type_: int,
    name: str,
    default: float,
    limits: tuple[float, float] | None,
    text: str,
    path: str = "",
    unit: str = "",
    scale: float = 1.0,
    **more: Any,
) -> Parameter:
    """Return a parameter; without `limits` those of its type hold."""
    low, high = limits or (-_LIMITS[type_], _LIMITS[type_])
    return Parameter(
        name=name,
        type=type_,
        default=default,
        low=low,
        high=high,
        text=text,
        path=path,
        unit=unit,
        scale=scale,
        **more,
    )


int8 = partial(row, INT8)
int16 = partial(row, INT16)
int32 = partial(row, INT32)
real = partial(row, REAL32)


def choice(
    name: str,
    default: float,
    text: str,
    path: str,
    codes: Mapping[int, tuple[str, object]],
    type_: int = INT8,
) -> Parameter:
    """Return a parameter whose every value has a label and a meaning, such as an `Action`."""
    return row(
        type_,
        name,
        default,
        (min(codes), max(codes)),
        text,
        path,
        values={code: label for code, (label, _) in codes.items()},
        codes={code: meaning for code, (_, meaning) in codes.items()},
    )


def switch(name: str, default: float, text: str, path: str, type_: int = INT8) -> Parameter:
    """Return a parameter that is 0 or 1."""
    return row(type_, name, default, (0, 1), text, path, values=ON_OFF)


def fact(type_: int, name: str, value: float, text: str, **more: Any) -> Parameter:
    """Return a parameter that only says how things are."""
    return row(type_, name, value, None, text, read_only=True, **more)


def live(type_: int, name: str, value: float, text: str, **more: Any) -> Parameter:
    """Return a parameter that the vehicle itself writes."""
    return row(type_, name, value, None, text, read_only=True, live=True, **more)


def gain(name: str, field: str, text: str, unit: str = "", scale: float = 1.0) -> Parameter:
    """Return a parameter of the controllers; default and limits come from the gain profile."""
    return real(name, 0.0, None, text, f"tuning.{field}", unit, scale)


def constant(name: str, field: str, text: str, unit: str = "", scale: float = 1.0) -> Parameter:
    """Return a constant of the body; default and limits come from the physics."""
    return real(name, 0.0, None, text, f"body.{field}", unit, scale, reboot=True)


def grouped(group: str, *parameters: Parameter) -> list[Parameter]:
    """Return parameters as members of a group."""
    return [replace(parameter, group=group) for parameter in parameters]


def joined(*groups: Iterable[Parameter]) -> tuple[Parameter, ...]:
    """Return the parameters of all groups, in order."""
    return tuple(parameter for group in groups for parameter in group)


COPTER_ACTIONS: Mapping[int, tuple[str, object]] = {
    0: ("Warn only", Action.WARN),
    1: ("Land", Action.LAND),
    2: ("RTL", Action.RTL),
    5: ("Terminate", Action.DISARM),
    7: ("Brake", Action.HOLD),
}
ROVER_ACTIONS: Mapping[int, tuple[str, object]] = {
    0: ("Warn only", Action.WARN),
    1: ("RTL", Action.RTL),
    2: ("Hold", Action.HOLD),
    5: ("Terminate", Action.DISARM),
}
