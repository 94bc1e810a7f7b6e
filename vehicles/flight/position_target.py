"""SET_POSITION_TARGET_LOCAL_NED and _GLOBAL_INT turned into setpoints in local NED."""

from dataclasses import dataclass
from math import cos, hypot, isfinite, sin

from ...transport.frames import Origin, wrap_angle
from ...transport.mavlink import Message, mav
from ..robot import Setpoint, Vec3

POSITION_IGNORE = 0x007
VELOCITY_IGNORE = 0x038
ACCELERATION_IGNORE = 0x1C0
FORCE = 0x200
YAW_IGNORE = 0x400
YAW_RATE_IGNORE = 0x800
_MAX_VALUE = 1e6  # m; anything larger is a mistake
_MAX_SPEED = 1000.0

_ABSOLUTE = mav.MAV_FRAME_LOCAL_NED
_OFFSET = mav.MAV_FRAME_LOCAL_OFFSET_NED
_BODY = (mav.MAV_FRAME_BODY_NED, mav.MAV_FRAME_BODY_OFFSET_NED)
_AMSL = (mav.MAV_FRAME_GLOBAL, mav.MAV_FRAME_GLOBAL_INT)
_ABOVE_HOME = (
    mav.MAV_FRAME_GLOBAL_RELATIVE_ALT,
    mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
    mav.MAV_FRAME_GLOBAL_TERRAIN_ALT,  # the ground is flat
    mav.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT,
)


class IllegalTarget(ValueError):  # noqa: N818 - reads as what it is
    """A position target that means "stop and hold"; the text says why, for STATUSTEXT."""


@dataclass(frozen=True, slots=True)
class Here:
    """What a relative target is relative to."""

    position: Vec3
    yaw: float
    home_down: float
    origin: Origin


@dataclass(frozen=True, slots=True)
class PositionTarget:
    """A legal target: the setpoint and the `type_mask` it was sent with.

    A rover told a speed and a turn rate goes on turning between messages: `forward_speed` is
    then its speed along its own heading (m/s), and the setpoint's velocity must be renewed.
    """

    setpoint: Setpoint
    type_mask: int
    forward_speed: float | None = None

    def at(self, yaw: float) -> Setpoint:
        """Return the setpoint for a vehicle that points to `yaw` now."""
        if self.forward_speed is None:
            return self.setpoint
        v = Vec3(self.forward_speed * cos(yaw), self.forward_speed * sin(yaw), 0.0)
        return self.setpoint._replace(velocity=v)

    def expired(self) -> "PositionTarget | None":
        """Return what outlives the time-out when positions are latched: the position alone."""
        if self.setpoint.position is None:
            return None
        kept = Setpoint(position=self.setpoint.position, yaw=self.setpoint.yaw)
        ignored = VELOCITY_IGNORE | ACCELERATION_IGNORE | YAW_RATE_IGNORE
        return PositionTarget(kept, self.type_mask | ignored)


def parse(message: Message, kind: str, here: Here) -> PositionTarget:
    """Return the target in `message`; raise IllegalTarget when it means "hold".

    Any ignore bit of a triple ignores the whole triple. Legal are a position, a velocity or an
    acceleration and every combination of them, each with yaw, yaw rate or neither; yaw or yaw
    rate alone turn on the spot. A rover takes no acceleration.
    """
    mask: int = message.type_mask
    if mask & FORCE:
        raise IllegalTarget("force setpoints are not supported")
    is_local = message.get_type() == "SET_POSITION_TARGET_LOCAL_NED"
    position = velocity = acceleration = None
    yaw = yaw_rate = None
    if not mask & POSITION_IGNORE:
        position = _local_position(message, here) if is_local else _global_position(message, here)
    elif is_local:
        _check_frame(message.coordinate_frame, (_ABSOLUTE, _OFFSET, *_BODY))
    else:
        _check_frame(message.coordinate_frame, (*_AMSL, *_ABOVE_HOME))
    in_body = is_local and message.coordinate_frame in _BODY
    turn = here.yaw if in_body else 0.0
    if not mask & VELOCITY_IGNORE:
        velocity = _rotated(message.vx, message.vy, message.vz, turn, _MAX_SPEED, "velocity")
    if not mask & ACCELERATION_IGNORE and kind != "rover":
        acceleration = _rotated(
            message.afx, message.afy, message.afz, turn, _MAX_SPEED, "acceleration"
        )
    if not mask & YAW_IGNORE:
        yaw = wrap_angle(turn + _finite(message.yaw, _MAX_VALUE, "yaw"))
    if not mask & YAW_RATE_IGNORE:
        yaw_rate = _finite(message.yaw_rate, _MAX_SPEED, "yaw_rate")
    setpoint = Setpoint(position, velocity, acceleration, yaw, yaw_rate)
    if setpoint == Setpoint():
        raise IllegalTarget(f"type_mask 0x{mask:X} sets nothing")
    forward = None
    if kind == "rover" and position is None and velocity is not None and yaw_rate is not None:
        backwards = in_body and message.vx < 0
        forward = hypot(velocity.north, velocity.east) * (-1 if backwards else 1)
    return PositionTarget(setpoint, mask, forward)


def _local_position(m: Message, here: Here) -> Vec3:
    match m.coordinate_frame:
        case f if f == _ABSOLUTE:
            return _rotated(m.x, m.y, m.z, 0.0, _MAX_VALUE, "position")
        case f if f == _OFFSET:
            offset = _rotated(m.x, m.y, m.z, 0.0, _MAX_VALUE, "position")
        case f if f in _BODY:
            offset = _rotated(m.x, m.y, m.z, here.yaw, _MAX_VALUE, "position")
        case f:
            raise IllegalTarget(f"frame {f} is not supported")
    p = here.position
    return Vec3(p.north + offset.north, p.east + offset.east, p.down + offset.down)


def _global_position(m: Message, here: Here) -> Vec3:
    _check_frame(m.coordinate_frame, (*_AMSL, *_ABOVE_HOME))
    lat_deg, lon_deg = m.lat_int * 1e-7, m.lon_int * 1e-7
    if not (-90 <= lat_deg <= 90 and -180 <= lon_deg <= 180) or m.lat_int == m.lon_int == 0:
        raise IllegalTarget(f"no such place: {lat_deg:g}, {lon_deg:g}")
    north, east = here.origin.from_geodetic(lat_deg, lon_deg)
    altitude_m = _finite(m.alt, _MAX_VALUE, "alt")
    if m.coordinate_frame in _AMSL:
        down = here.origin.alt_m - altitude_m
    else:
        down = here.home_down - altitude_m
    return Vec3(_finite(north, _MAX_VALUE, "lat_int"), _finite(east, _MAX_VALUE, "lon_int"), down)


def _check_frame(frame: int, allowed: tuple[int, ...]) -> None:
    if frame not in allowed:
        raise IllegalTarget(f"frame {frame} is not supported")


def _rotated(x: float, y: float, z: float, turn: float, limit: float, what: str) -> Vec3:
    for value in (x, y, z):
        _finite(value, limit, what)
    c, s = cos(turn), sin(turn)
    return Vec3(c * x - s * y, s * x + c * y, z)


def _finite(value: float, limit: float, what: str) -> float:
    if not (isfinite(value) and abs(value) <= limit):
        raise IllegalTarget(f"{what} {value:g} is out of range")
    return value
