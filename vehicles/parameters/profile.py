"""The usual constants and gains of a kind of vehicle: what parameters show as their defaults."""

from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from types import MappingProxyType

from .. import quadcopter_tuning, rover_control
from ..quadcopter import QuadcopterParams
from ..quadcopter_tuning import QuadcopterTuning
from ..rover import RoverParams
from ..rover_control import RoverTuning

Body = QuadcopterParams | RoverParams
Tuning = QuadcopterTuning | RoverTuning


def body_and_tuning(kind: str, profile: str) -> tuple[Body, Tuning]:
    """Return the constants of a kind of vehicle and the gains of a profile."""
    if kind == "quadcopter":
        return QuadcopterParams(), quadcopter_tuning.PROFILES[profile]
    return RoverParams(), rover_control.PROFILES[profile]


@cache
def numbers(kind: str, profile: str) -> Mapping[str, float]:
    """Return every constant and gain by its name, SI units."""
    found = {
        field.name: getattr(part, field.name)
        for part in body_and_tuning(kind, profile)
        for field in fields(part)
        if isinstance(getattr(part, field.name), float)
    }
    return MappingProxyType(found)
