"""What a compass and a barometer feel: the Earth's magnetic field and the standard atmosphere."""

from math import cos, radians, sin
from typing import NamedTuple

_POLE_LAT, _POLE_LON = radians(80.8), radians(-72.8)  # geomagnetic north pole, 2025
_EQUATOR_FIELD = 0.297  # gauss

_SEA_LEVEL_PRESSURE = 1013.25  # hPa
_SEA_LEVEL_TEMPERATURE = 288.15  # K
_LAPSE_RATE = 0.0065  # K/m
_EXPONENT = 5.25588
_ZERO_CELSIUS = 273.15  # K


class Field(NamedTuple):
    """A magnetic field in local NED, gauss."""

    north: float
    east: float
    down: float


def magnetic_field(lat_deg: float, lon_deg: float) -> Field:
    """Return the field of a dipole along the geomagnetic axis.

    Where people live, within some fifteen percent and fifteen degrees of the real one.
    """
    lat, west = radians(lat_deg), _POLE_LON - radians(lon_deg)
    # the direction to the pole, in the local frame: its vertical part is the sine of the
    # geomagnetic latitude
    up = sin(lat) * sin(_POLE_LAT) + cos(lat) * cos(_POLE_LAT) * cos(west)
    north = cos(lat) * sin(_POLE_LAT) - sin(lat) * cos(_POLE_LAT) * cos(west)
    east = cos(_POLE_LAT) * sin(west)
    return Field(_EQUATOR_FIELD * north, _EQUATOR_FIELD * east, 2 * _EQUATOR_FIELD * up)


def pressure_hpa(altitude: float) -> float:
    """Return the static pressure at an altitude (m above the sea)."""
    ratio = 1 - _LAPSE_RATE * altitude / _SEA_LEVEL_TEMPERATURE
    return float(_SEA_LEVEL_PRESSURE * max(ratio, 0.0) ** _EXPONENT)


def temperature_celsius(altitude: float) -> float:
    """Return the air temperature at an altitude (m above the sea)."""
    return _SEA_LEVEL_TEMPERATURE - _LAPSE_RATE * altitude - _ZERO_CELSIUS
