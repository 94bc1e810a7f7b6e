"""Attitude, velocity and what a pilot's display shows."""

from math import degrees, hypot, sqrt

from ....transport.mavlink import Message, mav
from .actuators import throttle
from .view import View, euler, to_body

_UNKNOWN = [float("nan")] * 21  # NaN first: no covariance
_Attitude = mav.MAVLink_attitude_message  # looked up once: these two are sent most
_LocalPosition = mav.MAVLink_local_position_ned_message


def attitude(v: View) -> Message:
    """Make ATTITUDE."""
    k = v.k
    roll, pitch, yaw = euler(k)
    message: Message = _Attitude(v.boot_ms, roll, pitch, yaw, k.roll_rate, k.pitch_rate, k.yaw_rate)
    return message


def attitude_quaternion(v: View) -> Message:
    """Make ATTITUDE_QUATERNION."""
    k = v.k
    message: Message = mav.MAVLink_attitude_quaternion_message(
        v.boot_ms, k.qw, k.qx, k.qy, k.qz, k.roll_rate, k.pitch_rate, k.yaw_rate
    )
    return message


def local_position_ned(v: View) -> Message:
    """Make LOCAL_POSITION_NED."""
    north, east, down, v_north, v_east, v_down = v.k[:6]
    message: Message = _LocalPosition(v.boot_ms, north, east, down, v_north, v_east, v_down)
    return message


def odometry(v: View) -> Message:
    """Make ODOMETRY: pose in local NED, velocity along the body axes."""
    k = v.k
    message: Message = mav.MAVLink_odometry_message(
        v.now_us,
        mav.MAV_FRAME_LOCAL_NED,
        mav.MAV_FRAME_BODY_FRD,
        k.north,
        k.east,
        k.down,
        [k.qw, k.qx, k.qy, k.qz],
        *to_body(k, k.v_north, k.v_east, k.v_down),
        k.roll_rate,
        k.pitch_rate,
        k.yaw_rate,
        _UNKNOWN,
        _UNKNOWN,
        0,
        mav.MAV_ESTIMATOR_TYPE_AUTOPILOT,
        100,
    )
    return message


def vfr_hud(v: View) -> Message:
    """Make VFR_HUD. The air stands still, so airspeed is the speed over all three axes."""
    k = v.k
    ground_speed = hypot(k.v_north, k.v_east)
    message: Message = mav.MAVLink_vfr_hud_message(
        sqrt(ground_speed * ground_speed + k.v_down * k.v_down),
        ground_speed,
        round(degrees(euler(k).yaw)) % 360,
        round(100 * throttle(v)),
        v.altitude(k.down),
        0.0 - k.v_down,
    )
    return message
