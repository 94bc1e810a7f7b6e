"""What the two bodies share: gravity, forces and the check of a parameter set."""

from collections.abc import Collection
from dataclasses import Field, fields
from math import isfinite
from typing import Any, ClassVar, Final, Protocol

GRAVITY: Final = 9.80665  # m/s^2

Force = tuple[float, float, float]
"""A force along the body axes (FRD), N."""


class _Dataclass(Protocol):
    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]


def require_positive(parameters: _Dataclass, may_be_zero: Collection[str] = ()) -> None:
    """Raise ValueError unless every number in a dataclass is finite and positive."""
    for field in fields(parameters):
        value = getattr(parameters, field.name)
        if isinstance(value, bool):
            continue
        if not isfinite(value) or value < 0 or (value == 0 and field.name not in may_be_zero):
            wanted = "zero or positive" if field.name in may_be_zero else "positive"
            raise ValueError(f"{field.name} must be {wanted} and finite, got {value}")
