"""How a vehicle presents itself: one table for each flight stack that clients know.

The core is neutral; whatever differs between flight stacks and is visible on MAVLink is a field
here (`mavlink.io` and the stacks' own documentation; numbers of ArduPilot 4.6 and PX4 1.16).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from ...transport.mavlink import mav
from .modes import Mode

ModeRow = tuple[int, str]
"""`custom_mode` and the name that ground stations show."""


@dataclass(frozen=True, slots=True)
class ModeTable:
    """The modes of one kind of vehicle, and what it calls itself."""

    firmware: str
    mav_type: int
    rows: Mapping[Mode, ModeRow]
    boot: Mode
    refused: Mapping[int, str] = field(default_factory=dict)
    """Modes of the real flight stack that we do not fly, by number: refused by name."""
    not_armable: frozenset[Mode] = frozenset()
    auto_needs_mission: bool = False  # also disarmed

    def number(self, mode: Mode) -> int:
        """Return the `custom_mode` of `mode`."""
        return self.rows[mode][0]

    def name(self, mode: Mode) -> str:
        """Return what ground stations call `mode`."""
        return self.rows[mode][1]

    def mode(self, number: int) -> Mode | None:
        """Return the mode with this `custom_mode`, None when the vehicle has none such."""
        return next((m for m, (n, _) in self.rows.items() if n == number), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Personality:
    """What clients can tell of a flight stack."""

    name: str
    autopilot: int  # MAV_AUTOPILOT
    firmware: tuple[int, int, int]
    banner: str  # said when parameters are listed; "" says nothing
    modes: Mapping[str, ModeTable]  # by kind of vehicle
    sub_modes: bool = False  # DO_SET_MODE has main mode and sub mode in param2 and param3
    bytewise_parameters: bool = False  # integers travel as bits, not as floats
    capabilities: int = 0  # MAV_PROTOCOL_CAPABILITY beside those of every vehicle
    home_is_item_0: bool = True  # mission lists begin with home
    asks_with_mission_request_int: bool = False
    altitudes_are_amsl: bool = False  # in a COMMAND_LONG and NAV_TAKEOFF; else above home
    takeoff_in_any_frame: bool = False  # as COMMAND_INT; else in GLOBAL_RELATIVE_ALT only
    takeoff_enters_mode: bool = False  # NAV_TAKEOFF works disarmed, and is a mode of its own
    reposition_mode: Mode = Mode.GUIDED
    loiter_mode: Mode = Mode.LOITER  # what NAV_LOITER_UNLIM leads to
    no_yaw_is_nan: bool = False  # in DO_REPOSITION; else 0 means none, too
    targets_take_off: bool = False  # a target above the ground takes off
    missions_take_off: bool = False  # a mission starts when armed, with any item
    guided_needs_stream: bool = False  # setpoints before the mode, and a failsafe without them
    targets_heard_in_any_mode: bool = False
    thrust_is_climb_rate: bool = True  # in SET_ATTITUDE_TARGET, unless GUID_OPTIONS says so
    sticks_of_one_station: bool = False  # the pilot is SYSID_MYGCS and nobody else
    throttle_reverses: bool = True  # MANUAL_CONTROL's z is -1000..1000 on a rover, else 0..1000
    acks_set_mode: bool = False  # the legacy SET_MODE message is acknowledged
    answers_any_component: bool = False  # commands to components that we do not have
    answers_ping: bool = True
    estimator_message: int = mav.MAVLINK_MSG_ID_ESTIMATOR_STATUS
    arming_refusal: int = mav.MAV_RESULT_FAILED
    mode_refusal: int = mav.MAV_RESULT_FAILED
    no_such_mode: str = "No such mode {}"
    unknown_message_refusal: int = mav.MAV_RESULT_FAILED  # REQUEST_MESSAGE of what we lack
    unknown_interval_refusal: int = mav.MAV_RESULT_DENIED
    unknown_interval_text: str = "No ap_message for mavlink id ({})"
    legacy_requests: bool = True  # GET_HOME_POSITION, REQUEST_AUTOPILOT_CAPABILITIES


_ARDUCOPTER = ModeTable(
    firmware="ArduCopter",
    mav_type=mav.MAV_TYPE_QUADROTOR,
    rows={
        Mode.STABILIZE: (0, "STABILIZE"),
        Mode.ALT_HOLD: (2, "ALT_HOLD"),
        Mode.AUTO: (3, "AUTO"),
        Mode.GUIDED: (4, "GUIDED"),
        Mode.LOITER: (5, "LOITER"),
        Mode.RTL: (6, "RTL"),
        Mode.LAND: (9, "LAND"),
        Mode.HOLD: (17, "BRAKE"),
    },
    boot=Mode.STABILIZE,
    refused={
        1: "ACRO",
        7: "CIRCLE",
        11: "DRIFT",
        13: "SPORT",
        14: "FLIP",
        15: "AUTOTUNE",
        16: "POSHOLD",
        18: "THROW",
        19: "AVOID_ADSB",
        20: "GUIDED_NOGPS",
        21: "SMART_RTL",
        22: "FLOWHOLD",
        23: "FOLLOW",
        24: "ZIGZAG",
        25: "SYSTEMID",
        26: "AUTOROTATE",
        27: "AUTO_RTL",
        28: "TURTLE",
    },
    not_armable=frozenset({Mode.RTL}),
)
_ARDUROVER = ModeTable(
    firmware="ArduRover",
    mav_type=mav.MAV_TYPE_GROUND_ROVER,
    rows={
        Mode.MANUAL: (0, "MANUAL"),
        Mode.HOLD: (4, "HOLD"),
        Mode.LOITER: (5, "LOITER"),
        Mode.AUTO: (10, "AUTO"),
        Mode.RTL: (11, "RTL"),
        Mode.GUIDED: (15, "GUIDED"),
    },
    auto_needs_mission=True,
    boot=Mode.MANUAL,
    refused={
        1: "ACRO",
        3: "STEERING",
        6: "FOLLOW",
        7: "SIMPLE",
        8: "DOCK",
        9: "CIRCLE",
        12: "SMART_RTL",
        16: "INITIALISING",
    },
    not_armable=frozenset({Mode.RTL}),
)
ARDUPILOT = Personality(
    name="ardupilot",
    autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA,
    firmware=(4, 6, 3),
    banner="V4.6.3 (mavherd)",
    modes={"quadcopter": _ARDUCOPTER, "rover": _ARDUROVER},
    sticks_of_one_station=True,
    answers_any_component=True,
    answers_ping=False,
    estimator_message=mav.MAVLINK_MSG_ID_EKF_STATUS_REPORT,
)


def _px4(main: int, sub: int = 0) -> int:
    return main << 16 | sub << 24


_PX4_COMMON: dict[Mode, ModeRow] = {
    Mode.HOLD: (_px4(4, 3), "HOLD"),
    Mode.AUTO: (_px4(4, 4), "MISSION"),
    Mode.RTL: (_px4(4, 5), "RTL"),
    Mode.GUIDED: (_px4(6), "OFFBOARD"),
}
_PX4_REFUSED = {
    _px4(4, 1): "READY",
    _px4(4, 8): "FOLLOW_TARGET",
    _px4(4, 9): "PRECLAND",
    _px4(5): "ACRO",
    _px4(8): "RATTITUDE",
    _px4(3, 1): "ORBIT",
}
PX4 = Personality(
    name="px4",
    autopilot=mav.MAV_AUTOPILOT_PX4,
    firmware=(1, 16, 0),
    banner="",
    modes={
        "quadcopter": ModeTable(
            firmware="PX4",
            mav_type=mav.MAV_TYPE_QUADROTOR,
            rows={
                Mode.STABILIZE: (_px4(7), "STABILIZED"),
                Mode.ALT_HOLD: (_px4(2), "ALTCTL"),
                Mode.LOITER: (_px4(3), "POSCTL"),
                Mode.TAKEOFF: (_px4(4, 2), "TAKEOFF"),
                Mode.LAND: (_px4(4, 6), "LAND"),
                **_PX4_COMMON,
            },
            boot=Mode.HOLD,
            refused={_px4(1): "MANUAL", **_PX4_REFUSED},
            not_armable=frozenset({Mode.RTL}),
        ),
        "rover": ModeTable(
            firmware="PX4",
            mav_type=mav.MAV_TYPE_GROUND_ROVER,
            rows={
                Mode.MANUAL: (_px4(1), "MANUAL"),
                Mode.LOITER: (_px4(3), "POSCTL"),
                **_PX4_COMMON,
            },
            boot=Mode.HOLD,
            refused={_px4(2): "ALTCTL", _px4(7): "STABILIZED", **_PX4_REFUSED},
            not_armable=frozenset({Mode.RTL}),
        ),
    },
    sub_modes=True,
    bytewise_parameters=True,
    capabilities=mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE,
    home_is_item_0=False,
    asks_with_mission_request_int=True,
    altitudes_are_amsl=True,
    takeoff_in_any_frame=True,
    takeoff_enters_mode=True,
    reposition_mode=Mode.HOLD,
    loiter_mode=Mode.HOLD,
    no_yaw_is_nan=True,
    targets_take_off=True,
    missions_take_off=True,
    guided_needs_stream=True,
    targets_heard_in_any_mode=True,
    thrust_is_climb_rate=False,
    throttle_reverses=False,
    acks_set_mode=True,
    arming_refusal=mav.MAV_RESULT_TEMPORARILY_REJECTED,
    mode_refusal=mav.MAV_RESULT_TEMPORARILY_REJECTED,
    no_such_mode="Unsupported main mode",
    unknown_message_refusal=mav.MAV_RESULT_DENIED,
    unknown_interval_refusal=mav.MAV_RESULT_FAILED,
    unknown_interval_text="",
    legacy_requests=False,
)
GENERIC = replace(
    ARDUPILOT,
    name="generic",
    autopilot=mav.MAV_AUTOPILOT_GENERIC,
    banner="",
    capabilities=mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST,
    home_is_item_0=False,
    asks_with_mission_request_int=True,
    takeoff_in_any_frame=True,
    no_yaw_is_nan=True,
    sticks_of_one_station=False,
    acks_set_mode=True,
    answers_any_component=False,
    answers_ping=True,
    estimator_message=mav.MAVLINK_MSG_ID_ESTIMATOR_STATUS,
)

PERSONALITIES = {p.name: p for p in (ARDUPILOT, PX4, GENERIC)}
