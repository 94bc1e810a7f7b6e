"""What the sensors on board would measure: no noise, no bias, no wind."""

from typing import NamedTuple

from ....transport.mavlink import Message, mav
from ... import earth
from ...physics import GRAVITY
from .view import View, int16, to_body

_MILLI_G = 1000 / GRAVITY
_ALL_BUT_AIRSPEED = 0x1BFF  # HIGHRES_IMU_UPDATED_FLAGS without the differential pressure


class Imu(NamedTuple):
    """Along body axes (FRD): m/s^2 without gravity, rad/s, gauss."""

    acceleration: tuple[float, float, float]
    rates: tuple[float, float, float]
    field: tuple[float, float, float]

    def scaled(self) -> list[int]:
        """Return milli-g, mrad/s and milligauss, as the integer messages want them."""
        scales = (_MILLI_G, 1000.0, 1000.0)
        return [int16(x * scale) for xyz, scale in zip(self, scales, strict=True) for x in xyz]


def imu(v: View) -> Imu:
    """Return what accelerometers, gyroscopes and compass feel."""
    k, origin = v.k, v.autopilot.origin
    field = earth.magnetic_field(origin.lat_deg, origin.lon_deg)
    rates = (k.roll_rate, k.pitch_rate, k.yaw_rate)
    return Imu(v.robot.specific_force(), rates, to_body(k, *field))


def raw_imu(v: View) -> Message:
    """Make RAW_IMU, in the units of SCALED_IMU, as ArduPilot does."""
    message: Message = mav.MAVLink_raw_imu_message(
        v.now_us, *imu(v).scaled(), 0, temperature_cdeg(v)
    )
    return message


def scaled_imu(v: View) -> Message:
    """Make SCALED_IMU."""
    message: Message = mav.MAVLink_scaled_imu_message(
        v.boot_ms, *imu(v).scaled(), temperature_cdeg(v)
    )
    return message


def scaled_imu2(v: View) -> Message:
    """Make SCALED_IMU2: the second set of sensors feels the same."""
    message: Message = mav.MAVLink_scaled_imu2_message(
        v.boot_ms, *imu(v).scaled(), temperature_cdeg(v)
    )
    return message


def scaled_imu3(v: View) -> Message:
    """Make SCALED_IMU3: and so does the third."""
    message: Message = mav.MAVLink_scaled_imu3_message(
        v.boot_ms, *imu(v).scaled(), temperature_cdeg(v)
    )
    return message


def highres_imu(v: View) -> Message:
    """Make HIGHRES_IMU, in SI units, gauss and hPa."""
    felt, altitude = imu(v), v.altitude(v.k.down)
    message: Message = mav.MAVLink_highres_imu_message(
        v.now_us,
        *felt.acceleration,
        *felt.rates,
        *felt.field,
        earth.pressure_hpa(altitude),
        0.0,
        altitude,
        earth.temperature_celsius(altitude),
        _ALL_BUT_AIRSPEED,
    )
    return message


def scaled_pressure(v: View) -> Message:
    """Make SCALED_PRESSURE: the standard atmosphere at the vehicle's height."""
    message: Message = mav.MAVLink_scaled_pressure_message(
        v.boot_ms, earth.pressure_hpa(v.altitude(v.k.down)), 0.0, temperature_cdeg(v)
    )
    return message


def scaled_pressure2(v: View) -> Message:
    """Make SCALED_PRESSURE2: the second barometer feels the same."""
    message: Message = mav.MAVLink_scaled_pressure2_message(
        v.boot_ms, earth.pressure_hpa(v.altitude(v.k.down)), 0.0, temperature_cdeg(v)
    )
    return message


def vibration(v: View) -> Message:
    """Make VIBRATION: nothing shakes."""
    message: Message = mav.MAVLink_vibration_message(v.now_us, 0.0, 0.0, 0.0, 0, 0, 0)
    return message


def wind(_: View) -> Message:
    """Make WIND: the air stands still; disturbances are forces, not wind."""
    message: Message = mav.MAVLink_wind_message(0.0, 0.0, 0.0)
    return message


def wind_cov(v: View) -> Message:
    """Make WIND_COV, PX4's form of the same."""
    message: Message = mav.MAVLink_wind_cov_message(
        v.now_us, 0.0, 0.0, 0.0, 0.0, 0.0, v.altitude(v.k.down), 0.0, 0.0
    )
    return message


def temperature_cdeg(v: View) -> int:
    """Return the temperature of the air in hundredths of a degree Celsius."""
    return int16(earth.temperature_celsius(v.altitude(v.k.down)) * 100)
