"""Where the vehicle is on the Earth, and where home and the local origin are."""

from math import atan2, cos, degrees, hypot, sin

from ....transport.mavlink import Message, mav
from .view import View, euler, heading_cdeg, int16, uint16

_NAN = float("nan")
_SATELLITES = 14
_HDOP_E2, _VDOP_E2 = 80, 120
_ACCURACY_MM = 300  # what a good receiver claims; what it says here is exact
_SPEED_ACCURACY_MM_S = 40
_TERRAIN_SPACING = 100  # m, of a grid that is as flat everywhere


def global_position_int(v: View) -> Message:
    """Make GLOBAL_POSITION_INT."""
    k = v.k
    message: Message = mav.MAVLink_global_position_int_message(
        v.boot_ms,
        *v.geodetic_e7(k.north, k.east),
        round(v.altitude(k.down) * 1e3),
        round((v.autopilot.home.down - k.down) * 1e3),
        int16(k.v_north * 100),
        int16(k.v_east * 100),
        int16(k.v_down * 100),
        heading_cdeg(euler(k).yaw),
    )
    return message


def gps_raw_int(v: View) -> Message:
    """Make GPS_RAW_INT. There is no geoid: the sea is the ellipsoid."""
    k = v.k
    altitude_mm = round(v.altitude(k.down) * 1e3)
    message: Message = mav.MAVLink_gps_raw_int_message(
        v.utc_us,
        mav.GPS_FIX_TYPE_3D_FIX,
        *v.geodetic_e7(k.north, k.east),
        altitude_mm,
        _HDOP_E2,
        _VDOP_E2,
        uint16(hypot(k.v_north, k.v_east) * 100),
        round(degrees(atan2(k.v_east, k.v_north)) % 360 * 100) % 36000,
        _SATELLITES,
        altitude_mm,
        _ACCURACY_MM,
        _ACCURACY_MM,
        _SPEED_ACCURACY_MM_S,
    )
    return message


def home_position(v: View) -> Message:
    """Make HOME_POSITION."""
    home, half_yaw = v.autopilot.home, v.autopilot.home_yaw / 2
    message: Message = mav.MAVLink_home_position_message(
        *v.geodetic_e7(home.north, home.east),
        round(v.altitude(home.down) * 1e3),
        *home,
        [cos(half_yaw), 0.0, 0.0, sin(half_yaw)],
        _NAN,
        _NAN,
        _NAN,
        v.now_us,
    )
    return message


def gps_global_origin(v: View) -> Message:
    """Make GPS_GLOBAL_ORIGIN: where local NED begins."""
    message: Message = mav.MAVLink_gps_global_origin_message(
        *v.geodetic_e7(0.0, 0.0), round(v.altitude(0.0) * 1e3), v.now_us
    )
    return message


def altitude(v: View) -> Message:
    """Make ALTITUDE. The ground is as flat, and as high, as where the vehicle started."""
    down = v.k.down
    above_sea, above_ground = v.altitude(down), v.autopilot.config.down - down
    message: Message = mav.MAVLink_altitude_message(
        v.now_us,
        above_sea,
        above_sea,
        0.0 - down,
        v.autopilot.home.down - down,
        above_ground,
        above_ground,
    )
    return message


def terrain_report(v: View) -> Message:
    """Make TERRAIN_REPORT: flat ground, of which nothing is left to load."""
    k, ground = v.k, v.autopilot.config.down
    message: Message = mav.MAVLink_terrain_report_message(
        *v.geodetic_e7(k.north, k.east),
        _TERRAIN_SPACING,
        v.altitude(ground),
        ground - k.down,
        0,
        1,
    )
    return message
