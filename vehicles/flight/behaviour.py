"""What every flight mode looks like to the autopilot."""

from typing import Protocol

from ..robot import AttitudeSetpoint, Setpoint

HOLD = Setpoint()
"""Stay where you are."""


class Behaviour(Protocol):
    """How one mode flies: made on entering the mode and on arming, dropped on leaving it."""

    @property
    def lifts(self) -> bool:
        """Whether the vehicle may leave the ground now."""
        ...

    @property
    def lands(self) -> bool:
        """Whether the vehicle is letting itself down to the ground."""
        ...

    def update(self) -> Setpoint | AttitudeSetpoint:
        """Return what the robot shall do; called every 10 ms while armed."""
        ...
