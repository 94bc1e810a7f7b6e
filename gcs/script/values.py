"""Telemetry and events as plain values: ENU, metres from the fleet origin, SI, radians."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from ...transport.frames import Triple


class Position(NamedTuple):
    """A place, m from the fleet origin."""

    east: float
    north: float
    up: float


class Velocity(NamedTuple):
    """How fast and which way, m/s."""

    east: float
    north: float
    up: float


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


def triple(values: Sequence[float]) -> Triple:
    """Return three numbers as floats; raise ValueError for anything else."""
    east, north, up = values
    return (float(east), float(north), float(up))
