"""SET_ATTITUDE_TARGET turned into a setpoint: angles or body rates, and a thrust."""

from dataclasses import dataclass
from math import asin, atan2, isfinite, sqrt
from typing import TYPE_CHECKING

from ...transport.mavlink import Message, mav
from ..robot import AttitudeSetpoint
from .position_target import IllegalTarget

if TYPE_CHECKING:
    from .autopilot import Autopilot

THRUST_IS_THRUST = 8
"""Bit of GUID_OPTIONS: the thrust field is a thrust, not a climb rate."""

_ATTITUDE_IGNORE: int = mav.ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE
_THRUST_IGNORE: int = mav.ATTITUDE_TARGET_TYPEMASK_THROTTLE_IGNORE
_THRUST_BODY = 0x20  # THRUST_BODY_SET, which the dialect lacks, with the field it is about
_RATES_IGNORE = 0x07
_ROLL_AND_PITCH_IGNORE = 0x03
_YAW_RATE_IGNORE = 0x04
_UNIT = 1e-3  # how far from 1 a unit quaternion's length may be
_MAX_RATE = 100.0  # rad/s; anything larger is a mistake
_STILL = 1e-3  # rad/s: a slower yaw rate leaves the yaw to the quaternion


@dataclass(frozen=True, slots=True)
class AttitudeTarget:
    """A legal target: the setpoint and the `type_mask` it was sent with."""

    setpoint: AttitudeSetpoint
    type_mask: int


def parse_attitude(message: Message, autopilot: "Autopilot") -> AttitudeTarget:
    """Return the target in `message`; raise IllegalTarget when it means "hold".

    The rules are ArduPilot's (mavlink.md A3): a thrust must be given; on a copter also an
    attitude or body rates, and of the rates all three or none (beside an attitude the yaw rate
    alone will do). A rover takes the yaw rate or else the quaternion's heading, and its thrust
    is a share of its speed, negative backwards.
    """
    mask: int = message.type_mask
    thrust = _thrust(message, mask)
    if autopilot.config.kind == "rover":
        return AttitudeTarget(_steering(message, mask, thrust), mask)
    roll = pitch = yaw = yaw_rate = roll_rate = pitch_rate = None
    if not mask & _ATTITUDE_IGNORE:
        roll, pitch, yaw = _angles(message)
    given = ~mask & _RATES_IGNORE
    if given == _RATES_IGNORE:
        roll_rate = _rate(message.body_roll_rate, "body_roll_rate")
        pitch_rate = _rate(message.body_pitch_rate, "body_pitch_rate")
    elif given & _ROLL_AND_PITCH_IGNORE:
        raise IllegalTarget("body rates: all three or none")
    elif roll is None:
        raise IllegalTarget(f"type_mask 0x{mask:X} sets no attitude and no body rates")
    if given & _YAW_RATE_IGNORE:
        yaw_rate = _rate(message.body_yaw_rate, "body_yaw_rate")
        if abs(yaw_rate) > _STILL:
            yaw = None  # it turns on from where it is
    setpoint = AttitudeSetpoint(
        roll, pitch, yaw, yaw_rate, roll_rate=roll_rate, pitch_rate=pitch_rate
    )
    if autopilot.personality.thrust_is_climb_rate and not (
        autopilot.settings.guided_options & THRUST_IS_THRUST
    ):
        limits = autopilot.robot.limits
        share = 2 * _within(thrust, 0.0, 1.0) - 1
        climb = share * (limits.climb if share > 0 else limits.descent)
        return AttitudeTarget(setpoint._replace(climb_rate=climb), mask)
    return AttitudeTarget(setpoint._replace(thrust=_within(thrust, 0.0, 1.0)), mask)


def _steering(m: Message, mask: int, thrust: float) -> AttitudeSetpoint:
    """Return a rover's setpoint: a turn rate or a heading, and a share of its speed."""
    speed = _within(thrust, -1.0, 1.0)
    if not mask & _YAW_RATE_IGNORE:
        return AttitudeSetpoint(yaw_rate=_rate(m.body_yaw_rate, "body_yaw_rate"), thrust=speed)
    if mask & _ATTITUDE_IGNORE:
        raise IllegalTarget(f"type_mask 0x{mask:X} sets no heading and no yaw rate")
    return AttitudeSetpoint(yaw=_angles(m)[2], thrust=speed)


def _thrust(m: Message, mask: int) -> float:
    if mask & _THRUST_BODY:
        raise IllegalTarget("thrust_body is not supported")
    if mask & _THRUST_IGNORE:
        raise IllegalTarget("no thrust")
    thrust: float = m.thrust
    if not isfinite(thrust):
        raise IllegalTarget(f"thrust {thrust:g} is out of range")
    return thrust


def _angles(m: Message) -> tuple[float, float, float]:
    """Return roll, pitch and yaw of the quaternion."""
    w, x, y, z = m.q
    length = sqrt(w * w + x * x + y * y + z * z) if all(map(isfinite, m.q)) else 0.0
    if not abs(length - 1) <= _UNIT:
        raise IllegalTarget("quaternion not of unit length")
    w, x, y, z = w / length, x / length, y / length, z / length
    return (
        atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        asin(_within(2 * (w * y - z * x), -1.0, 1.0)),
        atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    )


def _rate(value: float, what: str) -> float:
    if not (isfinite(value) and abs(value) <= _MAX_RATE):
        raise IllegalTarget(f"{what} {value:g} is out of range")
    return value


def _within(value: float, low: float, high: float) -> float:
    return low if value < low else high if value > high else value
