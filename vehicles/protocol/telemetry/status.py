"""How the vehicle is: heartbeat, health, time, fence, mission and the pilot's radio."""

from ....transport.mavlink import Message, mav
from ...flight.auto import mission_current_message
from ...flight.autopilot import Autopilot
from ...flight.battery import Level
from ...flight.modes import Mode
from .view import View, int16, uint16

_SENSORS: int = (
    mav.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | mav.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | mav.MAV_SYS_STATUS_SENSOR_3D_MAG
    | mav.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
    | mav.MAV_SYS_STATUS_SENSOR_GPS
    | mav.MAV_SYS_STATUS_AHRS
    | mav.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
)
_RADIO: int = mav.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
_BATTERY: int = mav.MAV_SYS_STATUS_SENSOR_BATTERY
_FENCE: int = mav.MAV_SYS_STATUS_GEOFENCE
_PREARM: int = mav.MAV_SYS_STATUS_PREARM_CHECK
_ATTITUDE_CONTROL: int = (
    mav.MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL
    | mav.MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION
    | mav.MAV_SYS_STATUS_SENSOR_YAW_POSITION
)
_HEIGHT_CONTROL: int = mav.MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL
_POSITION_CONTROL: int = mav.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL
_CONTROLS = _ATTITUDE_CONTROL | _HEIGHT_CONTROL | _POSITION_CONTROL
_CONTROLS_OF = {  # modes that do not use all of them
    Mode.STABILIZE: _ATTITUDE_CONTROL,
    Mode.ALT_HOLD: _ATTITUDE_CONTROL | _HEIGHT_CONTROL,
    Mode.MANUAL: 0,
}
_NO_VOLTAGE, _NO_CURRENT, _NO_CHARGE = 65535, -1, -1
_NO_RSSI = 255
_RAW_CHANNELS = 8


def heartbeat(v: View) -> Message:
    """Make HEARTBEAT."""
    return v.autopilot.heartbeat()


def sys_status(v: View) -> Message:
    """Make SYS_STATUS: what is there, what is used, what is well."""
    autopilot = v.autopilot
    present, enabled, healthy = _health(autopilot)
    voltage, current, charge = _NO_VOLTAGE, _NO_CURRENT, _NO_CHARGE
    if autopilot.battery.present:
        voltage = uint16(autopilot.battery.voltage * 1000)
        current = int16(autopilot.battery.current * 100)
        charge = round(autopilot.battery.remaining * 100)
    message: Message = mav.MAVLink_sys_status_message(
        present, enabled, healthy, 0, voltage, current, charge, 0, 0, 0, 0, 0, 0
    )
    return message


def extended_sys_state(v: View) -> Message:
    """Make EXTENDED_SYS_STATE."""
    message: Message = mav.MAVLink_extended_sys_state_message(
        mav.MAV_VTOL_STATE_UNDEFINED, v.autopilot.landed_state
    )
    return message


def system_time(v: View) -> Message:
    """Make SYSTEM_TIME."""
    message: Message = mav.MAVLink_system_time_message(v.utc_us, v.boot_ms)
    return message


def mission_current(v: View) -> Message:
    """Make MISSION_CURRENT."""
    return mission_current_message(v.autopilot)


def fence_status(v: View) -> Message:
    """Make FENCE_STATUS."""
    breaches = v.autopilot.fence.breaches
    message: Message = mav.MAVLink_fence_status_message(
        int(breaches.mask != 0),
        breaches.count,
        breaches.type,
        round(breaches.since * 1000) & 0xFFFFFFFF,
    )
    return message


def rc_channels(v: View) -> Message:
    """Make RC_CHANNELS: the sticks, wherever they come from."""
    channels = v.autopilot.pilot.channels
    message: Message = mav.MAVLink_rc_channels_message(
        v.boot_ms, len(channels), *channels, _NO_RSSI
    )
    return message


def rc_channels_raw(v: View) -> Message:
    """Make RC_CHANNELS_RAW: the first eight."""
    message: Message = mav.MAVLink_rc_channels_raw_message(
        v.boot_ms, 0, *v.autopilot.pilot.channels[:_RAW_CHANNELS], _NO_RSSI
    )
    return message


def _health(autopilot: Autopilot) -> tuple[int, int, int]:
    """Return MAV_SYS_STATUS_SENSORs that are there, that count, and that are well."""
    present = _SENSORS | _RADIO | _PREARM | _CONTROLS
    if not autopilot.flies:
        present &= ~_HEIGHT_CONTROL
    enabled = present & ~_CONTROLS | present & _CONTROLS_OF.get(autopilot.mode, _CONTROLS)
    ill = 0
    if autopilot.battery.present:
        present, enabled = present | _BATTERY, enabled | _BATTERY
        ill |= _BATTERY if autopilot.battery.level is not Level.OK else 0
    if autopilot.fence.present:
        present |= _FENCE
        enabled |= _FENCE if autopilot.fence.enabled else 0
        ill |= _FENCE if autopilot.fence.breaches.mask else 0
    if autopilot.pilot.lost:
        ill |= _RADIO
    if not autopilot.armed and autopilot.arming.prearm_refusal() is not None:
        ill |= _PREARM
    return present, enabled, present & ~ill
