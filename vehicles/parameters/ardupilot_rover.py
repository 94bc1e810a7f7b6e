"""ArduRover 4.6's parameters, as far as our rover honours or truthfully shows them."""

from math import pi

from ..flight.settings import Action
from . import ardupilot as shared
from . import ardupilot_sensors as sensors
from .body import HALF_TRACK, ROVER_BODY, ROVER_GAINS
from .parameter import INT8, INT16, Parameter
from .rows import (
    ROVER_ACTIONS,
    choice,
    fact,
    gain,
    grouped,
    int8,
    int16,
    int32,
    joined,
    real,
    switch,
)

_MODES = {0: "Manual", 4: "Hold", 5: "Loiter", 10: "Auto", 11: "RTL", 15: "Guided"}

_DRIVING = grouped(
    "WP",
    real("WP_SPEED", 0, (0.01, 100), "Speed", "tuning.v_max", "m/s"),
    real(
        "CRUISE_SPEED", 0, (0, 100), "Speed of full throttle, 0 takes WP_SPEED",
        "settings.cruise_speed", "m/s", follows="tuning.v_max",
    ),
    fact(INT8, "CRUISE_THROTTLE", 100, "Throttle of CRUISE_SPEED", unit="%"),
    real(
        "WP_RADIUS", 2, (0.05, 100), "This near a waypoint is reached",
        "settings.waypoint_radius", "m",
    ),
    real("RTL_SPEED", 0, (0, 100), "Speed of RTL, 0 takes WP_SPEED", "settings.rtl_speed", "m/s"),
    gain("ATC_ACCEL_MAX", "accel_max", "Acceleration, 0 any", "m/s/s"),
    gain("ATC_STR_ANG_P", "heading_p", "Heading: turn rate per error", "1/s"),
    gain("ATC_STR_RAT_MAX", "yaw_rate_max", "Turn rate in every mode", "deg/s", pi / 180),
    gain("PSC_POS_P", "position_p", "Position: speed per error", "1/s"),
    fact(INT8, "WRC_ENABLE", 1, "Each wheel has its own speed controller"),
    gain("WRC_RATE_MAX", "wheel_speed_max", "Wheel speed", "rad/s"),
    fact(INT8, "PILOT_STEER_TYPE", 0, "Steering stick", values={0: "Default"}),
)  # fmt: skip

_FAILSAFES = grouped(
    "FS",
    choice(
        "FS_ACTION",
        2,
        "What a failsafe does",
        "settings.gcs_action",
        {0: ("Nothing", Action.NONE), 1: ("RTL", Action.RTL), 2: ("Hold", Action.HOLD)},
    ),
    switch("FS_GCS_ENABLE", 0, "Losing the ground station counts", "settings.gcs_failsafe"),
    real("FS_GCS_TIMEOUT", 5, (1, 120), "After so long", "settings.gcs_timeout", "s"),
    choice(
        "FS_THR_ENABLE",
        0,
        "Losing sticks that were in use",
        "settings.pilot_loss_action",
        {0: ("Disabled", Action.NONE), 1: ("Hold", Action.HOLD)},
    ),
    int16("FS_THR_VALUE", 910, (910, 1100), "Throttle that says so", "", "PWM"),
    real("FS_TIMEOUT", 1.5, (1, 100), "After so long", "settings.pilot_loss_timeout", "s"),
    int32(
        "FS_OPTIONS", 0, (0, 1), "Exceptions from failsafes", "settings.failsafe_options",
        bits={0: "Failsafes count in HOLD, too"},
    ),
    int8("FS_EKF_ACTION", 1, (0, 3), "Losing the position estimate"),
    real("FS_EKF_THRESH", 0.8, (0, 1), "Variance that says so"),
    int8("FS_CRASH_CHECK", 0, (0, 2), "Stopping after a crash"),
    choice("BATT_FS_LOW_ACT", 0, "Battery low", "settings.battery.low_action", ROVER_ACTIONS),
    choice(
        "BATT_FS_CRT_ACT", 0, "Battery critical", "settings.battery.critical_action", ROVER_ACTIONS
    ),
)  # fmt: skip

_FENCE = grouped(
    "FENCE",
    int8(
        "FENCE_TYPE", 6, (0, 15), "What the fence is made of", "settings.fence.types",
        bits={
            0: "Max altitude (of no effect)", 1: "Circle", 2: "Fence list",
            3: "Min altitude (of no effect)",
        },
    ),
    choice(
        "FENCE_ACTION",
        1,
        "What a breach does",
        "settings.fence.action",
        {
            0: ("Report only", Action.WARN),
            1: ("RTL or Hold", Action.RTL),
            2: ("Hold", Action.HOLD),
        },
    ),
    int8(
        "AVOID_ENABLE", 3, (0, 7), "What the rover brakes before in GUIDED",
        "settings.fence.avoidance",
        bits={0: "Fence", 1: "Proximity sensors", 2: "Beacons"},
    ),
)  # fmt: skip

TABLE: tuple[Parameter, ...] = joined(
    grouped("FORMAT", fact(INT16, "FORMAT_VERSION", 16, "Version of this list")),
    shared.IDENTITY,
    grouped(
        "FRAME",
        fact(INT8, "FRAME_CLASS", 1, "Frame class", values={1: "Rover"}),
        fact(INT8, "FRAME_TYPE", 0, "Frame type", values={0: "Undefined"}),
    ),
    shared.ARMING,
    grouped(
        "ARMING",
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
    ),
    _DRIVING,
    _FAILSAFES,
    shared.FENCE,
    _FENCE,
    shared.BATTERY,
    shared.MISSIONS,
    shared.PILOT_LINK,
    shared.mode_switch("MODE", 8, _MODES),
    shared.radio_channels(),
    shared.servos({1: (73, "ThrottleLeft"), 3: (74, "ThrottleRight")}),
    grouped("MOT", fact(INT8, "MOT_PWM_TYPE", 0, "Output", values={0: "Normal"})),
    shared.STREAMS,
    sensors.SENSORS,
    shared.HOUSEKEEPING,
    sensors.ABSENT,
    ROVER_GAINS,
    HALF_TRACK,
    ROVER_BODY,
)  # fmt: skip
