"""Who the vehicle is and what it can do. What it says here must be true."""

from ....transport.extra_messages import available_modes, current_mode, protocol_version
from ....transport.mavlink import Message, mav
from ...flight.modes import Mode
from .view import View

_CAPABILITIES: int = (
    mav.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    | mav.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
    | mav.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | mav.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
    | mav.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
    | mav.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | mav.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
    | mav.MAV_PROTOCOL_CAPABILITY_FTP
    | mav.MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET
    | mav.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    | mav.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
    | mav.MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION
)
_CUSTOM = list(b"mavherd\0")  # where others have the beginning of a commit's hash
_NO_HASH = [0] * 8
_VERSION, _OLDEST_VERSION = 200, 100  # of MAVLink, times 100

_STANDARD_MODES = {  # MAV_STANDARD_MODE; the rest are 0, non-standard
    Mode.LOITER: 1,  # position hold
    Mode.ALT_HOLD: 4,
    Mode.RTL: 5,  # safe recovery
    Mode.AUTO: 6,
    Mode.LAND: 7,
    Mode.TAKEOFF: 8,
}
_ADVANCED, _AUTONOMOUS = 1, 4  # MAV_MODE_PROPERTY
_PROPERTIES = {
    Mode.HOLD: _AUTONOMOUS,
    Mode.GUIDED: _ADVANCED | _AUTONOMOUS,
    Mode.TAKEOFF: _AUTONOMOUS,
    Mode.AUTO: _AUTONOMOUS,
    Mode.RTL: _AUTONOMOUS,
    Mode.LAND: _AUTONOMOUS,
}


def autopilot_version(v: View) -> Message:
    """Make AUTOPILOT_VERSION. The unique id is the system id: one world, one such vehicle."""
    personality = v.autopilot.personality
    major, minor, patch = personality.firmware
    message: Message = mav.MAVLink_autopilot_version_message(
        _CAPABILITIES | personality.capabilities,
        major << 24 | minor << 16 | patch << 8 | mav.FIRMWARE_VERSION_TYPE_OFFICIAL,
        0,
        0,
        0,
        _CUSTOM,
        _NO_HASH,
        _NO_HASH,
        0,
        0,
        v.autopilot.config.system_id,
    )
    return message


def protocol_versions(_: View) -> Message:
    """Make PROTOCOL_VERSION: MAVLink 2, and 1 for those who speak it."""
    return protocol_version(_VERSION, _OLDEST_VERSION, _VERSION, _NO_HASH, _NO_HASH)


def mode_now(v: View) -> Message:
    """Make CURRENT_MODE."""
    mode = v.autopilot.mode
    number = v.autopilot.modes.number(mode)
    return current_mode(_STANDARD_MODES.get(mode, 0), number, number)


def modes(v: View) -> list[Message]:
    """Make AVAILABLE_MODES: one message for each mode, numbered from 1."""
    rows = v.autopilot.modes.rows
    return [
        available_modes(
            len(rows),
            index,
            _STANDARD_MODES.get(mode, 0),
            number,
            _PROPERTIES.get(mode, 0),
            name.encode("ascii")[:34],
        )
        for index, (mode, (number, name)) in enumerate(rows.items(), start=1)
    ]
