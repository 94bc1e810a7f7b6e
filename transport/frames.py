"""Frames and geodesy: NED on MAVLink and on board, ENU on the ground side, WGS-84 degrees on maps.

This is the only place where one becomes the other.
"""

from dataclasses import dataclass
from math import atan2, cos, degrees, pi, radians, remainder, sin, sqrt

Triple = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]  # w x y z

_EARTH_RADIUS = 6_378_137.0  # m, WGS-84 semi-major axis
_ECCENTRICITY_2 = 6.694379990141e-3  # WGS-84 first eccentricity squared
_SQRT_HALF = sqrt(0.5)


@dataclass(frozen=True, slots=True)
class Origin:
    """The fleet origin: every vehicle's local position is relative to it."""

    lat_deg: float = 47.3977
    lon_deg: float = 8.5456
    alt_m: float = 488.0  # above mean sea level

    def __post_init__(self) -> None:
        if not (-89 <= self.lat_deg <= 89 and -180 <= self.lon_deg <= 180):
            raise ValueError(f"no usable origin: latitude {self.lat_deg}, longitude {self.lon_deg}")
        if not -500 <= self.alt_m <= 10_000:
            raise ValueError(f"altitude {self.alt_m} m is not within -500..10000 m")

    def __reduce__(self) -> tuple[type["Origin"], tuple[float, float, float]]:
        """Pickle by construction: a frozen class that is compiled has no other way."""
        return Origin, (self.lat_deg, self.lon_deg, self.alt_m)

    def _metres_per_radian(self) -> tuple[float, float]:
        """Return the radii of curvature (north, east) of WGS-84 at the origin."""
        lat = radians(self.lat_deg)
        w2 = 1 - _ECCENTRICITY_2 * (1 - cos(lat) ** 2)
        normal = _EARTH_RADIUS / sqrt(w2)
        return normal * (1 - _ECCENTRICITY_2) / w2, normal * cos(lat)

    def to_geodetic(self, north: float, east: float) -> tuple[float, float]:
        """Return latitude and longitude in degrees of a point in metres from the origin."""
        per_north, per_east = self._metres_per_radian()
        lon_deg = self.lon_deg + degrees(east / per_east)
        return self.lat_deg + degrees(north / per_north), remainder(lon_deg, 360)

    def from_geodetic(self, lat_deg: float, lon_deg: float) -> tuple[float, float]:
        """Return metres north and east of the origin: the inverse of `to_geodetic`."""
        per_north, per_east = self._metres_per_radian()
        return (
            radians(lat_deg - self.lat_deg) * per_north,
            radians(remainder(lon_deg - self.lon_deg, 360)) * per_east,
        )


def wrap_angle(angle: float) -> float:
    """Return `angle` in [-pi, pi)."""
    return (angle + pi) % (2 * pi) - pi


def swap_ned_enu(v: Triple) -> Triple:
    """Return a NED vector in ENU, or an ENU vector in NED: the swap is its own inverse."""
    return (v[1], v[0], -v[2])


def swap_yaw(angle: float) -> float:
    """Return NED yaw as ENU heading or the other way round, in [-pi, pi)."""
    return wrap_angle(pi / 2 - angle)


def quaternion_to_enu(q: Quaternion) -> Quaternion:
    """Return the attitude FLU -> ENU for an attitude FRD -> NED (both w x y z)."""
    w, x, y, z = q
    # (NED -> ENU) * q * (FLU -> FRD), with (0, r, r, 0), r = sqrt(1/2), and (0, 1, 0, 0)
    r = _SQRT_HALF
    return (r * (w + z), r * (x + y), r * (x - y), r * (w - z))


def quaternion_from_euler(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the attitude of yaw, then pitch, then roll (aerospace order)."""
    cr, sr = cos(roll / 2), sin(roll / 2)
    cp, sp = cos(pitch / 2), sin(pitch / 2)
    cy, sy = cos(yaw / 2), sin(yaw / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def yaw_of(q: Quaternion) -> float:
    """Return the yaw (or, in ENU, the heading) of an attitude."""
    w, x, y, z = q
    return atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
