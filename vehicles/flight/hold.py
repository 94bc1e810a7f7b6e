"""Stop and stay: copter BRAKE, rover HOLD and LOITER, PX4 HOLD."""

from ..robot import Setpoint, Vec3
from .behaviour import HOLD


class Hold:
    """Stays where it was when the mode began, less the way that braking takes."""

    lifts = False
    lands = False

    def __init__(self, _: object) -> None:
        self._setpoint = HOLD

    def go_to(self, place: Vec3, yaw: float | None) -> None:
        """Stay at another place (local NED): PX4's DO_REPOSITION."""
        self._setpoint = Setpoint(position=place, yaw=yaw)

    def update(self) -> Setpoint:
        """Return where to stay."""
        return self._setpoint
