"""Where a robot should be on its path, and how fast, at any time. ENU, metres, seconds."""

from collections.abc import Sequence
from itertools import pairwise
from math import cos, dist, fmod, pi, sin
from typing import NamedTuple

from ..transport.frames import Triple
from ..vehicles.build import parameter_values
from .schema import Circle, Goto, Hold, Path, Point, Rectangle, RobotSpec, Team, Waypoints

STILL: Triple = (0.0, 0.0, 0.0)


class Reference(NamedTuple):
    """A point that moves along a path."""

    position: Triple  # m
    velocity: Triple  # m/s


def path_duration(path: Path) -> float | None:
    """Return how long the path takes at its own speed; None where it has none (hold, goto)."""
    match path:
        case Circle():
            return path.laps * 2 * pi * path.radius / path.speed
        case Rectangle():
            return path.laps * 2 * (path.width + path.height) / path.speed
        case Waypoints():
            corners = [(p.east, p.north, p.up or 0.0) for p in path.points]
            return sum(dist(a, b) for a, b in pairwise(corners)) / path.speed
        case Hold() | Goto():
            return None


def reference(path: Path, spec: RobotSpec, team: Team, t: float) -> Reference:
    """Return the reference `t` seconds after all robots were ready.

    Before 0 and after the end it stands at the first or last point. At a sharp corner the velocity
    jumps to that of the leg ahead. Rovers stay at up = 0; a quadcopter's point that names no
    height is at the team's `takeoff_up`.
    """

    def place(point: Point) -> Triple:
        return _place(point, spec, team)

    match path:
        case Hold():
            return Reference(place(path.at or spec.start), STILL)
        case Goto():
            return Reference(place(path.target), STILL)
        case Circle():
            moving, travelled = _progress(path, t)
            return _on_circle(path, place(path.centre), moving, travelled)
        case Rectangle():
            moving, travelled = _progress(path, t)
            return _on_legs(_corners(path, place(path.corner)), path.speed, moving, travelled)
        case Waypoints():
            moving, travelled = _progress(path, t)
            return _on_legs([place(p) for p in path.points], path.speed, moving, travelled)


def takeoff_up(spec: RobotSpec, team: Team) -> float:
    """Return the height of the path's first point: 0 for rovers."""
    return reference(spec.path, spec, team, -1.0).position[2]


def extremes(path: Path, spec: RobotSpec, team: Team) -> list[Triple]:
    """Return places of the path (of the full circle) between which all of it lies."""
    match path:
        case Hold():
            points = [path.at or spec.start]
        case Goto():
            points = [path.target]
        case Waypoints():
            points = list(path.points)
        case Rectangle():
            return _corners(path, _place(path.corner, spec, team))
        case Circle():
            (east, north, up), r = _place(path.centre, spec, team), path.radius
            return [(east + x, north + y, up) for x, y in ((r, 0), (-r, 0), (0, r), (0, -r))]
    return [_place(point, spec, team) for point in points]


def v_max(spec: RobotSpec) -> float:
    """Return the speed (m/s) at which a robot of our own stops going faster.

    For an external one, the one that a vehicle of ours of the same kind has.
    """
    autopilot = spec.autopilot if not spec.external else "ardupilot"
    return parameter_values(spec.kind, spec.profile, spec.params, autopilot)["v_max"]


def top_speed(spec: RobotSpec) -> float:
    """Return the speed (m/s) with which coordination may count."""
    return v_max(spec) if spec.max_speed is None else spec.max_speed


def end_point(spec: RobotSpec, team: Team) -> Triple:
    """Return where the path ends."""
    return reference(spec.path, spec, team, (path_duration(spec.path) or 0.0) + 1.0).position


def _place(point: Point, spec: RobotSpec, team: Team) -> Triple:
    default_up = team.takeoff_up if spec.kind == "quadcopter" else 0.0
    return (point.east, point.north, default_up if point.up is None else point.up)


def _progress(path: Circle | Rectangle | Waypoints, t: float) -> tuple[bool, float]:
    """Return whether the reference moves at `t`, and how many metres it has gone."""
    end = path_duration(path) or 0.0
    return 0 <= t < end, path.speed * min(max(t, 0.0), end)


def _on_circle(path: Circle, centre: Triple, moving: bool, travelled: float) -> Reference:
    turn = -1.0 if path.clockwise else 1.0
    angle = path.start_angle + turn * travelled / path.radius
    east, north, up = centre
    position = (east + path.radius * cos(angle), north + path.radius * sin(angle), up)
    speed = turn * path.speed if moving else 0.0
    return Reference(position, (-speed * sin(angle), speed * cos(angle), 0.0))


def _corners(path: Rectangle, corner: Triple) -> list[Triple]:
    """Return one lap from the south-west corner and back to it."""
    east, north, up = corner
    south_east = (east + path.width, north, up)
    north_west = (east, north + path.height, up)
    north_east = (east + path.width, north + path.height, up)
    lap = [corner, south_east, north_east, north_west, corner]
    return lap[::-1] if path.clockwise else lap


def _on_legs(points: Sequence[Triple], speed: float, moving: bool, travelled: float) -> Reference:
    """Return the place `travelled` metres along the legs; beyond their end, the next lap begins."""
    legs = [(a, b, dist(a, b)) for a, b in pairwise(points)]
    lap = sum(length for _, _, length in legs)
    if lap == 0:
        return Reference(points[0], STILL)
    closed = points[0] == points[-1]
    left = fmod(travelled, lap) if closed else travelled
    for a, b, length in legs:
        if left < length:
            share = left / length
            position = tuple(p + (q - p) * share for p, q in zip(a, b, strict=True))
            velocity = tuple((q - p) / length * speed for p, q in zip(a, b, strict=True))
            return Reference(_triple(position), _triple(velocity) if moving else STILL)
        left -= length
    return Reference(points[-1], STILL)


def _triple(v: Sequence[float]) -> Triple:
    return (v[0], v[1], v[2])
