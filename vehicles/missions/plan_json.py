"""QGroundControl's `.plan` (JSON): mission, fence, rally points and home (its "File Formats")."""

import json
from collections.abc import Iterator
from math import isfinite
from typing import Any

from ...transport.mavlink import mav
from .items import ABOVE_HOME, Item, plain_frame
from .plan import MissionError, Place, Plan
from .supported import is_located

_JUMP: int = mav.MAV_CMD_DO_JUMP
_RETURN: int = mav.MAV_CMD_NAV_FENCE_RETURN_POINT
_RALLY: int = mav.MAV_CMD_NAV_RALLY_POINT
_POLYGON = (
    mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
    mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
)
_CIRCLE = (
    mav.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION,
    mav.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION,
)
_NAN = float("nan")
_MAX = 3e38  # what a float on the wire holds
_INT32 = 2**31 - 1


class _Node:
    """A value in the file that knows where it is, for errors that say so."""

    def __init__(self, value: Any, where: str) -> None:
        self.value = value
        self.where = where

    def fail(self, problem: str, hint: str = "") -> MissionError:
        return MissionError(self.where, problem, hint)

    def get(self, key: str) -> "_Node":
        """Return a member that must be there."""
        if not isinstance(self.value, dict) or key not in self.value:
            raise self.fail(f"has no {key!r}", "save it again with QGroundControl")
        return _Node(self.value[key], f"{self.where}.{key}")

    def find(self, key: str) -> "_Node | None":
        """Return a member, None where it is missing or null."""
        there = isinstance(self.value, dict) and self.value.get(key) is not None
        return self.get(key) if there else None

    def items(self) -> "Iterator[_Node]":
        """Yield the members of a list."""
        if not isinstance(self.value, list):
            raise self.fail("is not a list")
        for i, value in enumerate(self.value):
            yield _Node(value, f"{self.where}[{i}]")

    def list_of(self, key: str) -> "Iterator[_Node]":
        """Yield the members of a list that may be missing."""
        node = self.find(key)
        return node.items() if node else iter(())

    def number(self, low: float = -_MAX, high: float = _MAX) -> float:
        """Return a number within limits."""
        value = self.value
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.fail(f"{value!r} is not a number")
        if not low <= value <= high:
            raise self.fail(f"{value!r} is out of range", f"{low:g} to {high:g}")
        return float(value)

    def whole(self, high: int) -> int:
        """Return a whole number from 0 to `high`."""
        value = self.number(0, high)
        if value != int(value):
            raise self.fail(f"{self.value!r} is not a whole number")
        return int(value)


def parse_plan(text: str, where: str) -> Plan:
    """Return the plan in `text`; `where` names the file in errors."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise MissionError(where, f"is not JSON: {error}") from None
    root = _Node(data, where)
    if not isinstance(data, dict) or data.get("fileType") != "Plan":
        raise root.fail("is no plan", 'expected "fileType": "Plan" at the top')
    mission = root.get("mission")
    at = mission.find("plannedHomePosition")
    return Plan(_mission(mission), _fence(root), _rally(root), _place(at) if at else None)


def _mission(mission: _Node) -> tuple[Item, ...]:
    """Return the items, numbered from 1; jumps point to `doJumpId`s, which become numbers."""
    items: list[Item] = []
    numbers: dict[int, int] = {}
    jumps: list[tuple[int, _Node]] = []
    for node in _simple_items(mission.get("items")):
        items.append(_item(node))
        if jump_id := node.find("doJumpId"):
            numbers[jump_id.whole(65535)] = len(items)
        if items[-1].command == _JUMP:
            jumps.append((len(items) - 1, node))
    for at, node in jumps:
        target = int(items[at].param1) if isfinite(items[at].param1) else -1
        if target not in numbers:
            raise node.fail(f"jumps to item {target}, which is not there")
        items[at] = items[at]._replace(param1=float(numbers[target]))
    return tuple(items)


def _simple_items(nodes: _Node) -> Iterator[_Node]:
    """Yield the simple items, those that surveys are made of among them."""
    for node in nodes.items():
        match node.get("type").value:
            case "SimpleItem":
                yield node
            case "ComplexItem":
                transect = node.find("TransectStyleComplexItem")
                parts = transect.find("Items") if transect else None
                if parts is None:
                    name = node.value.get("complexItemType", "complex item")
                    hint = "only surveys and corridor scans hold their items; export as waypoints"
                    raise node.fail(f"a {name} cannot be read from the file", hint)
                yield from _simple_items(parts)
            case other:
                raise node.fail(f"unknown type {other!r}")


def _item(node: _Node) -> Item:
    command = node.get("command").whole(65535)
    params = list(node.get("params").items())
    if len(params) != 7:
        raise node.get("params").fail(f"has {len(params)} numbers, expected 7")
    p1, p2, p3, p4 = (_NAN if p.value is None else p.number() for p in params[:4])
    scale = 1e7 if is_located(command) else 1.0
    limit = _INT32 / scale
    x, y = (0.0 if p.value is None else p.number(-limit, limit) for p in params[4:6])
    z = 0.0 if params[6].value is None else params[6].number()
    frame_node, auto_node = node.find("frame"), node.find("autoContinue")
    frame = plain_frame(frame_node.whole(255)) if frame_node else ABOVE_HOME
    auto = int(auto_node is None or auto_node.value is not False)
    return Item(command, frame, p1, p2, p3, p4, round(x * scale), round(y * scale), z, auto)


def _fence(root: _Node) -> tuple[Item, ...]:
    fence = root.find("geoFence")
    if fence is None:
        return ()
    items: list[Item] = []
    for polygon in fence.list_of("polygons"):
        corners = [_place(corner) for corner in polygon.get("polygon").items()]
        if len(corners) < 3:
            raise polygon.fail("a polygon needs three corners")
        command = _POLYGON[polygon.get("inclusion").value is True]
        items += (_placed(command, corner, param1=float(len(corners))) for corner in corners)
    for node in fence.list_of("circles"):
        circle = node.get("circle")
        radius = circle.get("radius").number(0.01, 1e7)
        command = _CIRCLE[node.get("inclusion").value is True]
        items.append(_placed(command, _place(circle.get("center")), param1=radius))
    if point := fence.find("breachReturn"):
        items.append(_placed(_RETURN, _place(point)))
    return tuple(items)


def _rally(root: _Node) -> tuple[Item, ...]:
    rally = root.find("rallyPoints")
    points = rally.list_of("points") if rally else iter(())
    return tuple(_placed(_RALLY, _place(point)) for point in points)


def _placed(command: int, place: Place, param1: float = 0.0) -> Item:
    x, y = round(place.lat_deg * 1e7), round(place.lon_deg * 1e7)
    return Item(command, ABOVE_HOME, param1=param1, x=x, y=y, z=place.alt_m)


def _place(node: _Node) -> Place:
    """Return [latitude, longitude] or [latitude, longitude, altitude]."""
    numbers = list(node.items())
    if len(numbers) not in (2, 3):
        raise node.fail("is not [latitude, longitude, altitude]")
    height = numbers[2] if len(numbers) > 2 else None
    altitude = height.number(-1e5, 1e5) if height and height.value is not None else 0.0
    return Place(numbers[0].number(-90, 90), numbers[1].number(-180, 180), altitude)
