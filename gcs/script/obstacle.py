"""Why a vehicle cannot take an order now, as far as the ground can tell. No I/O."""

from collections.abc import Sequence
from typing import NamedTuple

from ...scenarios.schema import Fence
from ...transport.frames import Triple
from .orders import Arm, Fly, Goto, Land, Order, Rest, TakeOff

CLIMB_M = 0.5  # a takeoff to less than this above the ground would not show


class Situation(NamedTuple):
    """How a vehicle stands with its script."""

    flies: bool
    armed: bool
    commanded: bool  # it is in the mode in which it follows, or on the script's own mission
    mode: str
    airborne: bool
    place: Triple  # ENU
    fence: Fence | None


def obstacle(order: Order, s: Situation) -> str:
    """Return what is in the way of an order, and the cure; "" nothing."""
    match order:
        case Rest() | Arm() | Land():
            return ""
        case TakeOff() if not s.flies:
            return "a rover cannot take off"
        case TakeOff(up=up) if not s.airborne and up < s.place[2] + CLIMB_M:
            return f"up={up:g} is no height to take off to, it stands at {s.place[2]:.1f}"
    if not s.armed:
        return "is not armed (call arm() first)"
    if not s.commanded:
        return f"is in {s.mode}, not under command (arm() takes it back)"
    if s.flies and not s.airborne and not isinstance(order, TakeOff):
        return "stands on the ground (call takeoff(up=...) first)"
    return _outside(order, s)


def filled(order: Goto, place: Triple, *, flies: bool) -> Triple:
    """Return where a goto leads from `place`: what it leaves out stays as it is."""
    east, north, up = place
    return (
        east if order.east is None else order.east,
        north if order.north is None else order.north,
        order.up if flies and order.up is not None else up,
    )


def _outside(order: Order, s: Situation) -> str:
    """Return which place of an order the fence does not hold."""
    places: Sequence[Triple] = ()
    match order:
        case TakeOff():
            places = [(*s.place[:2], order.up)]
        case Goto():
            places = [filled(order, s.place, flies=s.flies)]
        case Fly():
            places = order.points
    fence = s.fence
    beyond = [place for place in places if fence and not fence.holds(place)]
    if not fence or not beyond:
        return ""
    east, north, up = beyond[0]
    return (
        f"east {east:g}, north {north:g}, up {up:g} is outside the fence (east {fence.east[0]:g} "
        f"to {fence.east[1]:g}, north {fence.north[0]:g} to {fence.north[1]:g}, up to {fence.up:g})"
    )
