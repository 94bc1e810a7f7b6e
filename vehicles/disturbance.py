"""A seeded random force along the body axes (paper section 6.1)."""

from random import Random

from .config import Disturbance
from .physics import Force


class BodyForce:
    """Draws the disturbance of one vehicle, uniform in +-amplitude on each axis.

    The sequence depends on the scenario's seed, the system id and the number of draws only.
    """

    def __init__(self, disturbance: Disturbance, seed: int, system_id: int, dt: float) -> None:
        self._form = disturbance.form
        self._amplitude = disturbance.amplitude
        # a text seeds through SHA-512: the same on every machine, unlike hash()
        self._random = Random(f"mavherd disturbance {seed} {system_id}").random  # noqa: S311 no secret
        self._hold_steps = max(1, round(disturbance.hold_s / dt))
        self._steps_left = 0
        self._force: Force | None = None
        if self._form == "constant":
            self._force = self._draw()

    @property
    def force(self) -> Force | None:
        """Return the force during the last physics step."""
        return self._force

    def next(self) -> Force | None:
        """Return the force during the next physics step; None when there is none."""
        if self._form == "held":
            if self._steps_left == 0:
                self._steps_left = self._hold_steps
                self._force = self._draw()
            self._steps_left -= 1
        elif self._form == "white":
            self._force = self._draw()
        return self._force

    def _draw(self) -> Force:
        random, scale = self._random, 2 * self._amplitude
        return (scale * (random() - 0.5), scale * (random() - 0.5), scale * (random() - 0.5))
