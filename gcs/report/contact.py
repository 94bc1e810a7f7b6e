"""How near robots come to one another: upright cylinders of the size in the paper's Table 1.

Two distances matter and are kept apart. *Contact* is cylinders that overlap. *Separation* is
centre to centre: in space between two quadcopters; in the plane between two rovers; and in the
plane between a rover and a quadcopter while the quadcopter is low enough to need care (it may
fly over a rover, and then their distance in the plane says nothing).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scenarios.starts import CONTACT_RADIUS
from ...transport.frames import Triple
from ...vehicles.truth import RATE_HZ
from .truth import Floats, Trail

CLEAR_M = 0.1  # gap at which a contact is over
LEVEL_M = 0.5  # a quadcopter less than this above a rover's top is at its level


class Body(NamedTuple):
    """The upright cylinder around a robot's position, m."""

    radius: float
    below: float
    above: float


BODIES = {
    "rover": Body(CONTACT_RADIUS["rover"], below=0.0, above=0.9),
    "quadcopter": Body(CONTACT_RADIUS["quadcopter"], below=0.1, above=0.1),
}
CLASSES = ("rover-rover", "quadcopter-quadcopter", "mixed")


class Collision(NamedTuple):
    """Two robots touched, and stay one event until they are clear of each other."""

    time: float  # s of run time at first contact
    names: tuple[str, str]  # in order of system id
    pair_class: str
    position: Triple  # ENU, midway


class Pair(NamedTuple):
    """How near two robots came."""

    names: tuple[str, str]  # in order of system id
    pair_class: str
    contact: float  # m, separation at which their circles touch
    min_separation: float | None  # m; None: no time to judge, or never at one level
    time: float | None  # s of run time when it was smallest


class Aligned(NamedTuple):
    """All tracks on one time axis; NaN where a robot has no truth."""

    time: Floats  # (t,)
    position: Floats  # (robots, 3, t)


def pair_class(kind: str, other: str) -> str:
    """Return which of CLASSES a pair of kinds belongs to."""
    return f"{kind}-{kind}" if kind == other else "mixed"


def contact_distance(kind: str, other: str) -> float:
    """Return the centre distance in the plane at which two robots touch."""
    return BODIES[kind].radius + BODIES[other].radius


def align(tracks: Sequence[Trail], start: float, end: float, rate: float = RATE_HZ) -> Aligned:
    """Return positions at multiples of 1/`rate` within the tracks' time and `start`..`end`."""
    known = [track for track in tracks if len(track)]
    if not known:
        return Aligned(np.empty(0), np.empty((len(tracks), 3, 0)))
    start = max(start, min(track.time[0] for track in known))
    end = min(end, max(track.time[-1] for track in known))
    slack = 1e-6  # of a period: times are sums of steps
    first, last = int(np.ceil(start * rate - slack)), int(np.floor(end * rate + slack))
    time = np.arange(first, last + 1) / rate
    position = np.full((len(tracks), 3, len(time)), np.nan)
    for row, track in zip(position, tracks, strict=True):
        if not len(track):
            continue
        inside = (time >= track.time[0] - 0.5 / rate) & (time <= track.time[-1] + 0.5 / rate)
        for axis in range(3):
            row[axis, inside] = np.interp(time[inside], track.time, track.position[:, axis])
    return Aligned(time, position)


def separations(kinds: Sequence[str], position: Floats, i: int, j: slice) -> tuple[Floats, Floats]:
    """Return squared (horizontal distance, separation) of robot `i` to the robots `j`.

    Both (robots, t); infinite where a position is unknown, and the separation also where a
    rover and a quadcopter are at different levels.
    """
    dx, dy, dz = (position[j, axis] - position[i, axis] for axis in range(3))
    horizontal = dx * dx + dy * dy
    np.copyto(horizontal, np.inf, where=np.isnan(horizontal))
    separation = horizontal.copy()
    others = kinds[j]
    both_fly = np.array([kinds[i] == other == "quadcopter" for other in others])
    mixed = np.array([kinds[i] != other for other in others])
    if both_fly.any():
        separation[both_fly] += dz[both_fly] ** 2
    if mixed.any():
        gap = _vertical_gap(BODIES[kinds[i]], BODIES[_other(kinds[i])], dz[mixed])
        separation[mixed] = np.where(gap < LEVEL_M, separation[mixed], np.inf)
    np.copyto(separation, np.inf, where=np.isnan(separation))
    return horizontal, separation


def examine(
    tracks: Sequence[Trail], ready_at: float | None, ended_at: float
) -> tuple[list[Pair], list[Collision]]:
    """Return every pair's smallest separation from `ready_at` on, and the run's collisions.

    Both in order of system id, collisions in order of time.
    """
    tracks = sorted(tracks, key=lambda track: track.system_id)
    kinds = [track.kind for track in tracks]
    time, position = align(tracks, -np.inf, ended_at)
    begin = len(time) if ready_at is None else int(np.searchsorted(time, ready_at - 1e-6))
    pairs: list[Pair] = []
    collisions: list[Collision] = []
    for i, one in enumerate(tracks[:-1]):
        rest = slice(i + 1, len(tracks))
        horizontal, separation = separations(kinds, position, i, rest)
        judged = separation[:, begin:]
        nearest = judged.argmin(axis=1) if judged.size else np.zeros(len(judged), dtype=int)
        closest_ever = horizontal.min(axis=1, initial=np.inf)
        for row, other in enumerate(tracks[rest]):
            names = (one.name, other.name)
            label = pair_class(one.kind, other.kind)
            contact = contact_distance(one.kind, other.kind)
            smallest = judged[row, nearest[row]] if judged.size else np.inf
            known = bool(np.isfinite(smallest))
            pairs.append(
                Pair(
                    names,
                    label,
                    contact,
                    float(np.sqrt(smallest)) if known else None,
                    float(time[begin + nearest[row]]) if known else None,
                )
            )
            if closest_ever[row] < contact**2:
                a, b = position[i], position[i + 1 + row]
                for k in _first_contacts(BODIES[one.kind], BODIES[other.kind], a, b):
                    east, north, up = ((a[:, k] + b[:, k]) / 2).tolist()
                    collisions.append(Collision(float(time[k]), names, label, (east, north, up)))
    return pairs, sorted(collisions, key=lambda c: c.time)


def _first_contacts(a: Body, b: Body, at: Floats, bt: Floats) -> list[int]:
    """Return the samples at which a contact begins that is not the last one going on."""
    d = bt - at
    over = _vertical_gap(a, b, d[2])
    level = np.flatnonzero(over < 0)
    touch = a.radius + b.radius
    hits = level[np.hypot(d[0, level], d[1, level]) - touch < 0]
    if not len(hits):
        return []
    beside = np.hypot(d[0], d[1]) - touch
    times_clear = np.cumsum((beside >= CLEAR_M) | (over >= CLEAR_M))
    return hits[np.diff(times_clear[hits], prepend=-1) > 0].tolist()


def _vertical_gap(a: Body, b: Body, up: NDArray[np.float64]) -> Floats:
    """Return the height between two cylinders, b being `up` above a; negative: shared."""
    gap: Floats = np.maximum(up - b.below - a.above, -up - a.below - b.above)
    return gap


def _other(kind: str) -> str:
    return "quadcopter" if kind == "rover" else "rover"


def smallest_by_class(kinds: Sequence[str], position: Floats) -> dict[str, Floats]:
    """Return the smallest separation of each class at each time, m; inf: no two at one level.

    `position` is (robots, 3, times) in ENU, as `align` gives it.
    """
    smallest = {label: np.full(position.shape[-1], np.inf) for label in CLASSES}
    for i in range(len(kinds) - 1):
        _, squared = separations(kinds, position, i, slice(i + 1, len(kinds)))
        for row, kind in zip(squared, kinds[i + 1 :], strict=True):
            best = smallest[pair_class(kinds[i], kind)]
            np.minimum(best, row, out=best)
    return {label: np.sqrt(row) for label, row in smallest.items()}
