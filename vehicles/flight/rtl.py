"""Return to home: a copter climbs first, flies there and lands; a rover drives there and stops."""

from math import hypot
from typing import TYPE_CHECKING

from ..robot import AttitudeSetpoint, Setpoint, Vec3
from .behaviour import HOLD
from .land import Land
from .modes import Mode
from .takeoff import CLOSE

if TYPE_CHECKING:
    from .autopilot import Autopilot


class CopterReturn:
    """Climbs to RTL_ALT, flies home, waits RTL_LOIT_TIME, then lands or stops at RTL_ALT_FINAL."""

    lifts = False

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        self._leg: Vec3 | None = None  # where to climb to, then where to fly to
        self._home_since: float | None = None
        self._land: Land | None = None

    @property
    def lands(self) -> bool:
        """Whether it is at home and on its way down."""
        return self._land is not None

    def update(self) -> Setpoint | AttitudeSetpoint:
        """Return the setpoint of the leg that is flown now."""
        autopilot, settings = self._autopilot, self._autopilot.settings
        if self._land is not None:
            return self._land.update()
        if not autopilot.in_air:
            return HOLD
        k, home = autopilot.robot.kinematics(), autopilot.home
        if self._leg is None:
            top = min(k.down - settings.rtl_climb_min, home.down - settings.rtl_height)
            top = min(k.down, max(top, home.down - autopilot.fence.safe_height))
            self._leg = Vec3(k.north, k.east, top)
            autopilot.robot.speed_limit = settings.rtl_speed or None
        if self._home_since is None:
            if abs(k.down - self._leg.down) < CLOSE:
                self._leg = self._leg._replace(north=home.north, east=home.east)
                if hypot(k.north - home.north, k.east - home.east) < CLOSE:
                    self._home_since = autopilot.now
        elif autopilot.now - self._home_since >= settings.rtl_loiter_time:
            if settings.rtl_final_height > 0:
                self._leg = home._replace(down=home.down - settings.rtl_final_height)
            else:
                self._land = Land(autopilot, self._leg)
        return Setpoint(position=self._leg)


class RoverReturn:
    """Drives straight home, then changes to HOLD."""

    lifts = False
    lands = False

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        autopilot.robot.speed_limit = autopilot.settings.rtl_speed or None

    def update(self) -> Setpoint:
        """Return home as the target; there, hold."""
        autopilot = self._autopilot
        k, home = autopilot.robot.kinematics(), autopilot.home
        if hypot(k.north - home.north, k.east - home.east) < CLOSE:
            autopilot.change_mode(Mode.HOLD)
            return HOLD
        return Setpoint(position=home)
