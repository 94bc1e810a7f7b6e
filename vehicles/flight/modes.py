"""Flight modes and their MAVLink numbers, as ArduPilot 4.6 has them."""

from dataclasses import dataclass
from enum import Enum

from ...transport.mavlink import mav


class Mode(Enum):
    """What the vehicle is doing, whatever a flight stack calls it."""

    HOLD = "hold"  # stay here: copter BRAKE, rover HOLD
    LOITER = "loiter"  # stay here (what a pilot's sticks would move)
    GUIDED = "guided"  # follow setpoints
    RTL = "return"  # go home and land or stop
    LAND = "land"


@dataclass(frozen=True)
class Identity:
    """How a vehicle presents itself: HEARTBEAT type, mode numbers and names."""

    mav_type: int
    modes: dict[Mode, tuple[int, str]]
    boot_mode: Mode

    def number(self, mode: Mode) -> int:
        """Return the `custom_mode` of `mode`."""
        return self.modes[mode][0]

    def name(self, mode: Mode) -> str:
        """Return what ground stations call `mode`."""
        return self.modes[mode][1]

    def mode(self, number: int) -> Mode | None:
        """Return the mode with this `custom_mode`, None when the vehicle has none such."""
        return next((m for m, (n, _) in self.modes.items() if n == number), None)


COPTER = Identity(
    mav_type=mav.MAV_TYPE_QUADROTOR,
    modes={
        Mode.GUIDED: (4, "GUIDED"),
        Mode.LOITER: (5, "LOITER"),
        Mode.RTL: (6, "RTL"),
        Mode.LAND: (9, "LAND"),
        Mode.HOLD: (17, "BRAKE"),
    },
    boot_mode=Mode.LOITER,
)
ROVER = Identity(
    mav_type=mav.MAV_TYPE_GROUND_ROVER,
    modes={
        Mode.HOLD: (4, "HOLD"),
        Mode.LOITER: (5, "LOITER"),
        Mode.RTL: (11, "RTL"),
        Mode.GUIDED: (15, "GUIDED"),
    },
    boot_mode=Mode.HOLD,
)
IDENTITIES = {"quadcopter": COPTER, "rover": ROVER}

AUTOPILOT: int = mav.MAV_AUTOPILOT_ARDUPILOTMEGA
FIRMWARE_VERSION = (4, 6, 0)
