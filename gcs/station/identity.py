"""Whether the vehicle behind an address is the one that is meant."""

from ...transport.mavlink import mav
from .stacks import FlightStack, autopilot_name, stack_heard

_TYPES = {
    "quadcopter": (
        mav.MAV_TYPE_QUADROTOR,
        mav.MAV_TYPE_HEXAROTOR,
        mav.MAV_TYPE_OCTOROTOR,
        mav.MAV_TYPE_TRICOPTER,
        mav.MAV_TYPE_COAXIAL,
        mav.MAV_TYPE_DODECAROTOR,
        mav.MAV_TYPE_DECAROTOR,
    ),
    "rover": (mav.MAV_TYPE_GROUND_ROVER,),
}


def kind_heard(mav_type: int) -> str | None:
    """Return the kind of vehicle that says this MAV_TYPE of itself; None: none of ours."""
    return next((kind for kind, types in _TYPES.items() if mav_type in types), None)


def mismatch(kind: str, stack: FlightStack | None, mav_type: int, autopilot: int) -> str:
    """Return why this is not the vehicle that is meant; "" it is."""
    if kind_heard(mav_type) != kind:
        return (
            f"it says that it is a {type_name(mav_type)}, not a {kind} "
            "(correct `kind:` or `connect:` in the scenario)"
        )
    if stack is None and stack_heard(autopilot) is None:
        return f"its flight stack, {autopilot_name(autopilot)}, is neither ArduPilot nor PX4"
    if stack is not None and stack.personality.autopilot != autopilot:
        return (
            f"its flight stack is {autopilot_name(autopilot)}, not {stack.name} "
            "(correct `autopilot:`, or write `autopilot: auto`)"
        )
    return ""


def type_name(mav_type: int) -> str:
    """Return the name of a MAV_TYPE for people."""
    known = mav.enums["MAV_TYPE"].get(mav_type)
    text = known.name.removeprefix("MAV_TYPE_") if known else f"type {mav_type}"
    return str(text.replace("_", " ").lower())
