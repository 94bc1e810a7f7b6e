"""A climb from the ground to a height, as NAV_TAKEOFF asks for."""

from typing import TYPE_CHECKING

from ..robot import Setpoint, Vec3
from .hold import Hold
from .modes import Mode

if TYPE_CHECKING:
    from .autopilot import Autopilot

CLOSE = 0.2  # m: a takeoff or a leg has arrived


class Takeoff:
    """Straight up from where the vehicle stands to `height` metres above home."""

    def __init__(self, autopilot: "Autopilot", height: float) -> None:
        self._autopilot = autopilot
        k = autopilot.robot.kinematics()
        self.position = Vec3(k.north, k.east, autopilot.home.down - height)

    @property
    def done(self) -> bool:
        """Whether the height is reached."""
        k = self._autopilot.robot.kinematics()
        return abs(k.down - self.position.down) <= CLOSE

    @property
    def setpoint(self) -> Setpoint:
        """Return where to climb to."""
        return Setpoint(position=self.position)


class TakeoffMode:
    """PX4's TAKEOFF: climbs to the height asked for or the usual one, then stays in HOLD."""

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        height = autopilot.takeoff_height
        usual = autopilot.settings.takeoff_height
        self._climb = Takeoff(autopilot, usual if height is None else height)
        self.lifts, self.lands = True, False

    def update(self) -> Setpoint:
        """Climb; once there, hand over to hold."""
        if not self._climb.done:
            return self._climb.setpoint
        self._autopilot.change_mode(Mode.HOLD)
        hold = self._autopilot.behaviour
        if isinstance(hold, Hold):
            hold.go_to(self._climb.position, None)
        return self._climb.setpoint
