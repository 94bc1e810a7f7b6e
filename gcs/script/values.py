"""Telemetry and events as plain values: ENU, metres from the fleet origin, SI, radians."""

from collections.abc import Callable, Sequence
from math import isfinite
from typing import NamedTuple

from ...transport.frames import Triple


class Position(NamedTuple):
    """A place, m from the fleet origin."""

    east: float
    north: float
    up: float

    def __str__(self) -> str:
        """Return it to the centimetre, for people."""
        return f"east {self.east:z.2f}, north {self.north:z.2f}, up {self.up:z.2f}"


class Velocity(NamedTuple):
    """How fast and which way, m/s."""

    east: float
    north: float
    up: float

    def __str__(self) -> str:
        """Return it to the cm/s, for people."""
        return f"east {self.east:z.2f}, north {self.north:z.2f}, up {self.up:z.2f}"


class State(NamedTuple):
    """What a vehicle last said of itself."""

    name: str
    time: float  # s of fleet time at which the position was true; negative: none has come yet
    position: Position
    velocity: Velocity
    heading: float  # rad, counter-clockwise from east
    mode: str  # as its flight stack calls it
    armed: bool
    battery: float | None  # what is left, 0..1; None: it does not say
    voltage: float | None  # V


class Event(NamedTuple):
    """Something that happened, as in the run folder's events.jsonl."""

    time: float  # s of fleet time
    vehicle: str | None
    kind: str  # phase | text (what the vehicle says) | wait | ...
    text: str


Moving = tuple[Sequence[float], Sequence[float]]
"""Position and velocity, (east, north, up) each."""

Path = Callable[[float], Moving]
"""Where a vehicle shall be, and how fast, `t` seconds after the order."""


def finite(value: float, what: str) -> float:
    """Return a number as a float; raise ValueError for what no vehicle should be sent."""
    number = float(value)
    if not isfinite(number):
        raise ValueError(f"{what}: expected a finite number, got {value!r}")
    return number


def triple(values: Sequence[float]) -> Triple:
    """Return (east, north, up) as finite floats; raise ValueError for anything else."""
    if len(values) != len(Position._fields):
        raise ValueError(f"expected (east, north, up), got {values!r}")
    east, north, up = map(finite, values, Position._fields)
    return (east, north, up)
