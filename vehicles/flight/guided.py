"""GUIDED (PX4: OFFBOARD): do what the latest target says."""

from typing import TYPE_CHECKING

from ..robot import AttitudeSetpoint, Setpoint
from .behaviour import HOLD

if TYPE_CHECKING:
    from .autopilot import Autopilot


class Guided:
    """Follows `autopilot.targets`; without a target, or paused, it holds."""

    lands = False

    def __init__(self, autopilot: "Autopilot") -> None:
        self._targets = autopilot.targets
        self.paused = False  # by DO_PAUSE_CONTINUE
        self.lifts = autopilot.personality.targets_take_off

    def update(self) -> Setpoint | AttitudeSetpoint:
        """Return what the target asks for now."""
        return HOLD if self.paused else self._targets.setpoint()
