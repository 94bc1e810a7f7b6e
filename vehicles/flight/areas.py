"""The areas of the fence list, in metres, and whether a point is where a vehicle may be."""

from math import hypot, inf
from typing import NamedTuple

from ...transport.frames import Origin
from ..missions.shapes import fence_shapes
from ..missions.store import ItemList

Point = tuple[float, float]  # m north and east of the fleet origin


class _Circle(NamedTuple):
    centre: Point
    radius: float

    def contains(self, point: Point) -> bool:
        """Return whether the point is in the circle."""
        return hypot(point[0] - self.centre[0], point[1] - self.centre[1]) <= self.radius


class _Polygon(NamedTuple):
    corners: tuple[Point, ...]

    def contains(self, point: Point) -> bool:
        """Return whether the point is in the polygon: a ray to the east crosses it oddly often."""
        north, east = point
        inside = False
        (a_north, a_east) = self.corners[-1]
        for b_north, b_east in self.corners:
            if (a_north > north) != (b_north > north):
                share = (north - a_north) / (b_north - a_north)
                inside ^= east < a_east + share * (b_east - a_east)
            a_north, a_east = b_north, b_east
        return inside


class Areas:
    """Where the vehicle may be (inclusions) and may not be (exclusions). Falsy when empty."""

    def __init__(self) -> None:
        self.narrowest = inf  # m, radius of the smallest inclusion circle
        self._revision = -1
        self._inclusions: list[_Circle | _Polygon] = []
        self._exclusions: list[_Circle | _Polygon] = []

    def __bool__(self) -> bool:
        return bool(self._inclusions or self._exclusions)

    def follow(self, fence: ItemList, origin: Origin) -> None:
        """Take up the list if it is another one than last time."""
        if fence.revision == self._revision:
            return
        self._revision = fence.revision
        self._inclusions, self._exclusions = [], []
        shapes = fence_shapes(fence.items)
        for polygon in shapes.polygons:
            corners = tuple(origin.from_geodetic(*corner) for corner in polygon.corners)
            self._side(polygon.inclusion).append(_Polygon(corners))
        for circle in shapes.circles:
            centre = origin.from_geodetic(circle.lat_deg, circle.lon_deg)
            self._side(circle.inclusion).append(_Circle(centre, circle.radius))
        radii = (circle.radius for circle in shapes.circles if circle.inclusion)
        self.narrowest = min(radii, default=inf)

    def allow(self, point: Point, *, any_inclusion: bool) -> bool:
        """Return whether a point is in all inclusions (or in any one) and in no exclusion."""
        if any(area.contains(point) for area in self._exclusions):
            return False
        if not self._inclusions:
            return True
        insides = (area.contains(point) for area in self._inclusions)
        return any(insides) if any_inclusion else all(insides)

    def _side(self, inclusion: bool) -> list[_Circle | _Polygon]:
        return self._inclusions if inclusion else self._exclusions
