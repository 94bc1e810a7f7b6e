"""SET_POSITION_TARGET_LOCAL_NED and _GLOBAL_INT turned into setpoints in local NED.

Flight stacks differ in which combinations, frames and leftovers they take: `TargetRules`, one for
each stack and kind of vehicle (mavlink.md A3, B2.4).
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from math import cos, hypot, isfinite, sin
from typing import NamedTuple

from ...transport.frames import Origin, wrap_angle
from ...transport.mavlink import Message, mav
from ..robot import Setpoint, Vec3

FORCE = 0x200
_POSITION, _VELOCITY, _ACCELERATION, _YAW, _YAW_RATE = 1, 2, 4, 8, 16  # parts of a target
_IGNORE = {_POSITION: 0x007, _VELOCITY: 0x038, _ACCELERATION: 0x1C0, _YAW: 0x400, _YAW_RATE: 0x800}
_MAX_VALUE = 1e6  # m; anything larger is a mistake
_MAX_SPEED = 1000.0

_ABSOLUTE: int = mav.MAV_FRAME_LOCAL_NED
_OFFSET: int = mav.MAV_FRAME_LOCAL_OFFSET_NED
_BODY: tuple[int, ...] = (mav.MAV_FRAME_BODY_NED, mav.MAV_FRAME_BODY_OFFSET_NED)
_AMSL: tuple[int, ...] = (mav.MAV_FRAME_GLOBAL, mav.MAV_FRAME_GLOBAL_INT)
_RELATIVE: tuple[int, ...] = (
    mav.MAV_FRAME_GLOBAL_RELATIVE_ALT,
    mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
)
_TERRAIN: tuple[int, ...] = (  # the ground is flat, and home is on it
    mav.MAV_FRAME_GLOBAL_TERRAIN_ALT,
    mav.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT,
)


class IllegalTarget(ValueError):  # noqa: N818 - reads as what it is
    """A target that is not followed: the vehicle stops and holds, or goes on if `drops`.

    `text` is what to say about it, "" nothing; without one, the reason.
    """

    def __init__(
        self,
        reason: str,
        *,
        text: str | None = None,
        severity: int = mav.MAV_SEVERITY_WARNING,
        drops: bool = False,
    ) -> None:
        super().__init__(reason)
        self.text = f"Target refused: {reason}" if text is None else text
        self.severity = severity
        self.drops = drops


class Here(NamedTuple):
    """What a relative target is relative to."""

    position: Vec3
    yaw: float
    home_down: float
    origin: Origin


@dataclass(frozen=True, slots=True)
class PositionTarget:
    """A legal target: the setpoint, and the `type_mask` of the parts that are followed.

    A rover that is told a speed and a heading or turn rate drives along its own nose while it
    turns: `forward_speed` is that speed (m/s), and the setpoint's velocity must be renewed.
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
        """Return what outlives the time-out when positions are latched: position and yaw."""
        position, yaw = self.setpoint.position, self.setpoint.yaw
        return None if position is None else to_place(position, yaw)


def to_place(position: Vec3, yaw: float | None = None) -> PositionTarget:
    """Return the target that is a place in local NED, and perhaps a heading."""
    parts = _POSITION | (0 if yaw is None else _YAW)
    return PositionTarget(Setpoint(position=position, yaw=yaw), _type_mask(parts))


def along(yaw: float, speed: float) -> PositionTarget:
    """Return the target that is a heading and a speed along it (m/s, negative: backwards)."""
    setpoint = Setpoint(velocity=Vec3(), yaw=wrap_angle(yaw))
    return PositionTarget(setpoint, _type_mask(_VELOCITY | _YAW), speed)


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetRules:
    """What one flight stack takes, and what becomes of the rest."""

    legal: frozenset[int]  # combinations of parts
    local_frames: tuple[int, ...] = (_ABSOLUTE, _OFFSET, *_BODY)
    global_frames: tuple[int, ...] = (*_AMSL, *_RELATIVE, *_TERRAIN)
    drives: bool = False  # a rover: no acceleration, and speed goes along the nose when it turns
    needs_no_acceleration: bool = False  # a target with one is dropped, with a text
    drops: bool = False  # a wrong frame or combination changes nothing; else it stops the vehicle
    illegal_text: str | None = None  # with a place for the message's name
    frame_text: str | None = None  # likewise, and one for the frame
    text_severity: int = mav.MAV_SEVERITY_WARNING
    expires: bool = True  # after GUID_TIMEOUT
    avoids: bool = False  # no speed leads out of the fence, unless AVOID_ENABLE says so
    tells_expiry: bool = True


def _with_turns(*motions: int) -> frozenset[int]:
    """Return combinations of triples, each with yaw, yaw rate, both or neither."""
    return frozenset(m | t for m in motions for t in (0, _YAW, _YAW_RATE, _YAW | _YAW_RATE))


def _every(mask: int) -> frozenset[int]:
    """Return the combinations in which at least one of these parts is given."""
    return frozenset(parts for parts in range(32) if parts & mask)


_P, _V, _A = _POSITION, _VELOCITY, _ACCELERATION
_ARDUCOPTER = TargetRules(
    legal=_with_turns(_P, _P | _V, _P | _V | _A, _V, _V | _A, _A),
    illegal_text="",
    tells_expiry=False,
)
_ARDUROVER = TargetRules(
    # Of a position, ArduRover would ignore the velocity: we take it as feed-forward.
    legal=_with_turns(_P, _P | _V) | {_V, _V | _YAW, _V | _YAW_RATE, _YAW, _YAW_RATE},
    drives=True,
    avoids=True,
    needs_no_acceleration=True,
    drops=True,
    illegal_text="",
)
_PX4 = TargetRules(
    legal=_every(_P | _V | _A),
    local_frames=(_ABSOLUTE, mav.MAV_FRAME_BODY_NED),
    global_frames=(*_AMSL, *_RELATIVE),
    drops=True,
    illegal_text="{} invalid",
    frame_text="{} coordinate frame {} unsupported",
    text_severity=mav.MAV_SEVERITY_CRITICAL,
    expires=False,  # the failsafe comes first
)
_GENERIC = TargetRules(legal=_every(_P | _V | _A | _YAW | _YAW_RATE))
_RULES = {
    ("ardupilot", "quadcopter"): _ARDUCOPTER,
    ("ardupilot", "rover"): _ARDUROVER,
    ("px4", "quadcopter"): _PX4,
    ("px4", "rover"): replace(_PX4, drives=True),
    ("generic", "quadcopter"): _GENERIC,
    ("generic", "rover"): replace(_GENERIC, drives=True),
}


def rules_of(personality: str, kind: str) -> TargetRules:
    """Return what vehicles of this personality and kind do about targets."""
    return _RULES[personality, kind]


def parse(message: Message, rules: TargetRules, here: Here) -> PositionTarget:
    """Return the target in `message`; raise IllegalTarget when it is not to be followed."""
    name, mask = message.get_type(), message.type_mask
    is_local = name == "SET_POSITION_TARGET_LOCAL_NED"
    frame: int = message.coordinate_frame
    if frame not in (rules.local_frames if is_local else rules.global_frames):
        text = rules.frame_text and rules.frame_text.format(name, frame)
        raise _refused(rules, f"frame {frame} is not supported", text)
    parts = _parts(mask)
    if parts & _ACCELERATION:
        parts = _without_acceleration(parts, mask, rules, name)
    if parts not in rules.legal:
        text = rules.illegal_text and rules.illegal_text.format(name)
        raise _refused(rules, f"type_mask 0x{mask:X} sets nothing that can be followed", text)
    turn = here.yaw if is_local and frame in _BODY else 0.0
    position = velocity = acceleration = yaw = yaw_rate = None
    if parts & _POSITION:
        place = _local_position if is_local else _global_position
        position = place(message, here)
    if parts & _VELOCITY:
        xyz = message.vx, message.vy, message.vz
        velocity = _rotated(xyz, turn, _MAX_SPEED, "velocity")
    if parts & _ACCELERATION:
        xyz = message.afx, message.afy, message.afz
        acceleration = _rotated(xyz, turn, _MAX_SPEED, "acceleration")
    if parts & _YAW:
        yaw = wrap_angle(turn + _finite(message.yaw, _MAX_VALUE, "yaw"))
    if parts & _YAW_RATE:
        yaw_rate = _finite(message.yaw_rate, _MAX_SPEED, "yaw_rate")
    setpoint = Setpoint(position, velocity, acceleration, yaw, yaw_rate)
    forward = _forward_speed(message, parts) if rules.drives else None
    return PositionTarget(setpoint, _type_mask(parts), forward)


def _without_acceleration(parts: int, mask: int, rules: TargetRules, name: str) -> int:
    """Return the parts as they are, or less the acceleration that a rover does not take."""
    if rules.needs_no_acceleration:
        text = f"Ignoring {name}; set ACC_IGNORE in mask"
        raise IllegalTarget(text, text=text, severity=mav.MAV_SEVERITY_INFO, drops=True)
    if mask & FORCE:
        raise _refused(rules, "force setpoints are not supported", rules.illegal_text)
    return parts & ~_ACCELERATION if rules.drives else parts


def _forward_speed(m: Message, parts: int) -> float | None:
    """Return the speed along a turning rover's nose; a negative vx in any frame is backwards."""
    turns = parts & (_YAW | _YAW_RATE)
    if parts & _POSITION or not (parts & _VELOCITY and turns):
        return None
    return -hypot(m.vx, m.vy) if m.vx < 0 else hypot(m.vx, m.vy)


def _local_position(m: Message, here: Here) -> Vec3:
    frame = m.coordinate_frame
    turn = here.yaw if frame in _BODY else 0.0
    given = _rotated((m.x, m.y, m.z), turn, _MAX_VALUE, "position")
    if frame == _ABSOLUTE:
        return given
    p = here.position
    return Vec3(p.north + given.north, p.east + given.east, p.down + given.down)


def _global_position(m: Message, here: Here) -> Vec3:
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


@lru_cache(maxsize=64)
def _parts(type_mask: int) -> int:
    """Return the parts that a `type_mask` gives; any ignore bit of a triple ignores it whole."""
    return sum(part for part, bits in _IGNORE.items() if not type_mask & bits)


@lru_cache(maxsize=64)
def _type_mask(parts: int) -> int:
    """Return the `type_mask` that ignores all but these parts."""
    return sum(bits for part, bits in _IGNORE.items() if not parts & part)


def _refused(rules: TargetRules, reason: str, text: str | None) -> IllegalTarget:
    return IllegalTarget(reason, text=text, severity=rules.text_severity, drops=rules.drops)


def _rotated(xyz: tuple[float, float, float], turn: float, limit: float, what: str) -> Vec3:
    x, y, z = xyz
    for value in xyz:
        _finite(value, limit, what)
    c, s = cos(turn), sin(turn)
    return Vec3(c * x - s * y, s * x + c * y, z)


def _finite(value: float, limit: float, what: str) -> float:
    if not (isfinite(value) and abs(value) <= limit):
        raise IllegalTarget(f"{what} {value:g} is out of range")
    return value
