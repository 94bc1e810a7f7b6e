"""What a ground station has to know of a flight stack, beside what its vehicles show."""

from dataclasses import dataclass

from ...transport.mavlink import mav
from ...vehicles.flight import personality
from ...vehicles.flight.personality import ModeTable, Personality

_BOTH = frozenset(("quadcopter", "rover"))


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightStack:
    """How vehicles of one flight stack are brought to do things."""

    personality: Personality
    stream_first_s: float = (
        0.0  # of set-points before GUIDED; without them it fails; 0: none needed
    )
    climbs_by_target: bool = False  # else by NAV_TAKEOFF, which a set-point would break off
    needs_home_item: bool = False  # item 0 of a mission is home
    loss_parameter: str = "GUID_TIMEOUT"  # s without set-points until it stops or fails safe
    follows_velocity: frozenset[str] = _BOTH  # kinds that heed the velocity beside a position

    @property
    def name(self) -> str:
        """Return its name, as scenarios write it."""
        return self.personality.name

    @property
    def needs_stream(self) -> bool:
        """Whether set-points must come all the time in GUIDED, and before it."""
        return self.stream_first_s > 0

    @property
    def bytewise_parameters(self) -> bool:
        """Whether integers travel as bits in the float's place."""
        return self.personality.bytewise_parameters

    @property
    def takeoff_is_amsl(self) -> bool:
        """Whether NAV_TAKEOFF's height is above mean sea level; else above home."""
        return self.personality.altitudes_are_amsl

    def modes(self, kind: str) -> ModeTable:
        """Return numbers and names of its modes for a kind of vehicle."""
        return self.personality.modes[kind]


ARDUPILOT = FlightStack(
    personality=personality.ARDUPILOT,
    needs_home_item=True,
    follows_velocity=frozenset(("quadcopter",)),
)
PX4 = FlightStack(
    personality=personality.PX4,
    stream_first_s=1.2,
    climbs_by_target=True,
    loss_parameter="COM_OF_LOSS_T",
    follows_velocity=frozenset(("quadcopter",)),
)
GENERIC = FlightStack(personality=personality.GENERIC)

STACKS = {stack.name: stack for stack in (ARDUPILOT, PX4, GENERIC)}


def stack_of(name: str) -> FlightStack | None:
    """Return the flight stack that a scenario names; None for `auto`: what the vehicle says."""
    return None if name == "auto" else STACKS[name]


def stack_heard(autopilot: int) -> FlightStack | None:
    """Return the flight stack that says this MAV_AUTOPILOT of itself; None: one unknown to us."""
    return next((s for s in STACKS.values() if s.personality.autopilot == autopilot), None)


def autopilot_name(autopilot: int) -> str:
    """Return the name of a MAV_AUTOPILOT for people."""
    if stack := stack_heard(autopilot):
        return stack.name
    known = mav.enums["MAV_AUTOPILOT"].get(autopilot)
    return known.name.removeprefix("MAV_AUTOPILOT_").lower() if known else f"autopilot {autopilot}"
