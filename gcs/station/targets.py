"""SET_POSITION_TARGET_LOCAL_NED from what a target is to give."""

from typing import Any

from ...transport.frames import Triple
from ...transport.mavlink import Message, mav

_IGNORE_POSITION = 0x007
_IGNORE_VELOCITY = 0x038
_IGNORE_ACCELERATION = 0x1C0
_IGNORE_YAW = 0x400
_IGNORE_YAW_RATE = 0x800
_ZERO = (0.0, 0.0, 0.0)
_AUTOPILOT: int = mav.MAV_COMP_ID_AUTOPILOT1
_SetTarget: Any = mav.MAVLink_set_position_target_local_ned_message


def position_target(
    system_id: int,
    now: float,
    frame: int,
    position: Triple | None,
    velocity: Triple | None,
    acceleration: Triple | None,
    yaw: float | None,
    yaw_rate: float | None,
) -> Message:
    """Return the message that gives what is not None and has the rest ignored."""
    mask = 0
    if position is None:
        position, mask = _ZERO, _IGNORE_POSITION
    if velocity is None:
        velocity, mask = _ZERO, mask | _IGNORE_VELOCITY
    if acceleration is None:
        acceleration, mask = _ZERO, mask | _IGNORE_ACCELERATION
    mask |= _IGNORE_YAW if yaw is None else 0
    mask |= _IGNORE_YAW_RATE if yaw_rate is None else 0
    message: Message = _SetTarget(
        int(now * 1000) & 0xFFFFFFFF,
        system_id,
        _AUTOPILOT,
        frame,
        mask,
        *position,
        *velocity,
        *acceleration,
        yaw or 0.0,
        yaw_rate or 0.0,
    )
    return message
