"""Where the nose points when CONDITION_YAW or a region of interest decides it."""

from math import atan2, hypot
from typing import TYPE_CHECKING

from ..robot import Setpoint, Vec3
from .heading import Heading

if TYPE_CHECKING:
    from .autopilot import Autopilot

_OVERHEAD = 1.0  # m: so near above a region of interest the nose stays where it is
_TRAVELS = 0.05  # of the highest speed: slower than that, the nose stays where it is


class Gaze:
    """A copter's nose in GUIDED and AUTO; a rover's has to point where it drives.

    AUTO's legs know their way themselves. A target without a yaw leaves the nose alone, or has
    it face the way (WP_YAW_BEHAVIOR).
    """

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        self._heading: Heading | None = None
        self._interest: Vec3 | None = None  # local NED
        self._way: float | None = None  # rad, where the vehicle travelled last

    def turn(self, heading: Heading | None) -> None:
        """Point where `heading` says; None gives the nose back."""
        self._heading = heading

    def look_at(self, place: Vec3 | None) -> None:
        """Point at a place (local NED) until told otherwise; None gives the nose back."""
        self._interest = place
        self._heading = None

    def forget(self) -> None:
        """Leave the nose to the setpoints."""
        self._heading = self._interest = self._way = None

    def apply(self, setpoint: Setpoint, *, faces_way: bool = False) -> Setpoint:
        """Return the setpoint with the nose where it is wanted; called once in every update.

        `faces_way`: where nothing else is wanted, to where the vehicle travels.
        """
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
        return self._face_way(setpoint) if faces_way else setpoint

    def _face_way(self, setpoint: Setpoint) -> Setpoint:
        """Return the setpoint with the nose to where the vehicle travels, if it has no yaw."""
        position, velocity, acceleration, yaw, yaw_rate = setpoint
        if yaw is not None or yaw_rate is not None:
            self._way = None
            return setpoint
        if not position is velocity is acceleration is None:
            k, most = self._autopilot.robot.kinematics(), self._autopilot.robot.limits.speed
            if hypot(k.v_north, k.v_east) > _TRAVELS * most:
                self._way = atan2(k.v_east, k.v_north)
        return setpoint._replace(yaw=self._way)
