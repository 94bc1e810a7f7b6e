"""One mission item in wire terms, and the three lists that items live in."""

from enum import IntEnum
from math import isfinite
from typing import NamedTuple

from ...transport.mavlink import Message, mav

AMSL: int = mav.MAV_FRAME_GLOBAL
ABOVE_HOME: int = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT
ABOVE_TERRAIN: int = mav.MAV_FRAME_GLOBAL_TERRAIN_ALT  # the ground is flat: as above home

_INT_FRAMES = {
    mav.MAV_FRAME_GLOBAL_INT: AMSL,
    mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: ABOVE_HOME,
    mav.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT: ABOVE_TERRAIN,
}
_TO_INT_FRAMES = {frame: int_frame for int_frame, frame in _INT_FRAMES.items()}
_INT32 = 2**31 - 1


class MissionType(IntEnum):
    """Which list is meant, as MAV_MISSION_TYPE numbers them."""

    MISSION = mav.MAV_MISSION_TYPE_MISSION
    FENCE = mav.MAV_MISSION_TYPE_FENCE
    RALLY = mav.MAV_MISSION_TYPE_RALLY


class Item(NamedTuple):
    """A mission item as MISSION_ITEM_INT has it: `x` and `y` are 1e-7 degrees where a place."""

    command: int
    frame: int = ABOVE_HOME
    param1: float = 0.0
    param2: float = 0.0
    param3: float = 0.0
    param4: float = 0.0
    x: int = 0
    y: int = 0
    z: float = 0.0  # m
    autocontinue: int = 1

    @property
    def lat_deg(self) -> float:
        """Return the latitude of an item with a place."""
        return self.x * 1e-7

    @property
    def lon_deg(self) -> float:
        """Return the longitude of an item with a place."""
        return self.y * 1e-7

    @property
    def has_place(self) -> bool:
        """Whether a place is given; 0, 0 means "where you are"."""
        return self.x != 0 or self.y != 0


def from_message(m: Message, *, located: bool) -> Item:
    """Return the item in a MISSION_ITEM or MISSION_ITEM_INT.

    `located` says that the command's x and y are a place: degrees in the float form. What
    cannot be an integer becomes one that is out of range, so that the check refuses it.
    """
    x, y = m.x, m.y
    if m.get_type() == "MISSION_ITEM":
        scale = 1e7 if located else 1.0
        x, y = _integer(x * scale), _integer(y * scale)
    frame = _INT_FRAMES.get(m.frame, m.frame)
    return Item(m.command, frame, m.param1, m.param2, m.param3, m.param4, x, y, m.z, m.autocontinue)


def to_int_frame(frame: int) -> int:
    """Return the frame that says "integer" on the wire, where there is one."""
    return _TO_INT_FRAMES.get(frame, frame)


def plain_frame(frame: int) -> int:
    """Return `frame` without the distinction between integers and floats."""
    return _INT_FRAMES.get(frame, frame)


def _integer(value: float) -> int:
    return round(value) if isfinite(value) and abs(value) < _INT32 else _INT32
