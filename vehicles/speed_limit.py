"""A speed limit that can be set on a robot for a while, as DO_CHANGE_SPEED does."""

from math import isfinite
from typing import Protocol

_SLOWEST = 0.02  # m/s: less is no speed to go anywhere


class Limited(Protocol):
    """A robot that wants to know when one of its speed limits has changed."""

    def limits_changed(self) -> None:
        """Take up the new limits."""
        ...


class SpeedLimit:
    """An attribute of a robot: m/s, or None for the limit in its tuning."""

    def __init__(self, highest: float) -> None:
        self._highest = highest

    def __set_name__(self, owner: type, name: str) -> None:
        self._name, self._slot = name, f"_{name}"

    def __get__(self, robot: Limited, owner: type | None = None) -> float | None:
        limit: float | None = getattr(robot, self._slot, None)
        return limit

    def __set__(self, robot: Limited, limit: float | None) -> None:
        if limit is not None:
            if not (isfinite(limit) and limit > 0):
                raise ValueError(f"{self._name} must be positive and finite, got {limit}")
            limit = max(_SLOWEST, min(limit, self._highest))
        setattr(robot, self._slot, limit)
        robot.limits_changed()
