"""What no single key can tell: parameters a robot can fly with, speeds, and room for everybody."""

from collections.abc import Sequence
from itertools import combinations
from math import hypot, inf

from ..transport.frames import Triple
from ..vehicles.build import accepted_names, make_robot
from ..vehicles.config import VehicleConfig
from .errors import did_you_mean
from .paths import end_point, top_speed, v_max
from .reader import Fields
from .robots import PATHS
from .schema import Circle, Goto, Hold, Rectangle, RobotSpec, Team, Waypoints
from .starts import contact_distance

CLEAR_UP = {1: 1.0, 2: 0.6}  # m of height between posts, by the number of quadcopters of a pair
"""Two quadcopters keep the distance at which coordination still counts them as one level; one is
clear of a rover, 0.9 m tall, when its own 0.1 m do not reach down to it."""

SAFE_ROOM = {0: 1.5, 1: 0.0, 2: 1.2}
"""m between places where two robots come to stand under law `safe`, by the number of quadcopters:
nearer, its pushes keep one of them more than 0.2 m short of its place (docstring of the law)."""

LANDING_ROOM = 1.0  # m from a landing quadcopter to a rover that stands there for good

Read = tuple[RobotSpec, Fields]


def check_robots(read: list[Read], team: Team) -> None:
    """Refuse robots that cannot do what is asked of them, each alone or beside the others."""
    built: set[tuple[object, ...]] = set()
    for spec, fields in read:
        key = (spec.kind, spec.autopilot, spec.profile, *sorted(spec.params.items()))
        if key not in built:
            _check_params(spec, fields)
            built.add(key)
        _check_speed(spec, fields)
    ends = [end_point(spec, team) for spec, _ in read]
    for i, j in combinations(range(len(read)), 2):
        _check_pair(read[i][0], ends[i], read[j], ends[j], team)


def _check_params(spec: RobotSpec, fields: Fields) -> None:
    """Refuse unknown parameters, and values with which the robot cannot be built."""
    if not spec.params:
        return
    params = fields.mapping("params", None)
    known = accepted_names(spec.kind, spec.profile, spec.autopilot)
    for name in spec.params:
        if name not in known:
            raise params.error(
                name, f"unknown parameter of a {spec.kind}", did_you_mean(name, known)
            )
    if problem := _why_not(spec, spec.params):
        for name, value in spec.params.items():
            if alone := _why_not(spec, {name: value}):
                raise params.error(name, alone.removeprefix(name).lstrip(": "))
        raise fields.error("params", problem)


def _why_not(spec: RobotSpec, params: dict[str, float]) -> str:
    """Return why no robot has these parameters, or nothing."""
    config = VehicleConfig(
        kind=spec.kind,
        system_id=1,
        autopilot=spec.autopilot,
        profile=spec.profile,
        params=params,
    )
    try:
        make_robot(config)
    except (ValueError, ArithmeticError) as error:
        return str(error)
    return ""


def _check_speed(spec: RobotSpec, fields: Fields) -> None:
    """Refuse a path faster than the robot, and a limit that is none."""
    able = v_max(spec)
    if spec.max_speed is not None and not spec.external and spec.max_speed > able:
        raise fields.error(
            "max_speed",
            f"{spec.max_speed:g} m/s is more than this {spec.kind} can do",
            f"its v_max is {able:g}",
        )
    fastest = top_speed(spec)
    if isinstance(spec.path, Circle | Rectangle | Waypoints) and spec.path.speed > fastest:
        whose = "max_speed" if spec.max_speed is not None else "v_max"
        raise fields.mapping(type(spec.path).__name__.lower(), None).error(
            "speed",
            f"{spec.path.speed:g} m/s is more than this {spec.kind} can do",
            f"its {whose} is {fastest:g}",
        )


def _check_pair(one: RobotSpec, end: Triple, read: Read, other_end: Triple, team: Team) -> None:
    """Refuse two robots that cannot both be where they start, arrive or come to rest."""
    other, fields = read
    contact = contact_distance(one, other)
    quads = (one.kind, other.kind).count("quadcopter")
    apart = max(contact, SAFE_ROOM[quads]) if team.law == "safe" else contact
    who = f"{one.name!r} and {other.name!r}"

    def touch(a: Sequence[float], b: Sequence[float], room: float = contact) -> bool:
        return hypot(a[0] - b[0], a[1] - b[1]) < room

    if touch(_start(one), _start(other)):
        raise fields.error(
            "start",
            f"{who} start inside one another",
            f"bodies touch at {contact:g} m between centres; move one of them",
        )
    path = next((key for key in PATHS if key in fields), "start")
    level = abs(end[2] - other_end[2]) < CLEAR_UP.get(quads, inf)
    posts = isinstance(one.path, Hold | Goto) and isinstance(other.path, Hold | Goto)
    if posts and level and touch(end, other_end, apart):
        raise fields.error(
            path,
            f"{who} are sent too near one another",
            f"bodies touch at {contact:g} m between centres, law {team.law} needs {apart:g} m;"
            " move one target",
        )
    rest, other_rest = _rest(one, end), _rest(other, other_end)
    room = LANDING_ROOM if quads == 1 else apart
    if rest and other_rest and touch(rest, other_rest, room):
        raise fields.error(
            path,
            f"{who} have no room to come to rest beside one another",
            f"keep {room:g} m between the ends of their paths, or let a quadcopter fly back with"
            " `then: return`",
        )


def _start(spec: RobotSpec) -> tuple[float, float]:
    return (spec.start.east, spec.start.north)


def _rest(spec: RobotSpec, end: Triple) -> tuple[float, float] | None:
    """Return where the robot is on the ground at last; None for one that stays in the air."""
    if spec.then == "return":
        return _start(spec)
    return None if spec.then == "stay" and spec.kind == "quadcopter" else end[:2]
