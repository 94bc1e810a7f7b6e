"""What the makers of messages look at, and the units that they write."""

from collections.abc import Callable
from dataclasses import dataclass
from math import asin, atan2, degrees, pi
from typing import NamedTuple

from ....transport.mavlink import Message
from ...flight.autopilot import Autopilot
from ...robot import Kinematics, Robot

EVERYBODY = ("ardupilot", "px4", "generic")


class Euler(NamedTuple):
    """An attitude in radians, aerospace order."""

    roll: float
    pitch: float
    yaw: float


class View:
    """One vehicle as it is now."""

    __slots__ = ("autopilot", "now_us", "robot")

    def __init__(self, autopilot: Autopilot, robot: Robot) -> None:
        self.autopilot = autopilot
        self.robot = robot
        self.now_us = 0  # since boot

    @property
    def boot_ms(self) -> int:
        """Return milliseconds since boot; they wrap after 49 days, as on every autopilot."""
        return self.now_us // 1000 & 0xFFFFFFFF

    @property
    def utc_us(self) -> int:
        """Return microseconds since 1970."""
        return self.autopilot.config.epoch_us + self.now_us

    @property
    def k(self) -> Kinematics:
        """Return where the robot is and how it moves."""
        return self.robot.kinematics()

    def altitude(self, down: float) -> float:
        """Return metres above the sea of a height in local NED."""
        return self.autopilot.origin.alt_m - down

    def geodetic_e7(self, north: float, east: float) -> tuple[int, int]:
        """Return latitude and longitude in 1e-7 degrees of a place in local NED."""
        lat_deg, lon_deg = self.autopilot.origin.to_geodetic(north, east)
        return round(lat_deg * 1e7), round(lon_deg * 1e7)


Maker = Callable[[View], Message | None]


@dataclass(frozen=True, slots=True)
class Row:
    """One message that vehicles send: who makes it, who sends it, and what the docs say."""

    make: Maker
    note: str = ""
    stacks: tuple[str, ...] = EVERYBODY  # personalities, by name
    partly: bool = False  # fields are constant or left out; the note says which


def euler(k: Kinematics) -> Euler:
    """Return the attitude as angles."""
    w, x, y, z = k[6:10]
    sin_pitch = 2 * (w * y - z * x)
    pitch = asin(sin_pitch) if abs(sin_pitch) < 1 else (pi / 2 if sin_pitch > 0 else -pi / 2)
    return Euler(
        atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        pitch,
        atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    )


def to_body(k: Kinematics, north: float, east: float, down: float) -> tuple[float, float, float]:
    """Return a vector in local NED along the body axes (FRD)."""
    w, x, y, z = k.qw, -k.qx, -k.qy, -k.qz  # the inverse attitude
    tx, ty, tz = 2 * (y * down - z * east), 2 * (z * north - x * down), 2 * (x * east - y * north)
    return (
        north + w * tx + y * tz - z * ty,
        east + w * ty + z * tx - x * tz,
        down + w * tz + x * ty - y * tx,
    )


def heading_cdeg(angle: float) -> int:
    """Return an angle (rad) as hundredths of a degree, 0..35999."""
    return round(degrees(angle) % 360 * 100) % 36000


def int16(value: float) -> int:
    """Return a whole number, clipped to what 16 bits hold."""
    return max(-32767, min(32767, round(value)))


def uint16(value: float) -> int:
    """Return a whole number, clipped to 0..65534: the highest one says "unknown"."""
    return max(0, min(65534, round(value)))
