"""Every message that vehicles send as telemetry, by number; docs and rates are made from it."""

from collections.abc import Mapping

from ....transport.extra_messages import (
    AVAILABLE_MODES_ID,
    CURRENT_MODE_ID,
    ESC_STATUS_ID,
    NAMES,
    PROTOCOL_VERSION_ID,
)
from ....transport.mavlink import mav
from . import actuators, estimator, identity, motion, position, power, sensors, status, targets
from .view import Row

_NOT_ARDUPILOT = ("px4", "generic")
"""ArduPilot 4.6 refuses these, and clients then fall back to what they know of it."""

MESSAGES: Mapping[int, Row] = {
    # How it is
    mav.MAVLINK_MSG_ID_HEARTBEAT: Row(status.heartbeat, "also at once on every change"),
    mav.MAVLINK_MSG_ID_SYS_STATUS: Row(
        status.sys_status, "PREARM_CHECK is healthy when nothing hinders arming; load is 0"
    ),
    mav.MAVLINK_MSG_ID_SYSTEM_TIME: Row(status.system_time),
    mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: Row(status.extended_sys_state),
    mav.MAVLINK_MSG_ID_MISSION_CURRENT: Row(status.mission_current, "with total, state and mode"),
    mav.MAVLINK_MSG_ID_FENCE_STATUS: Row(status.fence_status),
    mav.MAVLINK_MSG_ID_RC_CHANNELS: Row(
        status.rc_channels, "MANUAL_CONTROL and overrides, else sticks at rest"
    ),
    mav.MAVLINK_MSG_ID_RC_CHANNELS_RAW: Row(status.rc_channels_raw, "the first eight channels"),
    # How it moves
    mav.MAVLINK_MSG_ID_ATTITUDE: Row(motion.attitude),
    mav.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: Row(motion.attitude_quaternion),
    mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED: Row(motion.local_position_ned),
    mav.MAVLINK_MSG_ID_ODOMETRY: Row(motion.odometry, "no covariance", partly=True),
    mav.MAVLINK_MSG_ID_VFR_HUD: Row(motion.vfr_hud, "the air stands still"),
    # Where it is
    mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: Row(position.global_position_int),
    mav.MAVLINK_MSG_ID_GPS_RAW_INT: Row(
        position.gps_raw_int, "3D fix, 14 satellites, no noise; no geoid: ellipsoid = sea"
    ),
    mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: Row(position.gps_global_origin),
    mav.MAVLINK_MSG_ID_HOME_POSITION: Row(position.home_position),
    mav.MAVLINK_MSG_ID_ALTITUDE: Row(position.altitude, "the ground is flat"),
    mav.MAVLINK_MSG_ID_TERRAIN_REPORT: Row(
        position.terrain_report, "the ground is flat", partly=True
    ),
    # What it is told
    mav.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: Row(
        targets.position_target_local_ned, "in GUIDED, with the type_mask of the target"
    ),
    mav.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT: Row(
        targets.position_target_global_int, "in GUIDED, AMSL"
    ),
    mav.MAVLINK_MSG_ID_ATTITUDE_TARGET: Row(
        targets.attitude_target, "while angles or body rates are flown"
    ),
    mav.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT: Row(
        targets.nav_controller_output, "distance and bearing to the position flown to"
    ),
    # What its sensors and its estimator say
    mav.MAVLINK_MSG_ID_RAW_IMU: Row(sensors.raw_imu, "milli-g, mrad/s, milligauss; no noise"),
    mav.MAVLINK_MSG_ID_SCALED_IMU: Row(sensors.scaled_imu, "no noise"),
    mav.MAVLINK_MSG_ID_SCALED_IMU2: Row(sensors.scaled_imu2, "the same"),
    mav.MAVLINK_MSG_ID_SCALED_IMU3: Row(sensors.scaled_imu3, "the same"),
    mav.MAVLINK_MSG_ID_HIGHRES_IMU: Row(sensors.highres_imu, "no noise"),
    mav.MAVLINK_MSG_ID_SCALED_PRESSURE: Row(sensors.scaled_pressure, "standard atmosphere"),
    mav.MAVLINK_MSG_ID_SCALED_PRESSURE2: Row(sensors.scaled_pressure2, "the same"),
    mav.MAVLINK_MSG_ID_VIBRATION: Row(sensors.vibration, "none", partly=True),
    mav.MAVLINK_MSG_ID_WIND: Row(sensors.wind, "none: disturbances are forces", partly=True),
    mav.MAVLINK_MSG_ID_WIND_COV: Row(
        sensors.wind_cov, "none: disturbances are forces", partly=True
    ),
    mav.MAVLINK_MSG_ID_EKF_STATUS_REPORT: Row(
        estimator.ekf_status_report, "all is known: no variances", partly=True
    ),
    mav.MAVLINK_MSG_ID_ESTIMATOR_STATUS: Row(
        estimator.estimator_status, "all is known: no test ratios", partly=True
    ),
    mav.MAVLINK_MSG_ID_AHRS: Row(estimator.ahrs, "no drift, no error", partly=True),
    mav.MAVLINK_MSG_ID_AHRS2: Row(estimator.ahrs2, "the truth"),
    mav.MAVLINK_MSG_ID_SIMSTATE: Row(estimator.simstate, "the truth"),
    mav.MAVLINK_MSG_ID_HIL_STATE_QUATERNION: Row(estimator.hil_state_quaternion, "the truth"),
    # What drives it
    mav.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: Row(
        actuators.servo_output_raw, "motor order of QUAD/PLUS; rover: 1 left, 3 right"
    ),
    mav.MAVLINK_MSG_ID_ACTUATOR_OUTPUT_STATUS: Row(actuators.actuator_output_status),
    mav.MAVLINK_MSG_ID_ACTUATOR_CONTROL_TARGET: Row(
        actuators.actuator_control_target, "roll, pitch, yaw and thrust as shares"
    ),
    mav.MAVLINK_MSG_ID_ESC_TELEMETRY_1_TO_4: Row(actuators.esc_telemetry, "true speeds"),
    ESC_STATUS_ID: Row(actuators.esc_status_1_to_4, "true speeds"),
    mav.MAVLINK_MSG_ID_BATTERY_STATUS: Row(
        power.battery_status, "the whole voltage in the first cell"
    ),
    mav.MAVLINK_MSG_ID_POWER_STATUS: Row(power.power_status, "always healthy", partly=True),
    mav.MAVLINK_MSG_ID_MEMINFO: Row(power.meminfo, "always plenty", partly=True),
    # Who it is
    mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION: Row(identity.autopilot_version),
    PROTOCOL_VERSION_ID: Row(identity.protocol_versions, stacks=_NOT_ARDUPILOT),
    CURRENT_MODE_ID: Row(identity.mode_now, stacks=_NOT_ARDUPILOT),
}
"""All but AVAILABLE_MODES, which comes as a list and on request only."""

_ON_REQUEST = {AVAILABLE_MODES_ID: "on request only; param2 is a number from 1, or 0 for all"}


def name_of(message_id: int) -> str:
    """Return what MAVLink calls a message."""
    known = mav.mavlink_map.get(message_id)
    return str(known.msgname) if known else NAMES.get(message_id, f"message {message_id}")


def note_of(message_id: int) -> str:
    """Return what users should know of a message beyond MAVLink's own description."""
    row = MESSAGES.get(message_id)
    return row.note if row else _ON_REQUEST.get(message_id, "")
