"""A heading that turns to where CONDITION_YAW says, at the rate and in the direction it says."""

from math import pi

from ...transport.frames import wrap_angle
from ..config import SLICE_US

_UPDATE = SLICE_US * 1e-6  # s


class Heading:
    """Turns from `start` to `target` (rad, clockwise from north), one step for each `update`.

    `direction` 1 turns right, -1 left, 0 the shorter way; `rate` in rad/s.
    """

    def __init__(self, start: float, target: float, rate: float, direction: int = 0) -> None:
        self.yaw = wrap_angle(start)
        self._rate = rate
        self._left = wrap_angle(target - start)  # rad still to turn, positive to the right
        if direction > 0 and self._left < 0:
            self._left += 2 * pi
        elif direction < 0 and self._left > 0:
            self._left -= 2 * pi

    @property
    def done(self) -> bool:
        """Whether the heading has reached its target."""
        return self._left == 0

    def update(self) -> float:
        """Return the heading 10 ms later."""
        step = min(abs(self._left), self._rate * _UPDATE)
        step = step if self._left > 0 else -step
        self._left -= step
        self.yaw = wrap_angle(self.yaw + step)
        return self.yaw
