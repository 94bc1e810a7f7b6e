"""What an outside vehicle is, and what its flight modes are called."""

from ....transport.mavlink import mav
from ...mode_names import mode_name
from ...station.identity import kind_heard, type_name
from ...station.stacks import autopilot_name, stack_heard

_LIKE_OURS = {
    mav.MAV_TYPE_HELICOPTER: "quadcopter",
    mav.MAV_TYPE_GENERIC_MULTIROTOR: "quadcopter",
    mav.MAV_TYPE_SURFACE_BOAT: "rover",  # one firmware and one set of modes
}
_FIXED_WING = {mav.MAV_TYPE_FIXED_WING, mav.MAV_TYPE_FLAPPING_WING, mav.MAV_TYPE_KITE} | {
    number for number, entry in mav.enums["MAV_TYPE"].items() if "_VTOL_" in entry.name
}
_MODES = {  # of ArduPilot's other vehicles, which its dialect lists
    **dict.fromkeys(_FIXED_WING, "PLANE_MODE"),
    mav.MAV_TYPE_SUBMARINE: "SUB_MODE",
    mav.MAV_TYPE_ANTENNA_TRACKER: "TRACKER_MODE",
}


def kind_of(mav_type: int) -> str:
    """Return how a vehicle is shown: "quadcopter", "rover", or what MAVLink calls its type."""
    return kind_heard(mav_type) or _LIKE_OURS.get(mav_type) or type_name(mav_type)


def describe(mav_type: int, autopilot: int) -> str:
    """Return what a vehicle says that it is: "quadrotor, ardupilot"."""
    return f"{type_name(mav_type)}, {autopilot_name(autopilot)}"


def mode_of(mav_type: int, autopilot: int, custom_mode: int) -> str:
    """Return what ground stations call a mode, or its number."""
    stack = stack_heard(autopilot)
    name = stack.name if stack else ""
    if name == "ardupilot" and (group := _MODES.get(mav_type)):
        known = mav.enums[group].get(custom_mode)
        return known.name.removeprefix(f"{group}_") if known else f"MODE {custom_mode}"
    if name in ("ardupilot", "px4"):
        kind = kind_of(mav_type)
        return mode_name(kind if kind == "rover" else "quadcopter", custom_mode)
    return f"MODE {custom_mode}"
