"""What each flight stack says, and by which rules it goes, when something is lost or breached.

Texts are those of ArduPilot 4.6 and PX4 1.16, because people and scripts look for them. One
`Wording` for each stack and kind of vehicle; the code that reads it knows no stack.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from math import inf
from typing import NamedTuple

from ...transport.mavlink import mav
from .modes import Mode

CRITICAL: int = mav.MAV_SEVERITY_CRITICAL
WARNING: int = mav.MAV_SEVERITY_WARNING
NOTICE: int = mav.MAV_SEVERITY_NOTICE
INFO: int = mav.MAV_SEVERITY_INFO


class Line(NamedTuple):
    """A STATUSTEXT."""

    severity: int
    text: str


_FLYING = Line(WARNING, "Disarm: in the air")


class Loss(Enum):
    """What a vehicle can lose."""

    STATION = "heartbeats of the ground station"
    PILOT = "sticks that were in use"
    SETPOINTS = "the stream of setpoints that OFFBOARD needs"
    BATTERY_LOW = "charge"
    BATTERY_CRITICAL = "nearly all charge"


class Disarming(Enum):
    """Why a vehicle is disarmed."""

    COMMAND = "somebody said so"
    LANDED = "it has landed"
    IDLE = "it did not take off"
    FAILSAFE = "a failsafe said so"


class Exemption(NamedTuple):
    """Modes that go on in spite of a loss, when the user has set this bit of FS_OPTIONS."""

    bit: int
    modes: frozenset[Mode]
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """How one loss is told and met."""

    noticed: Line | None = None  # said whatever is done about it
    acted: Line | None = None  # said when something is done
    cleared: Line | None = None  # said when it is over
    while_disarmed: bool = False  # `noticed` and `cleared` are said then, too
    warns: bool = False  # `acted` is said also where the action is only to warn
    hold_first: float = 0.0  # s of holding before a return or a landing
    quiet_in: frozenset[Mode] = frozenset()  # nothing happens in these modes
    hold_option: int = 0  # this bit of FS_OPTIONS takes HOLD out of them
    exemptions: tuple[Exemption, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class FenceWords:
    """How a breach of the fence is told and met."""

    names: Mapping[int, str]  # by FENCE_TYPE
    named: str = "{0}"  # with places for one or more names and for the s of more
    breached: Line  # with a place for that
    one_line: bool = False  # all fences breached at once are told together
    acted: Line | None = None
    cleared: Line | None = None
    recovery: Line | None = None  # the pilot has changed the mode while outside: let him
    again_after: float = inf  # m farther out it is a new breach
    too_far: float = inf  # m outside: land there instead of returning
    any_area_will_do: bool = False  # being inside one of several inclusions is enough
    ends_targets: bool = True  # a target beyond the fence is refused
    must_exist: bool = False  # a fence that is on and has no parts forbids arming


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmingWords:
    """How arming and disarming are told."""

    refused: tuple[str, ...] = ("Arm: {}",)  # CRITICAL, with a place for the reason
    hindered: str = "PreArm: {}"
    not_armable: str = "{} mode not armable"  # with a place for the mode
    in_air: Line = _FLYING
    armed: str = "Arming motors"
    disarmed: str = "Disarming motors"
    disarmed_because: Mapping[Disarming, str] = field(default_factory=dict)
    station_lost: str = "GCS failsafe on"
    pilot_lost: str = "Radio failsafe on"
    any_landing: bool = False  # a landing in any mode ends as one in LAND does


@dataclass(frozen=True, slots=True, kw_only=True)
class Wording:
    """All of it for one stack and kind of vehicle. A loss without an event is none."""

    events: Mapping[Loss, Event]
    fence: FenceWords
    arming: ArmingWords
    any_station: bool = False  # every ground station counts, not only SYSID_MYGCS


def _only(*modes: Mode) -> frozenset[Mode]:
    return frozenset(modes)


_PILOTED = _only(Mode.STABILIZE, Mode.ALT_HOLD, Mode.LOITER, Mode.MANUAL)
_AUTO, _GUIDED, _LANDING = _only(Mode.AUTO), _only(Mode.GUIDED), _only(Mode.LAND)
_GO_ON_LANDING = Exemption(8, _LANDING, "Continuing Landing")
_USED = "{voltage:.2f}V used {used:.0f} mAh"

_ARDUPILOT_FENCE = FenceWords(
    names={1: "Max Alt", 2: "Circle", 4: "Polygon", 8: "Min Alt"},
    named="{0} fence{1}",
    one_line=True,
    breached=Line(NOTICE, "{} breached"),
    cleared=Line(NOTICE, "Fence breach cleared"),
    recovery=Line(INFO, "Manual recovery started"),
    again_after=20.0,
    too_far=100.0,
    must_exist=True,
)
_ARDUCOPTER = Wording(
    events={
        Loss.STATION: Event(
            acted=Line(WARNING, "GCS Failsafe"),
            cleared=Line(WARNING, "GCS Failsafe Cleared"),
            exemptions=(
                _GO_ON_LANDING,
                Exemption(2, _AUTO, "Continuing Auto Mode"),
                Exemption(16, _PILOTED, "Continuing Pilot Control"),
            ),
        ),
        Loss.PILOT: Event(
            acted=Line(WARNING, "Radio Failsafe"),
            cleared=Line(WARNING, "Radio Failsafe Cleared"),
            exemptions=(
                _GO_ON_LANDING,
                Exemption(1, _AUTO, "Continuing Auto Mode"),
                Exemption(4, _GUIDED, "Continuing Guided Mode"),
            ),
        ),
        Loss.BATTERY_LOW: Event(
            noticed=Line(WARNING, f"Battery 1 is low {_USED}"),
            acted=Line(WARNING, "Battery Failsafe"),
            warns=True,
            exemptions=(_GO_ON_LANDING,),
        ),
        Loss.BATTERY_CRITICAL: Event(
            noticed=Line(WARNING, f"Battery 1 is critical {_USED}"),
            acted=Line(WARNING, "Battery Failsafe"),
            warns=True,
            exemptions=(_GO_ON_LANDING,),
        ),
    },
    fence=_ARDUPILOT_FENCE,
    arming=ArmingWords(),
)
_STOPPED = _only(Mode.RTL, Mode.HOLD)
_ARDUROVER = Wording(
    events={
        Loss.STATION: Event(
            acted=Line(WARNING, "GCS Failsafe"),
            cleared=Line(INFO, "GCS Failsafe Cleared"),
            quiet_in=_STOPPED,
            hold_option=1,
        ),
        Loss.PILOT: Event(
            acted=Line(WARNING, "Radio Failsafe"),
            cleared=Line(INFO, "Radio Failsafe Cleared"),
            quiet_in=_STOPPED,
            hold_option=1,
        ),
        Loss.BATTERY_LOW: Event(noticed=Line(WARNING, f"Battery 1 is low {_USED}")),
        Loss.BATTERY_CRITICAL: Event(noticed=Line(WARNING, f"Battery 1 is critical {_USED}")),
    },
    fence=_ARDUPILOT_FENCE,
    arming=ArmingWords(
        not_armable="Mode not armable", armed="Throttle armed", disarmed="Throttle disarmed"
    ),
)

_ACTIVATED = Line(CRITICAL, "Failsafe activated")
_HOLD_FIRST = Line(CRITICAL, "Failsafe activated: entering Hold for 5 seconds")
_PX4 = Wording(
    events={
        Loss.STATION: Event(
            noticed=Line(INFO, "Connection to ground station lost"),
            acted=_HOLD_FIRST,
            cleared=Line(INFO, "GCS connection regained"),
            while_disarmed=True,
            hold_first=5.0,
        ),
        Loss.PILOT: Event(
            noticed=Line(INFO, "Manual control lost"),
            acted=_HOLD_FIRST,
            cleared=Line(INFO, "Manual control regained"),
            hold_first=5.0,
        ),
        Loss.SETPOINTS: Event(acted=_ACTIVATED),
        Loss.BATTERY_LOW: Event(
            noticed=Line(WARNING, "Low battery level, return advised"), acted=_ACTIVATED
        ),
        Loss.BATTERY_CRITICAL: Event(
            noticed=Line(CRITICAL, "Critical battery level, land now"), acted=_ACTIVATED
        ),
    },
    fence=FenceWords(
        names={
            1: "exceeding maximum altitude above Home",
            2: "exceeding maximum distance to Home",
            4: "outside the geofence",
            8: "below minimum altitude above Home",
        },
        breached=Line(CRITICAL, "Geofence: {}"),
        acted=_ACTIVATED,
        any_area_will_do=True,
        ends_targets=False,
    ),
    arming=ArmingWords(
        refused=("Arming denied: Resolve system health failures first", "Preflight Fail: {}"),
        hindered="Preflight Fail: {}",
        in_air=Line(CRITICAL, "Disarming denied: not landed"),
        armed="Armed by external command",
        disarmed="Disarmed by external command",
        disarmed_because={
            Disarming.LANDED: "Disarmed by landing",
            Disarming.IDLE: "Disarmed by auto preflight disarming",
            Disarming.FAILSAFE: "Disarmed by failsafe",
        },
        station_lost="No connection to the ground control station",
        pilot_lost="No manual control input",
        any_landing=True,
    ),
    any_station=True,
)

_WORDINGS: dict[tuple[str, str], Wording] = {
    ("ardupilot", "quadcopter"): _ARDUCOPTER,
    ("ardupilot", "rover"): _ARDUROVER,
    ("generic", "quadcopter"): replace(_ARDUCOPTER, any_station=True),
    ("generic", "rover"): replace(_ARDUROVER, any_station=True),
    ("px4", "quadcopter"): _PX4,
    ("px4", "rover"): _PX4,
}


def wording(personality: str, kind: str) -> Wording:
    """Return how vehicles of this personality and kind talk."""
    return _WORDINGS[personality, kind]
