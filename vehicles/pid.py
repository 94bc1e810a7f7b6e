"""A PID controller without a clock."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Gains:
    """Gains of one loop; `i_limit` bounds the integral's share of the output."""

    p: float
    i: float = 0.0
    d: float = 0.0
    i_limit: float = 0.0


class Pid:
    """A PID whose caller owns time: pass the error, its rate and `dt`.

    Taking the rate instead of differencing the error keeps the derivative free of
    set-point kick and of jumps where an angle wraps. Pass `dt` = 0 to hold the integral
    while something downstream is saturated.
    """

    def __init__(self, gains: Gains, integral: float = 0.0) -> None:
        self.integral = integral
        self.retune(gains)

    def retune(self, gains: Gains) -> None:
        """Take up new gains, keeping the integral."""
        self._p = gains.p
        self._i = gains.i
        self._d = gains.d
        self._i_limit = gains.i_limit

    def update(self, error: float, error_rate: float, dt: float) -> float:
        """Return the control output for this step."""
        integral = self.integral + self._i * error * dt
        limit = self._i_limit
        if integral > limit:
            integral = limit
        elif integral < -limit:
            integral = -limit
        self.integral = integral
        return self._p * error + integral + self._d * error_rate

    def reset(self) -> None:
        """Forget the past; called on every arm and mode change."""
        self.integral = 0.0
