"""Parameters that ArduPilot 4.6's copters and rovers share, under its names, types and units."""

from ..flight.settings import STREAM_CHANNELS, STREAM_GROUPS
from .parameter import INT8, INT16, INT32, Parameter
from .rows import fact, grouped, int8, int16, int32, live, real, switch

_STREAMS = {
    "RAW_SENS": "raw sensors",
    "EXT_STAT": "status, GPS, mission and fence",
    "RC_CHAN": "radio and servo channels",
    "RAW_CTRL": "controller outputs",
    "POSITION": "positions",
    "EXTRA1": "attitude",
    "EXTRA2": "VFR_HUD",
    "EXTRA3": "battery, clock, estimator and the like",
    "PARAMS": "parameters",
    "ADSB": "other aircraft",
}

IDENTITY = [
    *grouped("SYSID", live(INT16, "SYSID_THISMAV", 1, "MAVLink system id")),
    *grouped(
        "SYSID",
        int16(
            "SYSID_MYGCS",
            255,
            (1, 255),
            "System id of the ground station whose sticks and heartbeats count",
            "settings.gcs_system_id",
        ),
        switch("SYSID_ENFORCE", 0, "Obey that ground station only", "settings.gcs_enforced"),
    ),
]

ARMING = grouped(
    "ARMING",
    int32(
        "ARMING_CHECK",
        1,
        (0, 1048575),
        "Checks before arming: 0 none, 1 all, others a mask",
        "settings.arming_checks",
    ),
    int8(
        "ARMING_REQUIRE",
        1,
        (0, 2),
        "Whether motors wait for arming",
        "settings.arming_required",
        values={0: "Disabled", 1: "Yes", 2: "Yes, zero output when disarmed"},
        reboot=True,
    ),
    fact(INT8, "ARMING_RUDDER", 0, "Arming by stick", values={0: "Disabled"}),
)

BATTERY = grouped(
    "BATT",
    int8(
        "BATT_MONITOR",
        4,
        (0, 4),
        "What is measured of the battery",
        "settings.battery.monitor",
        codes={0: 0, 4: 4},
        values={0: "Disabled", 4: "Voltage and current"},
    ),
    int32("BATT_CAPACITY", 3300, (0, 1e6), "Capacity", "settings.battery.capacity_mah", "mAh"),
    real("BATT_LOW_VOLT", 10.5, (0, 120), "Low below this", "settings.battery.low_voltage", "V"),
    real("BATT_LOW_MAH", 0, (0, 1e6), "Low below this", "settings.battery.low_mah", "mAh"),
    int8("BATT_LOW_TIMER", 10, (0, 120), "Low for so long", "settings.battery.low_timer", "s"),
    real(
        "BATT_CRT_VOLT",
        0,
        (0, 120),
        "Critical below this",
        "settings.battery.critical_voltage",
        "V",
    ),
    real(
        "BATT_CRT_MAH", 0, (0, 1e6), "Critical below this", "settings.battery.critical_mah", "mAh"
    ),
    real("BATT_ARM_VOLT", 0, (0, 120), "Needed to arm", "settings.battery.arming_voltage", "V"),
    int32("BATT_ARM_MAH", 0, (0, 1e6), "Needed to arm", "settings.battery.arming_mah", "mAh"),
    fact(INT8, "BATT_FS_VOLTSRC", 0, "Voltage compared", values={0: "Raw"}),
    int8("BATT_VOLT_PIN", 13, (-1, 127), "Pin of the voltage"),
    int8("BATT_CURR_PIN", 12, (-1, 127), "Pin of the current"),
    real("BATT_VOLT_MULT", 10.1, (0, 1000), "Volts over volts at the pin"),
    real("BATT_AMP_PERVLT", 17, (0, 1000), "Amperes per volt at the pin", "", "A/V"),
    real("BATT_AMP_OFFSET", 0, (-10, 10), "Voltage at no current", "", "V"),
    int32("BATT_SERIAL_NUM", -1, None, "Serial number"),
    fact(INT8, "BATT2_MONITOR", 0, "A second battery", values={0: "None"}),
)

FENCE = grouped(
    "FENCE",
    switch("FENCE_ENABLE", 0, "The fence counts", "settings.fence.enabled"),
    real(
        "FENCE_RADIUS", 300, (1, 100000), "Radius of the circle around home",
        "settings.fence.radius", "m",
    ),
    real(
        "FENCE_MARGIN", 2, (0, 100), "What RTL keeps below FENCE_ALT_MAX, a rover from the edge",
        "settings.fence.margin", "m",
    ),
    live(INT8, "FENCE_TOTAL", 0, "Items of the fence list"),
)  # fmt: skip

MISSIONS = grouped(
    "MIS",
    live(INT16, "MIS_TOTAL", 0, "Items of the mission, home included"),
    int8(
        "MIS_RESTART",
        0,
        (0, 1),
        "What entering AUTO does",
        "settings.mission_restart",
        values={0: "Resume mission", 1: "Restart mission"},
    ),
    fact(INT16, "MIS_OPTIONS", 0, "Mission options: none"),
    live(INT8, "RALLY_TOTAL", 0, "Rally points"),
    real(
        "RALLY_LIMIT_KM", 0.3, (0, 1000), "Farther rally points are left out; 0: none is",
        "settings.rally_limit", "km", 1000.0,
    ),
    switch("RALLY_INCL_HOME", 1, "Home competes with the rally points", "settings.rally_home"),
)  # fmt: skip

PILOT_LINK = grouped(
    "RC",
    real(
        "RC_OVERRIDE_TIME",
        3,
        (0, 120),
        "Seconds until MANUAL_CONTROL and RC_CHANNELS_OVERRIDE expire",
        "settings.pilot_timeout",
        "s",
    ),
    int32("RC_OPTIONS", 32, (0, 65535), "Radio options"),
    int32("RC_PROTOCOLS", 1, None, "Radio protocols"),
    int8("RCMAP_ROLL", 1, (1, 16), "Channel of roll or steering"),
    int8("RCMAP_PITCH", 2, (1, 16), "Channel of pitch"),
    int8("RCMAP_THROTTLE", 3, (1, 16), "Channel of throttle"),
    int8("RCMAP_YAW", 4, (1, 16), "Channel of yaw"),
)


def radio_channels(count: int = 8) -> list[Parameter]:
    """Return the calibration of the first `count` radio channels."""
    return [
        parameter
        for n in range(1, count + 1)
        for parameter in grouped(
            f"RC{n}",
            int16(f"RC{n}_MIN", 1000, (800, 2200), "Lowest pulse", "", "PWM"),
            int16(f"RC{n}_TRIM", 1500, (800, 2200), "Pulse at rest", "", "PWM"),
            int16(f"RC{n}_MAX", 2000, (800, 2200), "Highest pulse", "", "PWM"),
            int8(f"RC{n}_REVERSED", 0, (0, 1), "Turned round"),
            int16(f"RC{n}_DZ", 0, (0, 200), "Dead zone", "", "PWM"),
            int16(f"RC{n}_OPTION", 0, (0, 1000), "What the switch does"),
        )
    ]


def servos(functions: dict[int, tuple[int, str]]) -> list[Parameter]:
    """Return the servo outputs; `functions` by output: SERVOn_FUNCTION and what that is."""
    return [
        parameter
        for n, (function, label) in functions.items()
        for parameter in grouped(
            f"SERVO{n}",
            fact(INT16, f"SERVO{n}_FUNCTION", function, f"Output: {label}"),
            int16(f"SERVO{n}_MIN", 1000, (500, 2200), "Lowest pulse", "", "PWM"),
            int16(f"SERVO{n}_TRIM", 1500, (500, 2200), "Pulse at rest", "", "PWM"),
            int16(f"SERVO{n}_MAX", 2000, (500, 2200), "Highest pulse", "", "PWM"),
            int8(f"SERVO{n}_REVERSED", 0, (0, 1), "Turned round"),
        )
    ]


def mode_switch(prefix: str, channel: int, labels: dict[int, str]) -> list[Parameter]:
    """Return the mode switch of a transmitter: `prefix`1 to 6 and its channel."""
    return grouped(
        prefix,
        *(
            int8(f"{prefix}{n}", 0, (0, 127), f"Mode at position {n} of the switch", values=labels)
            for n in range(1, 7)
        ),
        int8(f"{prefix}_CH", channel, (0, 16), "Channel of the mode switch"),
    )


STREAMS = [
    parameter
    for channel in range(STREAM_CHANNELS)
    for parameter in grouped(
        f"SR{channel}",
        *(
            int16(
                f"SR{channel}_{group}",
                0,
                (-1, 100),
                f"Rate of {what}: 0 leaves each message at this vehicle's own rate, -1 sends none",
                f"settings.stream_rates.{channel}.{group}" if group in STREAM_GROUPS else "",
                "Hz",
            )
            for group, what in _STREAMS.items()
        ),
    )
]

HOUSEKEEPING = [
    *grouped(
        "STAT",
        live(INT16, "STAT_BOOTCNT", 1, "Boots"),
        live(INT32, "STAT_RUNTIME", 0, "Time since boot", unit="s"),
    ),
    *grouped(
        "SERIAL",
        fact(INT8, "SERIAL0_PROTOCOL", 2, "First link", values={2: "MAVLink2"}),
        int32("SERIAL0_BAUD", 115, None, "Speed of the first link"),
        int8("TELEM_DELAY", 0, (0, 30), "Silence after boot", "", "s"),
    ),
    *grouped(
        "LOG",
        fact(INT8, "LOG_BACKEND_TYPE", 0, "Logs on board", values={0: "None"}),
        int32("LOG_BITMASK", 65535, None, "What is logged"),
        int8("LOG_DISARMED", 0, (0, 3), "Logging while disarmed"),
    ),
    *grouped(
        "SIM",
        real(
            "SIM_BATT_VOLTAGE",
            12.6,
            (1, 120),
            "Voltage of the full battery",
            "settings.battery.full_voltage",
            "V",
        ),
        real(
            "HERD_BATT_CHARGE",
            1,
            (0, 1),
            "Charge of the battery: setting it puts in another one",
            "settings.battery.charge",
        ),
        fact(INT16, "SIM_RATE_HZ", 500, "Steps of the physics", unit="Hz"),
    ),
]
