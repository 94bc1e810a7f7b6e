"""Let down at one place, fast while high and slowly near the ground."""

from math import hypot
from typing import TYPE_CHECKING

from ..config import SLICE_US
from ..robot import Setpoint, Vec3
from .behaviour import HOLD

if TYPE_CHECKING:
    from .autopilot import Autopilot

_LEAD = 0.5  # m that the reference may be below the vehicle
_UPDATE = SLICE_US * 1e-6  # s
_STOPPED = 0.3  # m/s
_BRAKING_TIME = 4.0  # s, the longest
_FASTEST = 100.0  # m/s: the controller's own limit holds


class Land:
    """Descends over `at` (default: where the vehicle stops); `arming.py` disarms it afterwards."""

    lifts = False
    lands = True

    def __init__(self, autopilot: "Autopilot", at: Vec3 | None = None) -> None:
        self._autopilot = autopilot
        self._at = at
        self._stop = Stop(autopilot)

    def update(self) -> Setpoint:
        """Return a reference that sinks at the landing speed."""
        autopilot, settings = self._autopilot, self._autopilot.settings
        if not autopilot.in_air:
            return HOLD
        k = autopilot.robot.kinematics()
        speed = settings.land_speed
        if autopilot.home.down - k.down > settings.land_slow_below:
            speed = settings.land_speed_high or _FASTEST
        if self._at is None and self._stop.is_under_way:
            return Setpoint(velocity=Vec3(0.0, 0.0, speed))
        at = self._at or Vec3(k.north, k.east, k.down)
        self._at = at._replace(down=min(at.down + speed * _UPDATE, k.down + _LEAD))
        return Setpoint(position=self._at, velocity=Vec3(0.0, 0.0, speed))


class Stop:
    """Tells whether a vehicle that was on its way is still to be stopped before it may stay."""

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        self._until = autopilot.now + _BRAKING_TIME

    @property
    def is_under_way(self) -> bool:
        """Whether the vehicle still moves over the ground, unless it takes too long."""
        k = self._autopilot.robot.kinematics()
        return self._autopilot.now < self._until and hypot(k.v_north, k.v_east) > _STOPPED
