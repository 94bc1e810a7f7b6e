"""What the vehicle is told to do: the echo of targets, and how far it is from there."""

from math import atan2, degrees, hypot

from ....transport.frames import quaternion_from_euler, yaw_of
from ....transport.mavlink import Message, mav
from ...flight.attitude_target import AttitudeTarget
from ...flight.modes import Mode
from ...flight.position_target import PositionTarget
from ...robot import AttitudeSetpoint, Setpoint, Vec3
from .actuators import throttle
from .view import View, euler, int16, uint16

_NOWHERE = Vec3()
_NO_ROLL_RATE, _NO_PITCH_RATE, _NO_YAW_RATE = 1, 2, 4  # ATTITUDE_TARGET_TYPEMASK
_NO_ATTITUDE = 128


def position_target_local_ned(v: View) -> Message | None:
    """Make POSITION_TARGET_LOCAL_NED: in GUIDED, with the type_mask the target came with."""
    target = _position_target(v)
    if target is None:
        return None
    s = target.at(yaw_of(v.k[6:10]))
    message: Message = mav.MAVLink_position_target_local_ned_message(
        v.boot_ms,
        mav.MAV_FRAME_LOCAL_NED,
        target.type_mask,
        *(s.position or _NOWHERE),
        *_motion(s),
    )
    return message


def position_target_global_int(v: View) -> Message | None:
    """Make POSITION_TARGET_GLOBAL_INT: the same on the Earth, above the sea."""
    target = _position_target(v)
    if target is None:
        return None
    s = target.at(yaw_of(v.k[6:10]))
    lat_e7 = lon_e7 = 0
    altitude = 0.0
    if s.position is not None:
        lat_e7, lon_e7 = v.geodetic_e7(s.position.north, s.position.east)
        altitude = v.altitude(s.position.down)
    message: Message = mav.MAVLink_position_target_global_int_message(
        v.boot_ms,
        mav.MAV_FRAME_GLOBAL,
        target.type_mask,
        lat_e7,
        lon_e7,
        altitude,
        *_motion(s),
    )
    return message


def attitude_target(v: View) -> Message | None:
    """Make ATTITUDE_TARGET, while angles or body rates are what is flown."""
    s = v.autopilot.setpoint
    if not isinstance(s, AttitudeSetpoint):
        return None
    now = euler(v.k)
    is_attitude = s.roll is not None or s.pitch is not None or s.yaw is not None
    mask = 0 if is_attitude else _NO_ATTITUDE
    for rate, bit in (
        (s.roll_rate, _NO_ROLL_RATE),
        (s.pitch_rate, _NO_PITCH_RATE),
        (s.yaw_rate, _NO_YAW_RATE),
    ):
        mask |= bit if rate is None else 0
    message: Message = mav.MAVLink_attitude_target_message(
        v.boot_ms,
        mask,
        list(quaternion_from_euler(s.roll or 0.0, s.pitch or 0.0, _or(s.yaw, now.yaw))),
        s.roll_rate or 0.0,
        s.pitch_rate or 0.0,
        s.yaw_rate or 0.0,
        _or(s.thrust, throttle(v)),
    )
    return message


def nav_controller_output(v: View) -> Message:
    """Make NAV_CONTROLLER_OUTPUT: distances to the position that is flown to, else zeros.

    The angles are those flown, which the inner loops hold within a tenth of a second.
    """
    k, s = v.k, v.autopilot.setpoint
    now = euler(k)
    position = s.position if isinstance(s, Setpoint) else None
    north, east, climb = 0.0, 0.0, 0.0
    if position is not None:
        north, east = position.north - k.north, position.east - k.east
        climb = k.down - position.down
    bearing = round(degrees(atan2(east, north)))
    message: Message = mav.MAVLink_nav_controller_output_message(
        degrees(now.roll),
        degrees(now.pitch),
        bearing if position is not None else int16(degrees(now.yaw)),
        bearing,
        uint16(hypot(north, east)),
        climb,
        0.0,
        0.0,
    )
    return message


def _position_target(v: View) -> PositionTarget | None:
    """Return the target that GUIDED follows, if it is a position target."""
    autopilot = v.autopilot
    target: PositionTarget | AttitudeTarget | None = autopilot.targets.current
    if autopilot.mode is not Mode.GUIDED or not isinstance(target, PositionTarget):
        return None
    return target


def _motion(s: Setpoint) -> tuple[float, ...]:
    """Return velocity, acceleration, yaw and yaw rate, 0 where there is none."""
    return (
        *(s.velocity or _NOWHERE),
        *(s.acceleration or _NOWHERE),
        s.yaw or 0.0,
        s.yaw_rate or 0.0,
    )


def _or(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value
