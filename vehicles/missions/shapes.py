"""Fence and rally lists turned into shapes on the map."""

from collections.abc import Sequence
from dataclasses import dataclass

from ...transport.mavlink import mav
from .items import Item
from .plan import Place

_RETURN: int = mav.MAV_CMD_NAV_FENCE_RETURN_POINT
_POLYGONS = {
    mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: True,
    mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: False,
}
_CIRCLES = {
    mav.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: True,
    mav.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: False,
}


@dataclass(frozen=True, slots=True)
class FencePolygon:
    """Stay inside, or outside, of these corners (latitude, longitude in degrees)."""

    inclusion: bool
    corners: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class FenceCircle:
    """Stay inside, or outside, of this circle."""

    inclusion: bool
    lat_deg: float
    lon_deg: float
    radius: float  # m


@dataclass(frozen=True, slots=True)
class FenceShapes:
    """All that a fence list says."""

    polygons: tuple[FencePolygon, ...] = ()
    circles: tuple[FenceCircle, ...] = ()
    return_point: Place | None = None


def fence_shapes(items: Sequence[Item]) -> FenceShapes:
    """Return the shapes of a fence list that `check_list` has found whole."""
    polygons: list[FencePolygon] = []
    circles: list[FenceCircle] = []
    return_point = None
    at = 0
    while at < len(items):
        item = items[at]
        count = 1
        if item.command in _POLYGONS:
            count = int(item.param1)
            corners = tuple((i.lat_deg, i.lon_deg) for i in items[at : at + count])
            polygons.append(FencePolygon(_POLYGONS[item.command], corners))
        elif item.command in _CIRCLES:
            circles.append(
                FenceCircle(_CIRCLES[item.command], item.lat_deg, item.lon_deg, item.param1)
            )
        elif item.command == _RETURN:
            return_point = Place(item.lat_deg, item.lon_deg, item.z)
        at += count
    return FenceShapes(tuple(polygons), tuple(circles), return_point)


def rally_points(items: Sequence[Item]) -> tuple[Place, ...]:
    """Return the places of a rally list; altitudes are in each item's own frame."""
    return tuple(Place(item.lat_deg, item.lon_deg, item.z) for item in items)
