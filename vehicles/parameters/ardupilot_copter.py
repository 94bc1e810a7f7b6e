"""ArduCopter 4.6's parameters, as far as our quadcopter honours or truthfully shows them."""

from math import pi

from ..flight.settings import Action
from . import ardupilot as shared
from . import ardupilot_sensors as sensors
from .body import QUADCOPTER_BODY, QUADCOPTER_GAINS
from .parameter import INT8, INT16, INT32, REAL32, Parameter
from .rows import COPTER_ACTIONS, choice, fact, gain, grouped, int8, int16, int32, joined, real

_CENTI = 0.01
_CDEG = pi / 18000
_MODES = {
    0: "Stabilize", 2: "AltHold", 3: "Auto", 4: "Guided", 5: "Loiter", 6: "RTL", 9: "Land",
    17: "Brake",
}  # fmt: skip

_LIMITS = grouped(
    "WPNAV",
    real("WPNAV_SPEED", 0, (1, 10000), "Horizontal speed", "tuning.v_max", "cm/s", _CENTI),
    real("WPNAV_SPEED_UP", 0, (1, 10000), "Climb rate", "tuning.v_up_max", "cm/s", _CENTI),
    real("WPNAV_SPEED_DN", 0, (1, 10000), "Descent rate", "tuning.v_down_max", "cm/s", _CENTI),
    gain("WPNAV_ACCEL", "accel_max", "Horizontal acceleration, 0 any", "cm/s/s", _CENTI),
    gain("WPNAV_ACCEL_Z", "climb_accel_max", "Vertical acceleration, 0 any", "cm/s/s", _CENTI),
    gain("TKOFF_SLEW_TIME", "spool_time", "From idle to lift-off", "s"),
    real(
        "WPNAV_RADIUS", 200, (5, 10000), "This near a waypoint is reached",
        "settings.waypoint_radius", "cm", _CENTI,
    ),
    choice(
        "WP_YAW_BEHAVIOR", 0, "Nose in GUIDED without a yaw; AUTO faces the way, RTL does not",
        "settings.targets_face_way",
        {0: ("Never change yaw", False), 2: ("Face next waypoint except RTL", True)},
    ),
    int16("ANGLE_MAX", 0, (100, 6800), "Lean angle", "tuning.tilt_limit", "cdeg", _CDEG),
    gain("ATC_SLEW_YAW", "yaw_rate_max", "Yaw rate in every mode", "cdeg/s", _CDEG),
    gain("PSC_VELXY_P", "position_d", "Horizontal: acceleration per velocity error", "1/s"),
    gain("PSC_VELZ_P", "altitude_d", "Vertical: acceleration per velocity error", "1/s"),
)  # fmt: skip

_RETURN = grouped(
    "RTL",
    int32(
        "RTL_ALT", 1500, (0, 300000), "Height above home to return at", "settings.rtl_height",
        "cm", _CENTI,
    ),
    int16(
        "RTL_ALT_FINAL", 0, (0, 30000), "Height above home to stay at, 0 lands",
        "settings.rtl_final_height", "cm", _CENTI,
    ),
    int16(
        "RTL_CLIMB_MIN", 0, (0, 30000), "Climb in any case",
        "settings.rtl_climb_min", "cm", _CENTI,
    ),
    int16(
        "RTL_SPEED", 0, (0, 10000), "Speed, 0 takes WPNAV_SPEED",
        "settings.rtl_speed", "cm/s", _CENTI,
    ),
    int32(
        "RTL_LOIT_TIME", 5000, (0, 600000), "Wait above home",
        "settings.rtl_loiter_time", "ms", 0.001,
    ),
    fact(REAL32, "RTL_CONE_SLOPE", 0, "Less height near home", values={0: "Disabled"}),
    fact(INT8, "RTL_ALT_TYPE", 0, "RTL_ALT is relative to", values={0: "Home"}),
    fact(INT32, "RTL_OPTIONS", 0, "Options: none"),
    int16(
        "LAND_SPEED", 50, (5, 1000), "Speed near the ground",
        "settings.land_speed", "cm/s", _CENTI,
    ),
    int16(
        "LAND_SPEED_HIGH", 0, (0, 2000), "Speed above LAND_ALT_LOW, 0 takes WPNAV_SPEED_DN",
        "settings.land_speed_high", "cm/s", _CENTI,
    ),
    int16(
        "LAND_ALT_LOW", 1000, (0, 30000), "Height where a landing slows down",
        "settings.land_slow_below", "cm", _CENTI,
    ),
    fact(INT8, "LAND_REPOSITION", 0, "Sticks move a landing", values={0: "No"}),
)  # fmt: skip

_PILOT = grouped(
    "PILOT",
    int16(
        "PILOT_SPEED_UP", 250, (10, 2000), "Climb rate",
        "settings.pilot_speed_up", "cm/s", _CENTI,
    ),
    int16(
        "PILOT_SPEED_DN", 0, (0, 2000), "Descent rate, 0 as PILOT_SPEED_UP",
        "settings.pilot_speed_down", "cm/s", _CENTI,
    ),
    int16(
        "PILOT_ACCEL_Z", 250, (10, 2000), "Vertical acceleration", "settings.pilot_accel_z",
        "cm/s/s", _CENTI,
    ),
    real(
        "PILOT_Y_RATE", 202.5, (1, 360), "Yaw rate of a full stick", "settings.pilot_yaw_rate",
        "deg/s", pi / 180,
    ),
    int16(
        "THR_DZ", 100, (0, 300), "Throttle dead zone",
        "settings.throttle_deadzone", "PWM", 0.001,
    ),
    fact(INT16, "PILOT_THR_BHV", 0, "Throttle options: none"),
    fact(INT8, "SIMPLE", 0, "Simple mode"),
    fact(INT8, "SUPER_SIMPLE", 0, "Super simple mode"),
    fact(INT8, "TUNE", 0, "Tuning by transmitter", values={0: "None"}),
)  # fmt: skip

_FAILSAFES = grouped(
    "FS",
    choice(
        "FS_GCS_ENABLE",
        0,
        "Losing the ground station",
        "settings.gcs_action",
        {
            0: ("Disabled", Action.NONE),
            1: ("RTL", Action.RTL),
            5: ("Land", Action.LAND),
            7: ("Brake", Action.HOLD),
        },
    ),
    real("FS_GCS_TIMEOUT", 5, (1, 120), "After so long", "settings.gcs_timeout", "s"),
    choice(
        "FS_THR_ENABLE",
        0,
        "Losing sticks that were in use",
        "settings.pilot_loss_action",
        {0: ("Disabled", Action.NONE), 1: ("RTL", Action.RTL), 3: ("Land", Action.LAND)},
    ),
    int16("FS_THR_VALUE", 975, (910, 1100), "Throttle that says so", "", "PWM"),
    int32(
        "FS_OPTIONS",
        16,
        (0, 31),
        "Exceptions from failsafes",
        "settings.failsafe_options",
        bits={
            0: "Continue in AUTO on loss of sticks",
            1: "Continue in AUTO on loss of the ground station",
            2: "Continue in GUIDED on loss of sticks",
            3: "Continue a landing",
            4: "Continue in pilot-controlled modes on loss of the ground station",
        },
    ),
    int8("FS_EKF_ACTION", 1, (0, 3), "Losing the position estimate"),
    real("FS_EKF_THRESH", 0.8, (0, 1), "Variance that says so"),
    int8("FS_CRASH_CHECK", 1, (0, 1), "Disarming after a crash"),
    choice("BATT_FS_LOW_ACT", 0, "Battery low", "settings.battery.low_action", COPTER_ACTIONS),
    choice(
        "BATT_FS_CRT_ACT", 0, "Battery critical", "settings.battery.critical_action", COPTER_ACTIONS
    ),
)

_FENCE = grouped(
    "FENCE",
    int8(
        "FENCE_TYPE",
        7,
        (0, 15),
        "What the fence is made of",
        "settings.fence.types",
        bits={0: "Max altitude", 1: "Circle", 2: "Fence list", 3: "Min altitude"},
    ),
    choice(
        "FENCE_ACTION",
        1,
        "What a breach does",
        "settings.fence.action",
        {
            0: ("Report only", Action.WARN),
            1: ("RTL or Land", Action.RTL),
            2: ("Always land", Action.LAND),
            4: ("Brake or Land", Action.HOLD),
        },
    ),
    real("FENCE_ALT_MAX", 100, (1, 10000), "Highest above home", "settings.fence.height", "m"),
    real("FENCE_ALT_MIN", -10, (-1000, 1000), "Lowest above home", "settings.fence.floor", "m"),
    fact(INT8, "AVOID_ENABLE", 0, "No braking before the fence", values={0: "None"}),
)

TABLE: tuple[Parameter, ...] = joined(
    grouped("FORMAT", fact(INT16, "FORMAT_VERSION", 120, "Version of this list")),
    shared.IDENTITY,
    grouped(
        "FRAME",
        fact(INT8, "FRAME_CLASS", 1, "Frame class", values={1: "Quad"}),
        fact(INT8, "FRAME_TYPE", 0, "Frame type", values={0: "Plus"}),
    ),
    shared.ARMING,
    grouped(
        "ARMING",
        int8(
            "DISARM_DELAY",
            10,
            (0, 127),
            "Armed on the ground for so long disarms, 0 never",
            "settings.disarm_delay",
            "s",
        ),
        int8(
            "INITIAL_MODE", 0, (0, 127), "Mode at boot", "settings.initial_mode", values=_MODES,
            codes={number: number for number in _MODES}, reboot=True,
        ),
    ),
    grouped(
        "GUID",
        real(
            "GUID_TIMEOUT", 3, (0.1, 3600), "Seconds until a velocity target expires",
            "settings.guided_timeout", "s",
        ),
        int32(
            "GUID_OPTIONS", 0, (0, 8), "Options of GUIDED", "settings.guided_options",
            bits={3: "SET_ATTITUDE_TARGET's thrust is thrust, not a climb rate"},
        ),
        real(
            "PILOT_TKOFF_ALT", 0, (0, 1000), "Height of a takeoff by stick", "", "cm",
        ),
    ),
    _LIMITS,
    _RETURN,
    _PILOT,
    _FAILSAFES,
    shared.FENCE,
    _FENCE,
    shared.BATTERY,
    shared.MISSIONS,
    shared.PILOT_LINK,
    shared.mode_switch("FLTMODE", 5, _MODES),
    shared.radio_channels(),
    shared.servos({n: (32 + n, f"Motor{n}") for n in range(1, 5)}),
    grouped(
        "MOT",
        int16("MOT_PWM_MIN", 1000, (0, 2000), "Lowest pulse", "", "PWM"),
        int16("MOT_PWM_MAX", 2000, (0, 2000), "Highest pulse", "", "PWM"),
        fact(INT8, "MOT_PWM_TYPE", 0, "Output", values={0: "Normal"}),
    ),
    shared.STREAMS,
    sensors.SENSORS,
    shared.HOUSEKEEPING,
    sensors.ABSENT,
    QUADCOPTER_GAINS,
    QUADCOPTER_BODY,
)  # fmt: skip
