"""Where a robot should be on its path, and how fast, at any time. ENU, metres, seconds."""

from collections.abc import Sequence
from itertools import pairwise
from math import cos, dist, fmod, pi, sin
from typing import NamedTuple

from ..transport.frames import Triple
from .schema import Circle, Goto, Hold, Path, Point, Rectangle, RobotSpec, Team, Waypoints

STILL: Triple = (0.0, 0.0, 0.0)

_Leg = tuple[Triple, Triple, float, Triple]
"""From where to where, how long (m), and the velocity on it."""


class Reference(NamedTuple):
    """A point that moves along a path."""

    position: Triple  # m
    velocity: Triple  # m/s


class Route:
    """The path of one robot with all its places found.

    At a sharp corner the velocity jumps to that of the leg ahead. Rovers stay at up = 0; a
    quadcopter's point that names no height is at the team's `takeoff_up`. `duration` is None where
    nothing moves.
    """

    def __init__(self, path: Path, spec: RobotSpec, team: Team) -> None:
        self.duration = path_duration(path)
        self._end = self.duration or 0.0
        self._speed = 0.0
        self._circle: Circle | None = None
        match path:
            case Hold():
                points = [place(path.at or spec.start, spec, team)]
            case Goto():
                points = [place(path.target, spec, team)]
            case Circle():
                points = [place(path.centre, spec, team)]
                self._circle, self._speed = path, path.speed
            case Rectangle():
                points, self._speed = corners(path, place(path.corner, spec, team)), path.speed
            case Waypoints():
                points = [place(point, spec, team) for point in path.points]
                self._speed = path.speed
        self._last = Reference(points[-1], STILL)
        self._centre = points[0]
        self._is_closed = points[0] == points[-1]
        self._lap = length(points)
        self._legs = [_leg(a, b, self._speed) for a, b in pairwise(points)]

    def at(self, t: float) -> Reference:
        """Return the reference `t` seconds after all robots were ready.

        Before 0 and after the end it stands at the first or last point.
        """
        if self.duration is None:
            return self._last
        moving, travelled = 0 <= t < self._end, self._speed * min(max(t, 0.0), self._end)
        if self._circle is not None:
            return _on_circle(self._circle, self._centre, moving, travelled)
        return self._on_legs(moving, travelled)

    def _on_legs(self, moving: bool, travelled: float) -> Reference:
        """Return the place `travelled` metres along the legs; after the last, the next lap."""
        if self._lap == 0.0:
            return self._last
        left = fmod(travelled, self._lap) if self._is_closed else travelled
        for (x, y, z), (to_x, to_y, to_z), way, velocity in self._legs:
            if left < way:
                share = left / way
                here = (x + (to_x - x) * share, y + (to_y - y) * share, z + (to_z - z) * share)
                return Reference(here, velocity if moving else STILL)
            left -= way
        return self._last


def path_duration(path: Path) -> float | None:
    """Return how long the path takes at its own speed; None where it has none (hold, goto)."""
    match path:
        case Circle():
            return path.laps * 2 * pi * path.radius / path.speed
        case Rectangle():
            return path.laps * 2 * (path.width + path.height) / path.speed
        case Waypoints():
            return length([(p.east, p.north, p.up or 0.0) for p in path.points]) / path.speed
        case Hold() | Goto():
            return None


def place(point: Point, spec: RobotSpec, team: Team) -> Triple:
    """Return where a point of the robot's path is."""
    default_up = team.takeoff_up if spec.kind == "quadcopter" else 0.0
    return (point.east, point.north, default_up if point.up is None else point.up)


def corners(path: Rectangle, corner: Triple) -> list[Triple]:
    """Return one lap from the south-west corner and back to it."""
    east, north, up = corner
    south_east = (east + path.width, north, up)
    north_west = (east, north + path.height, up)
    north_east = (east + path.width, north + path.height, up)
    lap = [corner, south_east, north_east, north_west, corner]
    return lap[::-1] if path.clockwise else lap


def length(points: Sequence[Triple]) -> float:
    """Return how long the way through `points` is.

    Not by sum(), which rounds differently from one version of Python to another.
    """
    way = 0.0
    for a, b in pairwise(points):
        way += dist(a, b)
    return way


def _leg(a: Triple, b: Triple, speed: float) -> _Leg:
    way = dist(a, b)
    if way == 0.0:
        return a, b, way, STILL
    x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    return a, b, way, (x / way * speed, y / way * speed, z / way * speed)


def _on_circle(path: Circle, centre: Triple, moving: bool, travelled: float) -> Reference:
    turn = -1.0 if path.clockwise else 1.0
    angle = path.start_angle + turn * travelled / path.radius
    east, north, up = centre
    across, along = cos(angle), sin(angle)
    position = (east + path.radius * across, north + path.radius * along, up)
    speed = turn * path.speed if moving else 0.0
    return Reference(position, (-speed * along, speed * across, 0.0))
