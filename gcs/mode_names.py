"""Flight mode names for people."""

from ..vehicles.flight.modes import IDENTITIES

# Modes of ArduPilot that our own vehicles do not have and outside vehicles may be in.
_OTHERS = {
    "quadcopter": {0: "STABILIZE", 2: "ALT_HOLD", 3: "AUTO", 16: "POSHOLD", 21: "SMART_RTL"},
    "rover": {0: "MANUAL", 1: "ACRO", 3: "STEERING", 10: "AUTO", 12: "SMART_RTL"},
}


def mode_name(kind: str, custom_mode: int) -> str:
    """Return what ground stations call a mode, or its number."""
    identity = IDENTITIES[kind]
    mode = identity.mode(custom_mode)
    if mode is not None:
        return identity.name(mode)
    return _OTHERS[kind].get(custom_mode, f"MODE {custom_mode}")
