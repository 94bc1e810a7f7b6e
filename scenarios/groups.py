"""Robots without a name get one, and groups become robots: what happens before they are read."""

from copy import deepcopy
from math import ceil, sqrt

from ..vehicles.config import MAX_SYSTEM_ID
from .errors import ScenarioError, show
from .reader import FAR, Fields
from .robots import KEYS, PATHS
from .source import Node

SPLIT_IT = (
    "a MAVLink network has 255 system ids, and ground stations need some: make it several"
    " networks, each a scenario and a `mavherd run` of its own, with its own"
    " --gcs-udp, --api-udp and --tcp"
)
_PREFIX = {"quadcopter": "quad", "rover": "rover"}


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
                SPLIT_IT,
            )
    if robots and isinstance(root.value, dict):
        root.value["robots"].value = [node for _, node in robots]
    return [path for path, _ in robots]


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
    fields = Fields(entry, path, (*KEYS, *PATHS, "count", "spacing"))
    asked = fields.raw("count")
    if isinstance(asked, int) and asked > MAX_SYSTEM_ID:
        raise fields.error("count", f"{show(asked)} is more than {MAX_SYSTEM_ID} robots", SPLIT_IT)
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
