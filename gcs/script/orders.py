"""What a script can tell a vehicle to do: one order at a time, each a plain value."""

from collections.abc import Sequence
from dataclasses import dataclass

from ...transport.frames import Triple
from .values import Path


@dataclass(frozen=True, slots=True)
class Rest:
    """Nobody steers the vehicle: before arming, after landing, or since a pilot took over."""


@dataclass(frozen=True, slots=True)
class Arm:
    """Take command: guided mode, then armed."""

    patience_s: float  # for a vehicle that is not ready to change its mind


@dataclass(frozen=True, slots=True)
class TakeOff:
    """Climb to `up` metres above the fleet origin, then stay there."""

    up: float
    patience_s: float


@dataclass(frozen=True, slots=True)
class Hold:
    """Stay where it is when it gets the order."""


@dataclass(frozen=True, slots=True)
class Goto:
    """Go straight to a place and stay there; None keeps what it has."""

    east: float | None
    north: float | None
    up: float | None


@dataclass(frozen=True, slots=True)
class Move:
    """Move at this velocity until told otherwise; without a climb it keeps its height."""

    velocity: Triple


@dataclass(frozen=True, slots=True)
class Follow:
    """Follow a target that moves."""

    path: Path


@dataclass(frozen=True, slots=True)
class Fly:
    """Upload a mission, run it in the vehicle's own AUTO mode, then stay at its end."""

    points: Sequence[Triple]


@dataclass(frozen=True, slots=True)
class Land:
    """Land here and disarm; a rover stops and disarms."""


Order = Rest | Arm | TakeOff | Hold | Goto | Move | Follow | Fly | Land
STEERED = (Hold, Goto, Move, Follow)  # the coordinator steers; the others are the vehicle's own


@dataclass(slots=True, eq=False)
class Task:
    """One order on its way: it ends `done` or with an `error`; neither when another replaced it."""

    order: Order
    done: bool = False
    error: BaseException | None = None
    begun_at: float = -1.0  # s of fleet time; negative: not yet
