"""The `robots:` list of a scenario: groups, names, paths, and one RobotSpec for each robot."""

import re
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from math import ceil, radians, sqrt

from ..vehicles.config import DISTURBANCE_FORMS, KINDS, MAX_SYSTEM_ID, PROFILES, Disturbance
from .errors import ScenarioError, show
from .reader import FAR, LONG, Fields
from .schema import Circle, Goto, Hold, Path, Point, Rectangle, RobotSpec, Waypoints
from .source import Node

MIN_UP = 0.3  # m, a quadcopter flies no lower
NAME = re.compile(r"[A-Za-z0-9_-]{1,16}", re.ASCII)
THEN = ("land", "return", "stay")

_POINT = ("east", "north", "up")
_PREFIX = {"quadcopter": "quad", "rover": "rover"}
_OWN = ("name", "kind", "system_id", "start", "dwell_s", "then", "profile", "params", "disturbance")


def name_robots(root: Node) -> None:
    """Give robots without a name one by kind: quad1, quad2, ..., rover1, ...; in place.

    A group without a name gets the bare `quad` or `rover`, to which its robots add their number.
    """
    entries = _entries(root)
    used = set()
    for entry in entries:
        name, count = _plain(entry, "name"), _plain(entry, "count")
        if name is None and count is not None:
            name = _give_name(entry, "")
        members = range(1, min(count, MAX_SYSTEM_ID) + 1) if isinstance(count, int) else [""]
        used |= {f"{name}{i}" for i in members}
    for entry in entries:
        if _plain(entry, "name") is None:
            free = (i for i in range(1, 10**6) if f"{_prefix(entry)}{i}" not in used)
            used.add(_give_name(entry, str(next(free))))


def expand_groups(root: Node) -> list[str]:
    """Replace every entry that has a `count` by its robots, in place; return the robots' paths."""
    robots: list[tuple[str, Node]] = []
    for i, entry in enumerate(_entries(root)):
        path = f"robots[{i}]"
        grouped = isinstance(entry.value, dict) and {"count", "spacing"} & entry.value.keys()
        members = _members(entry, path) if grouped else [entry]
        robots += [(path, member) for member in members]
        if len(robots) > MAX_SYSTEM_ID:
            raise ScenarioError(
                entry.where,
                f"{path}: more than {MAX_SYSTEM_ID} robots",
                "MAVLink has 255 system ids, and ground stations need some; use fewer robots",
            )
    if robots and isinstance(root.value, dict):
        root.value["robots"].value = [node for _, node in robots]
    return [path for path, _ in robots]


def read_robots(root: Fields, paths: list[str]) -> list[tuple[RobotSpec, Fields]]:
    """Return each robot with the mapping it was read from; `paths` says where that is."""
    entries = root.items("robots")
    if not entries:
        raise root.error("robots", "is empty", "a scenario needs at least one robot")
    read = []
    for i, (path, node) in enumerate(entries):
        fields = Fields(node, paths[i] if i < len(paths) else path, (*_OWN, *PATHS))
        read.append((_read_robot(fields), fields))
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


def _entries(root: Node) -> list[Node]:
    robots = root.value.get("robots") if isinstance(root.value, dict) else None
    return robots.value if robots is not None and isinstance(robots.value, list) else []


def _plain(entry: Node, key: str) -> object:
    item = entry.value.get(key) if isinstance(entry.value, dict) else None
    return item.value if item else None


def _prefix(entry: Node) -> str:
    return _PREFIX.get(str(_plain(entry, "kind")), "")


def _give_name(entry: Node, suffix: str) -> str:
    """Name an entry by its kind, unless that is no kind: then reading it will say so."""
    name = _prefix(entry) + suffix
    if _prefix(entry) and isinstance(entry.value, dict):
        entry.value["name"] = Node(name, entry.where)
    return name


def _members(entry: Node, path: str) -> list[Node]:
    """Return the robots of a group: name1, name2, ... with start and path shifted by `spacing`."""
    fields = Fields(entry, path, (*_OWN, *PATHS, "count", "spacing"))
    count = fields.integer("count", low=1, high=MAX_SYSTEM_ID)
    name = fields.text("name", "")
    numbered = fields.raw("system_id") is not None
    first_id = fields.integer("system_id", 0, low=0, high=MAX_SYSTEM_ID)
    if isinstance(fields.raw("spacing"), dict):
        inner = fields.mapping("spacing", ("east", "north"))
        step = inner.number("east", 0.0), inner.number("north", 0.0)
        shifts = [(i * step[0], i * step[1]) for i in range(count)]
    else:
        pitch = fields.positive("spacing", 2.0)
        columns = ceil(sqrt(count))
        shifts = [(i % columns * pitch, i // columns * pitch) for i in range(count)]
    members = []
    for i, (east, north) in enumerate(shifts):
        member = deepcopy(entry)
        if isinstance(member.value, dict):
            member.value.pop("count", None)
            member.value.pop("spacing", None)
            if name:
                member.value["name"] = Node(f"{name}{i + 1}", entry.where)
            if numbered:
                member.value["system_id"] = Node(first_id + i, entry.where)
            _shift(member.value, east, north)
        members.append(member)
    return members


def _shift(robot: dict[str, Node], east: float, north: float) -> None:
    """Move the start and every point of the path; what is no number is left to be complained of."""
    points = [robot.get("start"), robot.get("goto"), robot.get("hold")]
    for key, inner in (("circle", "centre"), ("rectangle", "corner"), ("waypoints", "points")):
        if (path := robot.get(key)) and isinstance(path.value, dict) and inner in path.value:
            found = path.value[inner]
            points += found.value if isinstance(found.value, list) else [found]
    for point in points:
        if point is None or not isinstance(point.value, dict):
            continue
        for axis, by in (("east", east), ("north", north)):
            number = point.value.get(axis)
            if number is None or isinstance(number.value, bool):
                continue
            if isinstance(number.value, int | float) and abs(number.value) <= FAR:
                number.value += by


def _read_robot(fields: Fields) -> RobotSpec:
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
    )
    return replace(spec, path=_read_path(fields, spec))


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
