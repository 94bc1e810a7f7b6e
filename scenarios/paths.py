"""What follows from a robot's path: its extent, its end, how fast the robot is. ENU, m, s."""

from ..transport.frames import Triple
from ..vehicles.build import parameter_values
from .route import Reference, Route, corners, path_duration, place
from .schema import Circle, Goto, Hold, Path, Rectangle, RobotSpec, Team, Waypoints

__all__ = [
    "Reference",
    "Route",
    "end_point",
    "extremes",
    "path_duration",
    "reference",
    "takeoff_up",
    "top_speed",
    "v_max",
]


def reference(path: Path, spec: RobotSpec, team: Team, t: float) -> Reference:
    """Return the reference `t` seconds after all robots were ready; see `Route`."""
    return Route(path, spec, team).at(t)


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
            return corners(path, place(path.corner, spec, team))
        case Circle():
            (east, north, up), r = place(path.centre, spec, team), path.radius
            return [(east + x, north + y, up) for x, y in ((r, 0), (-r, 0), (0, r), (0, -r))]
    return [place(point, spec, team) for point in points]


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
