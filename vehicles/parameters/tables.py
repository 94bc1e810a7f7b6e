"""The parameters of one vehicle: its flight stack's table with the truth of its gain profile."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from types import MappingProxyType
from typing import NamedTuple

from ..flight.settings import Settings
from . import ardupilot_copter, ardupilot_rover, px4
from .parameter import INT32, Parameter
from .profile import body_and_tuning
from .settings_path import read

RANGE = 100.0
"""A gain or constant may be so many times its usual value, or less by as much."""

TABLES: Mapping[tuple[str, str], tuple[Parameter, ...]] = {
    ("ardupilot", "quadcopter"): ardupilot_copter.TABLE,
    ("ardupilot", "rover"): ardupilot_rover.TABLE,
    ("generic", "quadcopter"): ardupilot_copter.TABLE,
    ("generic", "rover"): ardupilot_rover.TABLE,
    ("px4", "quadcopter"): px4.QUADCOPTER_TABLE,
    ("px4", "rover"): px4.ROVER_TABLE,
}
"""By personality and kind of vehicle; defaults of gains and constants are still open."""

PRESETS: Mapping[str, Mapping[str, object]] = {"px4": px4.PRESETS}
"""Settings in which a flight stack differs although it has no parameter for them."""

SYSTEM_IDS = ("SYSID_THISMAV", "MAV_SYS_ID")
"""The parameters that show the system id."""

_OF_PROFILE: Mapping[str, Mapping[str, float]] = {"ardupilot": {"WP_YAW_BEHAVIOR": 2.0}}
"""Defaults that come with a gain profile."""

_UNBOUNDED = 1e9  # the limit that `rows.gain` and `rows.constant` leave open
_ANY = 1e6  # of a gain that usually is zero


@cache
def table(personality: str, kind: str, profile: str) -> tuple[Parameter, ...]:
    """Return the parameters in the order in which they are listed."""
    parts = dict(zip(("body", "tuning"), body_and_tuning(kind, profile), strict=True))
    rows = []
    for parameter in TABLES[personality, kind]:
        part, _, name = (parameter.follows or parameter.path).partition(".")
        if part in parts:
            parameter = _with_default(parameter, float(getattr(parts[part], name)))
        if own := _OF_PROFILE.get(profile, {}).get(parameter.name):
            parameter = replace(parameter, default=own)
        if personality == "px4" and parameter.is_integer:
            parameter = replace(parameter, type=INT32)  # PX4 knows no other integers
        rows.append(parameter)
    if personality == "px4":
        rows.sort(key=lambda parameter: parameter.name)  # as PX4 lists them
    return tuple(rows)


class Facts(NamedTuple):
    """What every vehicle with the same table would work out again."""

    table: tuple[Parameter, ...]
    places: Mapping[str, int]  # by name
    defaults: tuple[float, ...]  # as they are kept
    settings: tuple[tuple[int, object], ...]  # which are settings, and what those usually are
    robots: tuple[int, ...]  # which are the robot's


@cache
def facts(personality: str, kind: str, profile: str) -> Facts:
    """Return a table with what follows from it."""
    rows, usual = table(personality, kind, profile), Settings()
    return Facts(
        rows,
        MappingProxyType({parameter.name: i for i, parameter in enumerate(rows)}),
        tuple(parameter.stored(parameter.default) for parameter in rows),
        tuple((i, read(usual, p.path)) for i, p in enumerate(rows) if p.is_setting),
        tuple(i for i, parameter in enumerate(rows) if parameter.is_robots),
    )


def _with_default(parameter: Parameter, usual: float) -> Parameter:
    default = parameter.to_wire(usual)
    low, high = parameter.low, max(parameter.high, default)
    if parameter.high == _UNBOUNDED:
        low, high = 0.0, default * RANGE or _ANY
    return replace(parameter, default=default, low=low, high=high)
