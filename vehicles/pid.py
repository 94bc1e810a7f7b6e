"""A PID controller without a clock."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Gains:
    """Gains of one loop; `i_limit` bounds the integral's share of the output."""

    p: float
    i: float = 0.0
    d: float = 0.0
    i_limit: float = 0.0


@dataclass(slots=True)
class Pid:
    """A PID whose caller owns time: pass the error, its rate and `dt`.

    Taking the rate instead of differencing the error keeps the derivative free of
    set-point kick and of jumps where an angle wraps. Pass `dt` = 0 to hold the integral
    while something downstream is saturated.
    """

    gains: Gains
    integral: float = 0.0

    def update(self, error: float, error_rate: float, dt: float) -> float:
        """Return the control output for this step."""
        g = self.gains
        integral = self.integral + g.i * error * dt
        limit = g.i_limit
        if integral > limit:
            integral = limit
        elif integral < -limit:
            integral = -limit
        self.integral = integral
        return g.p * error + integral + g.d * error_rate

    def reset(self) -> None:
        """Forget the past; called on every arm and mode change."""
        self.integral = 0.0
