"""The `robots:` list of a scenario: each robot with its path, flight stack and system id."""

import re
from collections.abc import Callable
from dataclasses import replace
from math import radians

from ..vehicles.config import DISTURBANCE_FORMS, KINDS, MAX_SYSTEM_ID, PROFILES, Disturbance
from .errors import show
from .external import read_autopilot, read_connect
from .reader import LONG, Fields
from .schema import Circle, Goto, Hold, Path, Point, Rectangle, RobotSpec, Waypoints

KEYS = (  # beside the paths
    *("name", "kind", "system_id", "start", "dwell_s", "then", "profile", "params", "disturbance"),
    *("connect", "autopilot", "max_speed"),
)
MIN_UP = 0.3  # m, a quadcopter flies no lower
NAME = re.compile(r"[A-Za-z0-9_-]{1,16}", re.ASCII)
THEN = ("land", "return", "stay")

_POINT = ("east", "north", "up")


def read_robots(root: Fields, paths: list[str], autopilot: str) -> list[tuple[RobotSpec, Fields]]:
    """Return each robot with the mapping it was read from; `paths` says where that is.

    `autopilot` is that of our own robots which do not name one.
    """
    entries = root.items("robots")
    if not entries:
        raise root.error("robots", "is empty", "a scenario needs at least one robot")
    read = []
    for i, (path, node) in enumerate(entries):
        fields = Fields(node, paths[i] if i < len(paths) else path, (*KEYS, *PATHS))
        read.append((_read_robot(fields, autopilot), fields))
    return _with_system_ids(read)


def read_disturbance(fields: Fields, key: str = "disturbance") -> Disturbance:
    """Return the disturbance: a mapping or just its form, as in `disturbance: held`."""
    if isinstance(fields.raw(key), str):
        return Disturbance(form=fields.choice(key, DISTURBANCE_FORMS))
    inner = fields.mapping(key, ("form", "amplitude", "hold_s"))
    default = Disturbance()
    return Disturbance(
        form=inner.choice("form", DISTURBANCE_FORMS, default.form),
        amplitude=inner.number("amplitude", default.amplitude, low=0.0, high=1000.0),
        hold_s=inner.positive("hold_s", default.hold_s, high=3600.0),
    )


def _read_robot(fields: Fields, autopilot: str) -> RobotSpec:
    kind = fields.choice("kind", KINDS)
    name = fields.text("name")
    if not NAME.fullmatch(name):
        raise fields.error(
            "name", f"{show(name)} is no name", "1 to 16 of the letters a-z A-Z 0-9 - _"
        )
    start = fields.mapping("start", ("east", "north", "heading_deg"), required=True)
    spec = RobotSpec(
        name=name,
        kind=kind,
        system_id=0,
        start=Point(start.number("east"), start.number("north")),
        heading=radians(start.number("heading_deg", 0.0, low=-360.0, high=360.0)),
        dwell_s=fields.number("dwell_s", 0.0, low=0.0, high=LONG),
        then=_then(fields, kind),
        profile=fields.choice("profile", PROFILES, "default"),
        params=_numbers(fields.mapping("params", None)),
        disturbance=read_disturbance(fields) if fields.raw("disturbance") is not None else None,
        autopilot=read_autopilot(fields, autopilot),
        connect=read_connect(fields),
        max_speed=_max_speed(fields),
    )
    return replace(spec, path=_read_path(fields, spec))


def _max_speed(fields: Fields) -> float | None:
    return None if fields.raw("max_speed") is None else fields.positive("max_speed", high=100.0)


def _then(fields: Fields, kind: str) -> str:
    then = fields.choice("then", THEN, "land")
    if kind == "rover" and then == "return":
        raise fields.error(
            "then", "a rover stays where its path ends", "`waypoints` can lead it back"
        )
    return then


def _numbers(fields: Fields) -> dict[str, float]:
    return {key: fields.number(key, low=-1e9, high=1e9) for key in fields}


def _read_path(fields: Fields, spec: RobotSpec) -> Path:
    written = [key for key in PATHS if key in fields]
    if len(written) > 1:
        raise fields.error(
            written[1], f"a second path beside {written[0]!r}", "keep one of them for each robot"
        )
    return PATHS[written[0]](fields, spec) if written else Hold(at=spec.start)


def _hold(fields: Fields, spec: RobotSpec) -> Path:
    at = fields.mapping("hold", _POINT)
    east, north = at.number("east", spec.start.east), at.number("north", spec.start.north)
    return Hold(at=Point(east, north, _up(at, spec)))


def _goto(fields: Fields, spec: RobotSpec) -> Path:
    return Goto(target=_point(fields.mapping("goto", _POINT, required=True), spec))


def _circle(fields: Fields, spec: RobotSpec) -> Path:
    keys = ("centre", "radius", "speed", "clockwise", "start_angle_deg", "laps")
    circle = fields.mapping("circle", keys, required=True)
    return Circle(
        centre=_point(circle.mapping("centre", _POINT, required=True), spec),
        radius=circle.positive("radius"),
        speed=circle.positive("speed", 0.5),
        clockwise=circle.flag("clockwise", default=False),
        start_angle=radians(circle.number("start_angle_deg", 0.0, low=-360.0, high=360.0)),
        laps=circle.positive("laps", 1.0),
    )


def _rectangle(fields: Fields, spec: RobotSpec) -> Path:
    keys = ("corner", "width", "height", "speed", "clockwise", "laps")
    rectangle = fields.mapping("rectangle", keys, required=True)
    return Rectangle(
        corner=_point(rectangle.mapping("corner", _POINT, required=True), spec),
        width=rectangle.positive("width"),
        height=rectangle.positive("height"),
        speed=rectangle.positive("speed", 0.5),
        clockwise=rectangle.flag("clockwise", default=False),
        laps=rectangle.positive("laps", 1.0),
    )


def _waypoints(fields: Fields, spec: RobotSpec) -> Path:
    waypoints = fields.mapping("waypoints", ("points", "speed"), required=True)
    listed = waypoints.items("points")
    points = tuple(_point(Fields(node, path, _POINT), spec) for path, node in listed)
    if len(set(points)) < 2:
        raise waypoints.error("points", "needs two different points", "`goto` takes one")
    if len({point.up is None for point in points}) > 1:
        raise waypoints.error("points", "some name a height, some do not", "give `up` to all")
    return Waypoints(points=points, speed=waypoints.positive("speed", 0.5))


PATHS: dict[str, Callable[[Fields, RobotSpec], Path]] = {
    "hold": _hold,
    "goto": _goto,
    "circle": _circle,
    "rectangle": _rectangle,
    "waypoints": _waypoints,
}


def _point(fields: Fields, spec: RobotSpec) -> Point:
    return Point(fields.number("east"), fields.number("north"), _up(fields, spec))


def _up(fields: Fields, spec: RobotSpec) -> float | None:
    if fields.raw("up") is None:
        return None
    if spec.kind == "rover":
        raise fields.error("up", "a rover has no height", "remove it")
    return fields.number("up", low=MIN_UP)


def _with_system_ids(read: list[tuple[RobotSpec, Fields]]) -> list[tuple[RobotSpec, Fields]]:
    """Fill in the system ids that are not given, in order of listing, and refuse doubles."""
    names: dict[str, str] = {}
    given: dict[int, str] = {}
    for spec, fields in read:
        if spec.name in names:
            raise fields.error(
                "name", f"two robots named {spec.name!r}", "names must differ, also in groups"
            )
        names[spec.name] = fields.path
        if fields.raw("system_id") is None:
            continue
        number = fields.integer("system_id", low=1, high=MAX_SYSTEM_ID)
        if number in given:
            raise fields.error(
                "system_id",
                f"{number} is already that of {given[number]!r}",
                "every vehicle needs its own; leave the key out to have one given",
            )
        given[number] = spec.name
    free = iter(n for n in range(1, MAX_SYSTEM_ID + 1) if n not in given)
    own = {name: number for number, name in given.items()}
    return [
        (replace(spec, system_id=own[spec.name] if spec.name in own else next(free)), fields)
        for spec, fields in read
    ]
