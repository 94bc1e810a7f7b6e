"""Where a copter can come down without landing on somebody. Pure; ENU, m."""

from collections.abc import Collection, Iterator, Mapping
from math import cos, hypot, pi, sin

from ...scenarios.schema import Fence
from ...transport.frames import Triple
from ...transport.wire import VehicleState

ROVER_ROOM = 0.9  # horizontally from where a quadcopter lands to any rover,
COPTER_ROOM = 0.6  # and to a quadcopter
_SPARE = 0.3  # more than that for a place that is chosen: nobody stands quite still
_RINGS = tuple(0.3 * i for i in range(1, 14))
_BEARINGS = 16


def below(me: VehicleState, team: Mapping[str, VehicleState], rovers: Collection[str]) -> str:
    """Return the name of a vehicle that `me` would come down on; "": nobody is there."""
    for other in _others(me, team):
        if other.position[2] < me.position[2] and _away(me.position, other) < _room(other, rovers):
            return other.name
    return ""


def place_aside(
    me: VehicleState,
    team: Mapping[str, VehicleState],
    rovers: Collection[str],
    fence: Fence | None,
) -> Triple | None:
    """Return the nearest place at this height with nobody above or below it; None: there is none.

    It is inside the `fence`.
    """
    east, north, up = me.position
    others = list(_others(me, team))
    for radius in _RINGS:
        for i in range(_BEARINGS):
            bearing = 2 * pi * i / _BEARINGS
            place = (east + radius * cos(bearing), north + radius * sin(bearing), up)
            if fence and not fence.holds((place[0], place[1], 0.0)):
                continue
            if all(_away(place, other) >= _room(other, rovers) + _SPARE for other in others):
                return place
    return None


def _others(me: VehicleState, team: Mapping[str, VehicleState]) -> Iterator[VehicleState]:
    return (other for other in team.values() if other.name != me.name)


def _away(place: Triple, other: VehicleState) -> float:
    return hypot(other.position[0] - place[0], other.position[1] - place[1])


def _room(other: VehicleState, rovers: Collection[str]) -> float:
    return ROVER_ROOM if other.name in rovers else COPTER_ROOM
