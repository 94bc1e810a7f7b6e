"""Flight mode names for people."""

from ..vehicles.flight.personality import ARDUPILOT, PX4

_PX4_LEAST = 1 << 16  # PX4's main mode begins with 1; numbers of ArduPilot are below 256


def mode_name(kind: str, custom_mode: int) -> str:
    """Return what ground stations call a mode, or its number; the number tells the stack."""
    modes = (PX4 if custom_mode >= _PX4_LEAST else ARDUPILOT).modes[kind]
    mode = modes.mode(custom_mode)
    if mode is not None:
        return modes.name(mode)
    return modes.refused.get(custom_mode, f"MODE {custom_mode}")
