"""Telemetry messages made from what the physics and the autopilot have."""

from collections.abc import Callable
from math import asin, atan2, cos, degrees, pi, sin

from ...transport.frames import yaw_of
from ...transport.mavlink import Message, mav
from ..flight.autopilot import Autopilot
from ..flight.modes import FIRMWARE_VERSION
from ..robot import Robot, Vec3

_NAN = float("nan")
_SENSORS = (
    mav.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | mav.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | mav.MAV_SYS_STATUS_SENSOR_3D_MAG
    | mav.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
    | mav.MAV_SYS_STATUS_SENSOR_GPS
)
_CAPABILITIES = (
    mav.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    | mav.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | mav.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    | mav.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
)


class Telemetry:
    """Makes any message the vehicle can send; `now_us` is its time since boot."""

    def __init__(self, autopilot: Autopilot, robot: Robot) -> None:
        self.now_us = 0
        self._autopilot = autopilot
        self._robot = robot
        self._origin = autopilot.config.origin
        self._makers: dict[int, Callable[[], Message | None]] = {
            mav.MAVLINK_MSG_ID_HEARTBEAT: autopilot.heartbeat,
            mav.MAVLINK_MSG_ID_SYS_STATUS: self._sys_status,
            mav.MAVLINK_MSG_ID_SYSTEM_TIME: self._system_time,
            mav.MAVLINK_MSG_ID_ATTITUDE: self._attitude,
            mav.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: self._attitude_quaternion,
            mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED: self._local_position,
            mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: self._global_position,
            mav.MAVLINK_MSG_ID_GPS_RAW_INT: self._gps_raw,
            mav.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: self._position_target,
            mav.MAVLINK_MSG_ID_HOME_POSITION: self._home_position,
            mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: self._gps_global_origin,
            mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: self._extended_sys_state,
            mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION: self._autopilot_version,
        }

    def make(self, message_id: int) -> Message | None:
        """Return the message with this id as things are now; None when there is none to send."""
        maker = self._makers.get(message_id)
        return maker() if maker else None

    @property
    def _boot_ms(self) -> int:
        return self.now_us // 1000 & 0xFFFFFFFF  # wraps after 49 days, as on every autopilot

    def _sys_status(self) -> Message:
        healthy = _SENSORS
        if self._autopilot.arming_refusal() is None:
            healthy |= mav.MAV_SYS_STATUS_PREARM_CHECK
        present = _SENSORS | mav.MAV_SYS_STATUS_PREARM_CHECK
        # 65535 mV, -1 cA and -1 %: there is no battery model
        return mav.MAVLink_sys_status_message(
            present, present, healthy, 0, 65535, -1, -1, 0, 0, 0, 0, 0, 0
        )

    def _system_time(self) -> Message:
        utc_us = self._autopilot.config.epoch_us + self.now_us
        return mav.MAVLink_system_time_message(utc_us, self._boot_ms)

    def _attitude(self) -> Message:
        k = self._robot.kinematics()
        roll, pitch, yaw = _euler(k.qw, k.qx, k.qy, k.qz)
        return mav.MAVLink_attitude_message(
            self._boot_ms, roll, pitch, yaw, k.roll_rate, k.pitch_rate, k.yaw_rate
        )

    def _attitude_quaternion(self) -> Message:
        k = self._robot.kinematics()
        return mav.MAVLink_attitude_quaternion_message(
            self._boot_ms, k.qw, k.qx, k.qy, k.qz, k.roll_rate, k.pitch_rate, k.yaw_rate
        )

    def _local_position(self) -> Message:
        k = self._robot.kinematics()
        return mav.MAVLink_local_position_ned_message(
            self._boot_ms, k.north, k.east, k.down, k.v_north, k.v_east, k.v_down
        )

    def _global_position(self) -> Message:
        k = self._robot.kinematics()
        lat_e7, lon_e7 = self._geodetic_e7(k.north, k.east)
        return mav.MAVLink_global_position_int_message(
            self._boot_ms,
            lat_e7,
            lon_e7,
            round((self._origin.alt_m - k.down) * 1e3),
            round((self._autopilot.home.down - k.down) * 1e3),
            _cm(k.v_north),
            _cm(k.v_east),
            _cm(k.v_down),
            round(degrees(_euler(k.qw, k.qx, k.qy, k.qz)[2]) % 360 * 100) % 36000,
        )

    def _gps_raw(self) -> Message:
        k = self._robot.kinematics()
        lat_e7, lon_e7 = self._geodetic_e7(k.north, k.east)
        speed = (k.v_north**2 + k.v_east**2) ** 0.5
        course = degrees(atan2(k.v_east, k.v_north)) % 360
        return mav.MAVLink_gps_raw_int_message(
            self._autopilot.config.epoch_us + self.now_us,
            mav.GPS_FIX_TYPE_3D_FIX,
            lat_e7,
            lon_e7,
            round((self._origin.alt_m - k.down) * 1e3),
            80,  # HDOP 0.8
            120,
            min(65534, _cm(speed)),
            round(course * 100) % 36000,
            14,
        )

    def _position_target(self) -> Message | None:
        target = self._autopilot.target
        if target is None:
            return None
        s = target.at(yaw_of(self._robot.kinematics()[6:10]))
        position, velocity = s.position or Vec3(), s.velocity or Vec3()
        acceleration = s.acceleration or Vec3()
        return mav.MAVLink_position_target_local_ned_message(
            self._boot_ms,
            mav.MAV_FRAME_LOCAL_NED,
            target.type_mask,
            *position,
            *velocity,
            *acceleration,
            s.yaw or 0.0,
            s.yaw_rate or 0.0,
        )

    def _home_position(self) -> Message:
        home = self._autopilot.home
        lat_e7, lon_e7 = self._geodetic_e7(home.north, home.east)
        half_yaw = self._autopilot.home_yaw / 2
        return mav.MAVLink_home_position_message(
            lat_e7,
            lon_e7,
            round((self._origin.alt_m - home.down) * 1e3),
            *home,
            [cos(half_yaw), 0.0, 0.0, sin(half_yaw)],
            _NAN,
            _NAN,
            _NAN,
            self.now_us,
        )

    def _gps_global_origin(self) -> Message:
        lat_e7, lon_e7 = self._geodetic_e7(0.0, 0.0)
        return mav.MAVLink_gps_global_origin_message(
            lat_e7, lon_e7, round(self._origin.alt_m * 1e3), self.now_us
        )

    def _extended_sys_state(self) -> Message:
        return mav.MAVLink_extended_sys_state_message(
            mav.MAV_VTOL_STATE_UNDEFINED, self._autopilot.landed_state
        )

    def _autopilot_version(self) -> Message:
        major, minor, patch = FIRMWARE_VERSION
        release = mav.FIRMWARE_VERSION_TYPE_OFFICIAL
        return mav.MAVLink_autopilot_version_message(
            _CAPABILITIES,
            major << 24 | minor << 16 | patch << 8 | release,
            0,
            0,
            0,
            [0] * 8,
            [0] * 8,
            [0] * 8,
            0,
            0,
            self._autopilot.config.system_id,
        )

    def _geodetic_e7(self, north: float, east: float) -> tuple[int, int]:
        lat_deg, lon_deg = self._origin.to_geodetic(north, east)
        return round(lat_deg * 1e7), round(lon_deg * 1e7)


def _cm(metres: float) -> int:
    """Return centimetres, clipped to what 16 bits hold."""
    return max(-32767, min(32767, round(metres * 100)))


def _euler(w: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return roll, pitch and yaw of an attitude quaternion."""
    sin_pitch = 2 * (w * y - z * x)
    pitch = asin(sin_pitch) if abs(sin_pitch) < 1 else (pi / 2 if sin_pitch > 0 else -pi / 2)
    return (
        atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        pitch,
        atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    )
