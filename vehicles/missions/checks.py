"""Whether an item, and a list of items, can be taken: answered as MAV_MISSION_RESULT."""

from collections.abc import Sequence
from math import isfinite, isinf, isnan

from ...transport.mavlink import mav
from .items import ABOVE_HOME, ABOVE_TERRAIN, AMSL, Item, MissionType
from .supported import Supported, supported

ACCEPTED: int = mav.MAV_MISSION_ACCEPTED
UNSUPPORTED: int = mav.MAV_MISSION_UNSUPPORTED
UNSUPPORTED_FRAME: int = mav.MAV_MISSION_UNSUPPORTED_FRAME
ERROR: int = mav.MAV_MISSION_ERROR
_PARAMS = (
    mav.MAV_MISSION_INVALID_PARAM1,
    mav.MAV_MISSION_INVALID_PARAM2,
    mav.MAV_MISSION_INVALID_PARAM3,
    mav.MAV_MISSION_INVALID_PARAM4,
)
_LATITUDE: int = mav.MAV_MISSION_INVALID_PARAM5_X
_LONGITUDE: int = mav.MAV_MISSION_INVALID_PARAM6_Y
_ALTITUDE: int = mav.MAV_MISSION_INVALID_PARAM7

_FRAMES = (AMSL, mav.MAV_FRAME_MISSION, ABOVE_HOME, ABOVE_TERRAIN)
_POLYGONS = (
    mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
    mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
)
_CIRCLES = (
    mav.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION,
    mav.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION,
)
_HIGHEST_M = 83_000.0  # what ArduPilot's locations hold
_WIDEST_M = 10_000.0  # radius of a circle to fly
_MAX_CORNERS = 255

REASONS: dict[int, str] = {
    UNSUPPORTED: "this vehicle does not fly that command",
    UNSUPPORTED_FRAME: "the frame must be 0 (AMSL), 3 (above home) or 10 (above terrain)",
    **{result: f"param{i + 1} is out of range" for i, result in enumerate(_PARAMS)},
    _LATITUDE: "the latitude (x) is out of range",
    _LONGITUDE: "the longitude (y) is out of range",
    _ALTITUDE: "the altitude (z) is out of range",
}
"""The results of `check` in words."""


def check(item: Item, kind: str, mission_type: int) -> int:
    """Return MAV_MISSION_ACCEPTED, or why this kind of vehicle refuses `item` in this list.

    Infinities are refused everywhere; NaN where the parameter means something and has no
    "as you like". MAVSDK sends NaN in what a command does not use.
    """
    row = supported(item.command, kind, mission_type)
    if row is None:
        return UNSUPPORTED
    for number, value in enumerate(item[2:6], start=1):
        must_be = number in row.used and number not in row.may_be_nan
        if isinf(value) or (must_be and isnan(value)):
            return _PARAMS[number - 1]
    if row.located and (result := _check_place(item)):
        return result
    if not row.located and isinf(item.z):
        return _ALTITUDE
    return _check_values(item, row)


def check_list(items: Sequence[Item], mission_type: int) -> str | None:
    """Return what is wrong with a whole list, None when nothing is: polygons must be whole."""
    if mission_type != MissionType.FENCE:
        return None
    at = 0
    while at < len(items):
        first = items[at]
        if first.command not in _POLYGONS:
            at += 1
            continue
        count = int(first.param1)
        corners = items[at : at + count]
        same = [(c.command, c.param1) == (first.command, first.param1) for c in corners]
        if len(corners) < count or not all(same):
            return f"the fence polygon at {at} has not the {count} corners that it announces"
        at += count
    return None


def _check_place(item: Item) -> int:
    if item.frame not in _FRAMES:
        return UNSUPPORTED_FRAME
    if abs(item.x) > 90 * 10**7:
        return _LATITUDE
    if abs(item.y) > 180 * 10**7:
        return _LONGITUDE
    if not (isfinite(item.z) and abs(item.z) <= _HIGHEST_M):
        return _ALTITUDE
    return ACCEPTED


def _check_values(item: Item, row: Supported) -> int:
    first, second = item.param1, item.param2
    if item.command in _POLYGONS and not (3 <= first <= _MAX_CORNERS and first == int(first)):
        return _PARAMS[0]
    if item.command in _CIRCLES and not first > 0:
        return _PARAMS[0]
    if row.command == mav.MAV_CMD_NAV_DELAY and first < 0:
        return _PARAMS[0]  # by the time of day
    if row.command == mav.MAV_CMD_DO_CHANGE_SPEED:
        if first not in (0, 1, 2, 3):
            return _PARAMS[0]
        if second < 0 and second not in (-1, -2):
            return _PARAMS[1]
    if row.command == mav.MAV_CMD_NAV_LOITER_TURNS and abs(item.param3) > _WIDEST_M:
        return _PARAMS[2]
    if row.command == mav.MAV_CMD_CONDITION_YAW and item.param4 not in (0, 1):
        return _PARAMS[3]
    return ACCEPTED
