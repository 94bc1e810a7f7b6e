"""GUIDED (PX4: OFFBOARD): do what the latest target says."""

from typing import TYPE_CHECKING

from ..robot import AttitudeSetpoint, Setpoint

if TYPE_CHECKING:
    from .autopilot import Autopilot


class Guided:
    """Follows `autopilot.targets`; without a target it holds."""

    lands = False

    def __init__(self, autopilot: "Autopilot") -> None:
        self._targets = autopilot.targets
        self.lifts = autopilot.personality.targets_take_off

    def update(self) -> Setpoint | AttitudeSetpoint:
        """Return what the target asks for now."""
        return self._targets.setpoint()
