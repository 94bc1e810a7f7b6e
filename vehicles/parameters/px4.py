"""PX4's parameters, as far as our vehicles honour or truthfully show them: INT32 and FLOAT only."""

from collections.abc import Mapping
from math import pi

from ..flight.settings import Action
from .body import QUADCOPTER_BODY, QUADCOPTER_GAINS, ROVER_BODY, ROVER_GAINS
from .parameter import INT32, REAL32, Parameter
from .rows import choice, constant, fact, gain, grouped, int32, joined, live, real

_DEG = pi / 180

PRESETS: Mapping[str, object] = {
    "settings.fence.enabled": True,  # a distance of 0 switches it off
    "settings.fence.types": 7,
    "settings.landed_disarm_delay": 2.0,
    "settings.rally_limit": 0.0,
}
"""Settings that PX4 has no parameter for, or where a vehicle of its begins elsewhere."""


def _system(kind: int, frame: int, label: str) -> list[Parameter]:
    return grouped(
        "System",
        fact(INT32, "SYS_AUTOSTART", frame, f"Airframe: {label}"),
        fact(INT32, "SYS_AUTOCONFIG", 0, "Reset of the configuration at boot"),
        fact(INT32, "SYS_HAS_GPS", 1, "A GPS"),
        fact(INT32, "SYS_HAS_MAG", 1, "A compass"),
        fact(INT32, "SYS_HAS_BARO", 1, "A barometer"),
        live(INT32, "MAV_SYS_ID", 1, "MAVLink system id"),
        fact(INT32, "MAV_COMP_ID", 1, "MAVLink component id"),
        fact(INT32, "MAV_TYPE", kind, "MAV_TYPE"),
        fact(INT32, "MAV_PROTO_VER", 2, "MAVLink version"),
    )


_LOSSES = {
    0: ("Disabled", Action.NONE),
    1: ("Hold", Action.HOLD),
    2: ("Return", Action.RTL),
    3: ("Land", Action.LAND),
    6: ("Disarm", Action.DISARM),
}

_COMMANDER = grouped(
    "Commander",
    real(
        "COM_OF_LOSS_T", 1, (0, 60), "Time without setpoints in OFFBOARD until the failsafe",
        "settings.offboard_loss_timeout", "s",
    ),
    choice(
        "COM_OBL_RC_ACT", 0, "What that failsafe does", "settings.offboard_loss_action",
        {
            0: ("Position mode, or return without a pilot", Action.RTL),
            3: ("Return", Action.RTL),
            4: ("Land", Action.LAND),
            5: ("Hold", Action.HOLD),
            7: ("Disarm", Action.DISARM),
        },
        INT32,
    ),
    choice("NAV_DLL_ACT", 0, "Losing the ground station", "settings.gcs_action", _LOSSES, INT32),
    int32("COM_DL_LOSS_T", 10, (1, 300), "After so long", "settings.gcs_timeout", "s"),
    choice(
        "NAV_RCL_ACT", 0, "Losing sticks that were in use", "settings.pilot_loss_action", _LOSSES,
        INT32,
    ),
    real("COM_RC_LOSS_T", 0.5, (0, 35), "After so long", "settings.pilot_loss_timeout", "s"),
    fact(INT32, "COM_RC_IN_MODE", 1, "Sticks come from", values={1: "Joystick only"}),
    real(
        "COM_DISARM_LAND", 2, (0, 60), "Time on the ground after a landing until disarming",
        "settings.landed_disarm_delay", "s",
    ),
    real(
        "COM_DISARM_PRFLT", 10, (0, 120), "Time armed on the ground until disarming, 0 never",
        "settings.disarm_delay", "s",
    ),
    choice(
        "COM_LOW_BAT_ACT", 0, "Battery critical", "settings.battery.critical_action",
        {0: ("Warning", Action.WARN), 2: ("Land", Action.LAND), 3: ("Return", Action.RTL)},
        INT32,
    ),
    int32("COM_ARM_WO_GPS", 1, (0, 2), "Arming without a GPS"),
    *(int32(f"COM_FLTMODE{n}", -1, (-1, 100), f"Mode of slot {n}") for n in range(1, 7)),
)  # fmt: skip

_BATTERY = grouped(
    "Battery Calibration",
    real("BAT1_CAPACITY", 3300, (-1, 1e6), "Capacity", "settings.battery.capacity_mah", "mAh"),
    int32("BAT1_N_CELLS", 3, (0, 20), "Cells"),
    real("BAT1_V_CHARGED", 4.2, (3, 4.5), "Voltage of a full cell", "", "V"),
    real("BAT1_V_EMPTY", 3.5, (2.5, 4), "Voltage of an empty cell", "", "V"),
    fact(INT32, "BAT1_SOURCE", 0, "Where the measurement comes from", values={0: "Power module"}),
    real("BAT_LOW_THR", 0.15, (0, 1), "Low below this charge", "settings.battery.low_charge"),
    real(
        "BAT_CRIT_THR", 0.07, (0, 1), "Critical below this charge",
        "settings.battery.critical_charge",
    ),
    real("BAT_EMERGEN_THR", 0.05, (0, 1), "Emergency below this charge"),
    real(
        "SIM_BAT_DRAIN", 60, (1, 86400), "Seconds in the air until the battery is half empty"
    ),
)  # fmt: skip

_FENCE = grouped(
    "Geofence",
    choice(
        "GF_ACTION", 2, "What a breach does", "settings.fence.action",
        {
            0: ("None", Action.NONE),
            1: ("Warning", Action.WARN),
            2: ("Hold", Action.HOLD),
            3: ("Return", Action.RTL),
            4: ("Terminate", Action.DISARM),
            5: ("Land", Action.LAND),
        },
        INT32,
    ),
    real(
        "GF_MAX_HOR_DIST", 0, (0, 100000), "Farthest from home, 0 any", "settings.fence.radius", "m"
    ),
    real(
        "GF_MAX_VER_DIST", 0, (0, 10000), "Highest above home, 0 any", "settings.fence.height", "m"
    ),
)  # fmt: skip

_MISSION = grouped(
    "Mission",
    real(
        "NAV_ACC_RAD", 2, (0.05, 200), "This near a waypoint is reached",
        "settings.waypoint_radius", "m",
    ),
    int32("MIS_DIST_1WP", 10000, (-1, 100000), "Farthest first waypoint", "", "m"),
)  # fmt: skip

_SENSORS = grouped(
    "Sensors",
    *(
        fact(INT32, name, number, text)
        for name, number, text in (
            ("CAL_ACC0_ID", 1310988, "Device id of the accelerometer"),
            ("CAL_GYRO0_ID", 1310988, "Device id of the gyroscope"),
            ("CAL_MAG0_ID", 197388, "Device id of the compass"),
            ("CAL_ACC1_ID", 0, "No second accelerometer"),
            ("CAL_GYRO1_ID", 0, "No second gyroscope"),
            ("CAL_MAG1_ID", 0, "No second compass"),
            ("CAL_MAG0_ROT", -1, "Internal compass"),
            ("SENS_BOARD_ROT", 0, "Board orientation: none"),
            ("EKF2_EN", 1, "EKF2"),
        )
    ),
    real("SENS_BOARD_X_OFF", 0, (-45, 45), "Roll of the board", "", "deg"),
    real("SENS_BOARD_Y_OFF", 0, (-45, 45), "Pitch of the board", "", "deg"),
    real("SENS_BOARD_Z_OFF", 0, (-45, 45), "Yaw of the board", "", "deg"),
    *(
        int32(f"RC_MAP_{what}", channel, (0, 18), f"Channel of {what.lower()}")
        for what, channel in {
            "ROLL": 1, "PITCH": 2, "THROTTLE": 3, "YAW": 4, "MODE_SW": 0, "FLTMODE": 0,
            "RETURN_SW": 0, "KILL_SW": 0, "OFFB_SW": 0,
        }.items()
    ),
    fact(INT32, "RC_CHAN_CNT", 0, "Channels of a receiver"),
    fact(REAL32, "SIM_RATE_HZ", 500, "Steps of the physics", unit="Hz"),
)  # fmt: skip

_MULTICOPTER = grouped(
    "Multicopter Position Control",
    gain("MPC_XY_CRUISE", "v_max", "Horizontal speed in every mode", "m/s"),
    gain("MPC_Z_VEL_MAX_UP", "v_up_max", "Climb rate", "m/s"),
    gain("MPC_Z_VEL_MAX_DN", "v_down_max", "Descent rate", "m/s"),
    gain("MPC_ACC_HOR", "accel_max", "Horizontal acceleration, 0 any", "m/s^2"),
    gain("MPC_ACC_UP_MAX", "climb_accel_max", "Vertical acceleration, 0 any", "m/s^2"),
    gain("MPC_TKO_RAMP_T", "spool_time", "From idle to lift-off", "s"),
    gain("MPC_TILTMAX_AIR", "tilt_limit", "Lean angle", "deg", _DEG),
    gain("MPC_YAWRAUTO_MAX", "yaw_rate_max", "Yaw rate in every mode", "deg/s", _DEG),
    gain("MPC_XY_VEL_P_ACC", "position_d", "Horizontal: acceleration per velocity error", "1/s"),
    gain("MPC_Z_VEL_P_ACC", "altitude_d", "Vertical: acceleration per velocity error", "1/s"),
    real(
        "MPC_LAND_SPEED", 0.7, (0.05, 10), "Landing speed near the ground",
        "settings.land_speed", "m/s",
    ),
    real(
        "MPC_Z_V_AUTO_DN", 1.5, (0, 20), "Landing speed above MPC_LAND_ALT2",
        "settings.land_speed_high", "m/s",
    ),
    real(
        "MPC_LAND_ALT2", 5, (0, 300), "Height where a landing slows down",
        "settings.land_slow_below", "m",
    ),
    real("MPC_MAN_Y_MAX", 150, (1, 360), "Yaw rate of a full stick", "settings.pilot_yaw_rate",
         "deg/s", _DEG),
    real(
        "MPC_HOLD_DZ", 0.1, (0, 0.3), "Dead zone of the throttle stick",
        "settings.throttle_deadzone",
    ),
)  # fmt: skip

_RETURN = grouped(
    "Return Mode",
    real(
        "RTL_RETURN_ALT", 30, (0, 3000), "Height above home to return at", "settings.rtl_height",
        "m",
    ),
    real("RTL_DESCEND_ALT", 30, (0, 3000), "Height above home where the landing begins", "", "m"),
    real(
        "RTL_LAND_DELAY", 0, (0, 600), "Wait above home", "settings.rtl_loiter_time", "s"
    ),
    fact(INT32, "RTL_TYPE", 0, "Where to return to", values={0: "Home, or a nearer rally point"}),
    real(
        "MIS_TAKEOFF_ALT", 2.5, (0.3, 1000), "Height of a takeoff that names none",
        "settings.takeoff_height", "m",
    ),
)  # fmt: skip

_ROVER = grouped(
    "Rover Control",
    gain("RO_SPEED_LIM", "v_max", "Speed", "m/s"),
    gain("RO_ACCEL_LIM", "accel_max", "Acceleration, 0 any", "m/s^2"),
    gain("RO_YAW_RATE_LIM", "yaw_rate_max", "Turn rate", "deg/s", _DEG),
    gain("RO_YAW_P", "heading_p", "Heading: turn rate per error", "1/s"),
    gain("HERD_POS_P", "position_p", "Position: speed per error", "1/s"),
    gain("HERD_WHEEL_MAX", "wheel_speed_max", "Wheel speed", "rad/s"),
    constant("RD_WHEEL_TRACK", "half_track", "Distance of the wheels", "m", 0.5),
)

QUADCOPTER_TABLE: tuple[Parameter, ...] = joined(
    _system(2, 4001, "Generic Quadcopter"),
    _COMMANDER,
    _BATTERY,
    _FENCE,
    _MISSION,
    _MULTICOPTER,
    _RETURN,
    _SENSORS,
    QUADCOPTER_GAINS,
    QUADCOPTER_BODY,
)
ROVER_TABLE: tuple[Parameter, ...] = joined(
    _system(10, 50000, "Generic Rover Differential"),
    _COMMANDER,
    _BATTERY,
    _FENCE,
    _MISSION,
    _ROVER,
    _SENSORS,
    ROVER_GAINS,
    ROVER_BODY,
)
