"""How a robot moved from the moment when all were ready: way, effort, standing still. ENU, m, s.

All but the way is measured on positions at 20 Hz, of which every run has the same, also one that
keeps nothing else.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...vehicles.truth import RATE_HZ
from .truth import Floats, Track, Trail

MOTION_HZ = 20
STUCK_S = 2.0  # who has come no farther than STUCK_M in so long stands
STUCK_M = 0.1
STUCK_RAD = 0.2  # unless it has turned by more than this

Mask = NDArray[np.bool_]


class Way(NamedTuple):
    """A track from the moment when all were ready, at 100 Hz."""

    time: Floats  # (n,) s since then
    position: Floats  # (n, 3)
    heading: Floats | None  # (n,) rad; None: not known
    commands: Floats | None  # (n, k) rad/s asked of each rotor or wheel; None: not known

    def until(self, end: float) -> "Way":
        """Return the part up to `end`."""
        last = int(np.searchsorted(self.time, end + 1e-6, "right"))
        heading = None if self.heading is None else self.heading[:last]
        commands = None if self.commands is None else self.commands[:last]
        return Way(self.time[:last], self.position[:last], heading, commands)

    def thinned(self) -> "Way":
        """Return every row that is measured."""
        every = slice(None, None, RATE_HZ // MOTION_HZ)
        heading = None if self.heading is None else self.heading[every]
        return Way(self.time[every], self.position[every], heading, None)


class Effort(NamedTuple):
    """The horizontal acceleration of a way, squared: its integral, and the root of its mean."""

    integral: float  # m^2/s^3
    rms: float  # m/s^2


def cut(track: Trail, ready_at: float, ended_at: float) -> Way:
    """Return what a track has from `ready_at` to `ended_at`, in s of run time."""
    first = int(np.searchsorted(track.time, ready_at - 1e-6, "left"))
    last = int(np.searchsorted(track.time, ended_at + 1e-6, "right"))
    time, position = track.time[first:last] - ready_at, track.position[first:last]
    if not isinstance(track, Track):
        return Way(time, position, None, None)
    asked = [k for k, name in enumerate(track.actuator_names) if _is_command(name)]
    commands = track.actuators[first:last, asked] if asked else None
    return Way(time, position, _heading(track.quaternion[first:last]), commands)


def distance(kind: str, position: Floats, target: Floats) -> Floats:
    """Return how far positions are from a target or from each their own: a rover's in the plane."""
    east, north, up = (position[:, axis] - target[..., axis] for axis in range(3))
    squared = east * east + north * north
    return np.asarray(np.sqrt(squared if kind == "rover" else squared + up * up))


def driven(kind: str, way: Way) -> float:
    """Return the length of a way."""
    return float(distance(kind, np.diff(way.position, axis=0), np.zeros(3)).sum())


def effort(way: Way) -> Effort | None:
    """Return the effort of a way; None when it is too short to tell."""
    places = way.thinned().position[:, :2]
    if len(places) < 3:
        return None
    squared = np.sum((np.diff(places, n=2, axis=0) * MOTION_HZ**2) ** 2, axis=1)
    return Effort(float(squared.sum()) / MOTION_HZ, sqrt(float(squared.mean())))


def actuator_rms(way: Way, rest: float) -> float | None:
    """Return the RMS of what was asked of rotors or wheels beyond `rest`; rad/s."""
    if way.commands is None or not way.commands.size:
        return None
    return sqrt(float(np.mean((way.commands - rest) ** 2)))


def stuck(kind: str, way: Way, to_go: Mask) -> Mask | None:
    """Return when a robot stood though it had to go: for a thinned way, one answer a row.

    It stands in every STUCK_S in which it has come no farther than STUCK_M and, a rover, turned by
    no more than STUCK_RAD; such a while counts when it had to go at both its ends. None: a rover's
    heading is not known.
    """
    n = round(STUCK_S * MOTION_HZ)
    stands = np.zeros(len(way.time), dtype=bool)
    if kind == "rover" and way.heading is None:
        return None
    if len(stands) <= n:
        return stands
    begins = distance(kind, way.position[n:], way.position[:-n]) < STUCK_M
    begins &= to_go[n:] & to_go[:-n]
    if kind == "rover" and way.heading is not None:
        begins &= np.abs(way.heading[n:] - way.heading[:-n]) <= STUCK_RAD
    for k in np.flatnonzero(begins):
        stands[k : k + n + 1] = True
    return stands


def _heading(quaternion: Floats) -> Floats | None:
    """Return the heading as it goes on, without jumps; None where the attitude is not known."""
    w, x, y, z = quaternion.T
    heading = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return None if np.isnan(heading).any() else np.unwrap(heading)


def _is_command(name: str) -> bool:
    return name.endswith("_command_rad_s") and name.startswith(("rotor", "left_", "right_"))
