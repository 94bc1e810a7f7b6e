"""Flight mode names for people."""

from ..vehicles.flight.personality import ARDUPILOT


def mode_name(kind: str, custom_mode: int) -> str:
    """Return what ground stations call a mode, or its number."""
    modes = ARDUPILOT.modes[kind]
    mode = modes.mode(custom_mode)
    if mode is not None:
        return modes.name(mode)
    return modes.refused.get(custom_mode, f"MODE {custom_mode}")
