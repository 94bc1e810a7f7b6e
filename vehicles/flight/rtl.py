"""RTL: a copter climbs first, flies home and lands; a rover drives there. Rally points count."""

from math import hypot
from typing import TYPE_CHECKING

from ..robot import AttitudeSetpoint, Setpoint, Vec3
from .behaviour import HOLD
from .land import Land, Stop
from .rally import destination
from .takeoff import CLOSE

if TYPE_CHECKING:
    from .autopilot import Autopilot

_STILL = Vec3()


class CopterReturn:
    """Stops, climbs, flies home, waits RTL_LOIT_TIME, then lands or stops at RTL_ALT_FINAL."""

    lifts = False

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        self._to = destination(autopilot)
        self._stop = Stop(autopilot)
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
        k, home, to = autopilot.robot.kinematics(), autopilot.home, self._to
        if self._leg is None:
            if self._stop.is_under_way:
                return Setpoint(velocity=_STILL)
            top = min(k.down - settings.rtl_climb_min, home.down - settings.rtl_height)
            top = min(k.down, max(top, home.down - autopilot.fence.safe_height))
            self._leg = Vec3(k.north, k.east, top)
            autopilot.robot.speed_limit = settings.rtl_speed or None
        if self._home_since is None:
            if abs(k.down - self._leg.down) < CLOSE:
                self._leg = self._leg._replace(north=to.north, east=to.east)
                if hypot(k.north - to.north, k.east - to.east) < CLOSE:
                    self._home_since = autopilot.now
        elif autopilot.now - self._home_since >= settings.rtl_loiter_time:
            if settings.rtl_final_height > 0:
                self._leg = to._replace(down=home.down - settings.rtl_final_height)
            else:
                self._land = Land(autopilot, self._leg)
        return Setpoint(position=self._leg)


class RoverReturn:
    """Drives straight home and stays there; the mode remains, as on ArduRover."""

    lifts = False
    lands = False

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        self._is_there = False
        self._to = destination(autopilot)
        autopilot.robot.speed_limit = autopilot.settings.rtl_speed or None

    def update(self) -> Setpoint:
        """Return home as the target; say so once when it is reached."""
        autopilot = self._autopilot
        k, to = autopilot.robot.kinematics(), self._to
        if not self._is_there and hypot(k.north - to.north, k.east - to.east) < CLOSE:
            self._is_there = True
            autopilot.say("Reached destination")
        return Setpoint(position=to)
