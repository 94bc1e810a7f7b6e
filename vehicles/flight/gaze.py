"""Where the nose points when CONDITION_YAW or a region of interest decides it."""

from math import atan2, hypot
from typing import TYPE_CHECKING

from ..robot import Setpoint, Vec3
from .heading import Heading

if TYPE_CHECKING:
    from .autopilot import Autopilot

_OVERHEAD = 1.0  # m: so near above a region of interest the nose stays where it is


class Gaze:
    """A copter's nose in GUIDED and AUTO; a rover's has to point where it drives."""

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        self._heading: Heading | None = None
        self._interest: Vec3 | None = None  # local NED

    def turn(self, heading: Heading | None) -> None:
        """Point where `heading` says; None gives the nose back."""
        self._heading = heading

    def look_at(self, place: Vec3 | None) -> None:
        """Point at a place (local NED) until told otherwise; None gives the nose back."""
        self._interest = place
        self._heading = None

    def forget(self) -> None:
        """Leave the nose to the setpoints."""
        self._heading = self._interest = None

    def apply(self, setpoint: Setpoint) -> Setpoint:
        """Return the setpoint with the nose where it is wanted; called once in every update."""
        if not self._autopilot.flies:
            return setpoint
        if self._heading is not None:
            return setpoint._replace(yaw=self._heading.update(), yaw_rate=None)
        if self._interest is not None:
            k = self._autopilot.robot.kinematics()
            north, east = self._interest.north - k.north, self._interest.east - k.east
            if hypot(north, east) > _OVERHEAD:
                return setpoint._replace(yaw=atan2(east, north), yaw_rate=None)
        return setpoint
