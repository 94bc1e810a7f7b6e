"""Which mission items are flown, by which vehicle, and how much of each: the one table of it.

Upload checks, AUTO and the conformance document all read this table. A command that is not in
it is refused with MAV_MISSION_UNSUPPORTED.
"""

from dataclasses import dataclass, replace
from enum import Enum

from ...transport.mavlink import mav
from .items import MissionType

_COPTER = frozenset({"quadcopter"})
_ROVER = frozenset({"rover"})
_BOTH = _COPTER | _ROVER
_YAW = frozenset({4})  # param4 may be NaN: keep or face the way


class Phase(Enum):
    """When an item is done: in its turn, as a wait between DO commands, or at once."""

    NAV = "navigation"
    CONDITION = "condition"
    DO = "do"
    SHAPE = "shape"  # of a fence or a rally list


class Effect(Enum):
    """What becomes of an item."""

    FLOWN = "flown"
    NONE = "accepted without effect"


@dataclass(frozen=True, slots=True, kw_only=True)
class Supported:
    """One command of mission, fence or rally lists."""

    command: int
    text: str  # in "Mission: 1 Takeoff", as ArduPilot words it
    phase: Phase
    note: str  # what is honoured, for people
    kinds: frozenset[str] = _BOTH
    located: bool = False  # x, y and z are a place
    effect: Effect = Effect.FLOWN
    partly: bool = False  # less than the flight stacks do; the note says how
    may_be_nan: frozenset[int] = frozenset()  # numbers of parameters; unused ones always may
    used: frozenset[int] = frozenset()  # parameters 1..4 that mean something
    mission_type: MissionType = MissionType.MISSION

    @property
    def name(self) -> str:
        """Return the command's MAVLink name."""
        return str(mav.enums["MAV_CMD"][self.command].name)


def _nav(
    command: int, text: str, note: str, used: tuple[int, ...] = (), **more: object
) -> Supported:
    located = bool(more.pop("located", True))
    return Supported(
        command=command, text=text, phase=Phase.NAV, note=note, located=located,
        used=frozenset(used), may_be_nan=_YAW, **more,  # type: ignore[arg-type]
    )  # fmt: skip


def _camera(command: int, text: str) -> Supported:
    return Supported(
        command=command,
        text=text,
        phase=Phase.DO,
        effect=Effect.NONE,
        note="there is no camera or gimbal; survey plans stay flyable",
    )


def _shape(command: int, note: str, kind: MissionType, used: tuple[int, ...] = ()) -> Supported:
    return Supported(
        command=command, text="", phase=Phase.SHAPE, note=note, located=True,
        used=frozenset(used), mission_type=kind,
    )  # fmt: skip


def _kept(command: int, note: str, kind: MissionType) -> Supported:
    return replace(_shape(command, note, kind), effect=Effect.NONE)


_FENCE, _RALLY = MissionType.FENCE, MissionType.RALLY
_ROWS = (
    _nav(16, "WP", "param1 hold time (s), param2 acceptance radius (m); yaw ignored", (1, 2)),
    _nav(17, "LoitUnlim", "stays there until told otherwise; a rover stops there"),
    _nav(18, "LoitTurns", "param1 turns, param3 radius (m; negative: left, 0: 10 m)", (1, 3)),
    _nav(19, "LoitTime", "param1 seconds at the place; a rover stops there", (1,)),
    _nav(20, "RTL", "returns home as mode RTL does", located=False),
    _nav(21, "Land", "flies to the place if one is given, lands, disarms", kinds=_COPTER),
    _nav(22, "Takeoff", "climbs to z from where it stands; x and y ignored", kinds=_COPTER),
    _nav(
        82, "SplineWP", "flown as a straight waypoint; param1 hold time (s)", (1,),
        kinds=_COPTER, partly=True,
    ),
    _nav(84, "VTOLTakeoff", "as NAV_TAKEOFF", kinds=_COPTER),
    _nav(85, "VTOLLand", "as NAV_LAND", kinds=_COPTER),
    _nav(
        93, "Delay", "param1 seconds; times of day are refused", (1,), located=False, partly=True
    ),
    Supported(
        command=112, text="CondDelay", phase=Phase.CONDITION, used=frozenset({1}),
        note="param1 seconds before the next DO command",
    ),
    Supported(
        command=114, text="CondDist", phase=Phase.CONDITION, used=frozenset({1}),
        note="param1 metres from the next waypoint, before the next DO command",
    ),
    Supported(
        command=115, text="CondYaw", phase=Phase.CONDITION, used=frozenset({1, 3, 4}),
        kinds=_COPTER,
        note="param1 degrees, param2 rate (deg/s, at most 60), param3 direction, param4 relative",
    ),
    Supported(
        command=177, text="Jump", phase=Phase.DO, used=frozenset({1, 2}),
        note="param1 item, param2 how often (-1: for ever)",
    ),
    Supported(
        command=178, text="ChangeSpeed", phase=Phase.DO, used=frozenset({1, 2}),
        note="param1 0 or 1 horizontal, 2 climb, 3 descent; param2 m/s, -1 as it is, -2 as tuned",
    ),
    Supported(
        command=179, text="SetHome", phase=Phase.DO, used=frozenset({1}), located=True,
        note="param1 1: here; else x, y, z",
    ),
    Supported(
        command=189, text="LandStart", phase=Phase.DO, effect=Effect.NONE, located=True,
        note="a mark for ground stations",
    ),
    Supported(
        command=195, text="SetROI", phase=Phase.DO, located=True,
        note="a copter points its nose there; a rover does nothing", partly=True,
    ),
    Supported(
        command=197, text="SetROI", phase=Phase.DO, note="the nose faces the way again",
        partly=True,
    ),
    Supported(
        command=201, text="SetROI", phase=Phase.DO, located=True,
        note="as DO_SET_ROI_LOCATION; 0, 0 as DO_SET_ROI_NONE", partly=True,
    ),
    _camera(203, "DigiCamCtrl"),
    _camera(204, "MountConfig"),
    _camera(205, "MountControl"),
    _camera(206, "SetCamTrigDst"),
    _camera(214, "SetCamTrigInt"),
    _camera(530, "SetCamMode"),
    _camera(531, "SetCamZoom"),
    _camera(532, "SetCamFocus"),
    _camera(1000, "GimbalPitchYaw"),
    _camera(1001, "GimbalManager"),
    _camera(2000, "ImageStartCap"),
    _camera(2001, "ImageStopCap"),
    _camera(2500, "VideoStartCap"),
    _camera(2501, "VideoStopCap"),
    _kept(5000, "kept and given back: a breach leads home", _FENCE),
    _shape(5001, "param1 number of corners of this polygon, all of them in a row", _FENCE, (1,)),
    _shape(5002, "param1 number of corners of this polygon, all of them in a row", _FENCE, (1,)),
    _shape(5003, "param1 radius (m)", _FENCE, (1,)),
    _shape(5004, "param1 radius (m)", _FENCE, (1,)),
    _shape(5100, "RTL goes to the nearest, home included; altitudes ignored", _RALLY),
)  # fmt: skip

SUPPORTED: dict[int, Supported] = {row.command: row for row in _ROWS}

REFUSED: dict[int, str] = {
    23: "local frames are not for missions",
    24: "local frames are not for missions",
    30: "for fixed wings",
    31: "for fixed wings",
    92: "no mission hands over to a companion computer",
    94: "there is nothing to place",
    113: "for fixed wings",
    176: "a mission does not change the mode",
    180: "a mission does not change parameters",
    181: "there is no relay",
    182: "there is no relay",
    183: "there is no free servo",
    184: "there is no free servo",
    207: "a mission does not switch the fence",
    208: "there is no parachute",
    211: "there is no gripper",
    222: "no mission hands over to a companion computer",
}
"""Commands that flight stacks have and we refuse, each with the reason."""


def supported(command: int, kind: str, mission_type: int) -> Supported | None:
    """Return the row of `command` where this kind of vehicle has it in this list."""
    row = SUPPORTED.get(command)
    if row is None or kind not in row.kinds or row.mission_type != mission_type:
        return None
    return row


def is_located(command: int) -> bool:
    """Return whether x and y of this command are a place."""
    row = SUPPORTED.get(command)
    return row is None or row.located
