"""The battery and the rest of the electronics."""

from ....transport.mavlink import Message, mav
from .view import View, int16, uint16

_UNKNOWN_TEMPERATURE = 32767
_NO_CELL = 65535
_RAIL_MV = 5000
_FREE_MEMORY = 128 << 10  # bytes, as a simulated ArduPilot says: there is always enough


def battery_status(v: View) -> Message | None:
    """Make BATTERY_STATUS, with the whole voltage in the first cell; none without a monitor."""
    battery = v.autopilot.battery
    if not battery.present:
        return None
    message: Message = mav.MAVLink_battery_status_message(
        0,
        mav.MAV_BATTERY_FUNCTION_ALL,
        mav.MAV_BATTERY_TYPE_LIPO,
        _UNKNOWN_TEMPERATURE,
        [uint16(battery.voltage * 1000)] + [_NO_CELL] * 9,
        int16(battery.current * 100),
        round(battery.consumed_mah),
        -1,  # energy: not measured
        round(battery.remaining * 100),
        0,  # time left: not estimated
        battery.charge_state,
    )
    return message


def power_status(_: View) -> Message:
    """Make POWER_STATUS: a healthy supply."""
    message: Message = mav.MAVLink_power_status_message(
        _RAIL_MV, 0, mav.MAV_POWER_STATUS_BRICK_VALID
    )
    return message


def meminfo(_: View) -> Message:
    """Make MEMINFO."""
    message: Message = mav.MAVLink_meminfo_message(0, 65535, _FREE_MEMORY)
    return message
