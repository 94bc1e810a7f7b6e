"""The rover's controllers: heading and speed, then one PI per wheel (paper eq. 15-16)."""

from dataclasses import dataclass
from math import atan2, cos, inf, pi, sin, sqrt
from typing import Final

from .physics import require_positive
from .robot import AttitudeSetpoint, Limits, Setpoint, Vec3
from .rover import RoverParams, StateVector, Wheels

_STILL: Final = 0.01  # m/s: a slower velocity setpoint asks to stand, and has no heading
_NEAR: Final = 0.5  # m: so near to a moving target its motion shows the way
_LOOK_AHEAD: Final = 0.5  # s
_BRAKING_SHARE: Final = 0.7  # of `accel_max`, before a position: the rest corrects
_ACCELERATIONS = 0.1, 50.0  # m/s^2, what a limit of acceleration may be


@dataclass(frozen=True, slots=True, kw_only=True)
class RoverTuning:
    """Gains and limits of the onboard controllers."""

    position_p: float = 2.0  # 1/s
    heading_p: float = 4.0  # 1/s
    wheel_p: float = 0.4  # N m s/rad
    wheel_i: float = 2.0  # N m/rad
    v_max: float = 1.0  # m/s
    accel_max: float = 0.0  # m/s^2, along; 0: what the wheels give
    yaw_rate_max: float = 2.0  # rad/s
    wheel_speed_max: float = 20.0  # rad/s
    arrival_radius: float = 0.05  # m: this near to a fixed position it stands

    def __post_init__(self) -> None:
        require_positive(self, may_be_zero=("wheel_i", "arrival_radius", "accel_max"))
        low, high = _ACCELERATIONS
        if self.accel_max and not low <= self.accel_max <= high:
            raise ValueError(f"accel_max must be 0 or {low} to {high} m/s^2, got {self.accel_max}")


PROFILES = {
    "default": RoverTuning(),
    "paper": RoverTuning(position_p=15.0, heading_p=5.0),  # Table 2
    "ardupilot": RoverTuning(v_max=2.0, accel_max=1.0, wheel_speed_max=31.0),  # WP_SPEED, ATC_*
}


class RoverControl:
    """Turns a setpoint and the true state into wheel speeds and torques, once per `dt`."""

    def __init__(self, params: RoverParams, tuning: RoverTuning, dt: float) -> None:
        self._wheel_radius = params.wheel_radius
        self._half_track = params.half_track
        self._torque_limit = params.torque_limit
        self._dt = dt
        self.retune(tuning)
        self.reset()

    def retune(self, tuning: RoverTuning) -> None:
        """Take up new gains and limits, keeping the wheel integrals."""
        self.tuning = t = tuning
        self._position_p = t.position_p
        self._heading_p = t.heading_p
        self._wheel_p = t.wheel_p
        self._wheel_i = t.wheel_i
        self._accel_max = t.accel_max
        self._yaw_rate_max = t.yaw_rate_max
        self._rim_max = t.wheel_speed_max * self._wheel_radius
        self._arrival_radius = t.arrival_radius
        self._joint = _BRAKING_SHARE * t.accel_max / t.position_p or inf
        self.limit_speed(None)

    def limit_speed(self, speed: float | None) -> None:
        """Drive within this speed (m/s), None: that of the tuning."""
        self._v_max = speed or self.tuning.v_max

    @property
    def limits(self) -> Limits:
        """Return the limits that hold now."""
        return Limits(self._v_max, self.tuning.yaw_rate_max)

    def reset(self) -> None:
        """Forget the wheel integrals and stop."""
        self._integrals: Wheels = (0.0, 0.0)
        self.speed_commands: Wheels = (0.0, 0.0)
        self._speed: float | None = None  # command, while `accel_max` eases it

    def update(self, state: StateVector, setpoint: Setpoint | AttitudeSetpoint) -> Wheels:
        """Return the wheel torques for the next `dt`."""
        if isinstance(setpoint, Setpoint):
            speed, yaw_rate = self._motion(state, setpoint)
        else:
            speed, yaw_rate = self._steered(state, setpoint)
        if self._accel_max:
            speed = self._eased(state[3], speed)
        self.speed_commands = self._wheel_speeds(speed, yaw_rate)
        return self._torques(state)

    def _motion(self, s: StateVector, setpoint: Setpoint) -> tuple[float, float]:
        """Return forward speed and yaw rate that the setpoint asks for. Acceleration is ignored."""
        position, velocity, _, yaw, yaw_rate = setpoint
        if position is not None:
            return self._towards(s, position, velocity, yaw, yaw_rate)
        if velocity is not None and yaw is None and yaw_rate is None:
            return self._along(s, velocity)
        turn = yaw_rate or 0.0
        if yaw is not None:
            turn += self._heading_p * _wrapped(yaw - s[2])
        if velocity is None:
            return 0.0, turn
        north, east, _ = velocity
        return north * cos(s[2]) + east * sin(s[2]), turn

    def _steered(self, s: StateVector, setpoint: AttitudeSetpoint) -> tuple[float, float]:
        """Return the motion of a pilot's throttle and steering."""
        turn = setpoint.yaw_rate or 0.0
        if setpoint.yaw is not None:
            turn += self._heading_p * _wrapped(setpoint.yaw - s[2])
        return _clamped(setpoint.thrust or 0.0, 1.0) * self._v_max, turn

    def _eased(self, speed: float, wanted: float) -> float:
        """Return the speed to command on the way to `wanted` within the acceleration limit."""
        last = speed if self._speed is None else self._speed
        step = self._accel_max * self._dt
        self._speed = last + _clamped(_clamped(wanted, self._v_max) - last, step)
        return self._speed

    def _towards(
        self,
        s: StateVector,
        position: Vec3,
        velocity: Vec3 | None,
        yaw: float | None,
        yaw_rate: float | None,
    ) -> tuple[float, float]:
        """Return the motion towards a position (eq. 15) plus feed-forwards.

        e_alpha is the error of the bearing to the target. The paper's integrals, over one
        sample, vanish; a running integral of a distance could never unwind. Near the target
        the bearing swings wildly: at a moving target it is taken, more and more, to where
        the target will be; at a fixed one, within `arrival_radius`, the rover stands, and
        takes up the yaw if one is given.
        """
        north, east = position.north - s[0], position.east - s[1]
        distance = sqrt(north * north + east * east)
        turn = yaw_rate or 0.0
        cos_yaw, sin_yaw = cos(s[2]), sin(s[2])
        speed = 0.0 if velocity is None else velocity.north * cos_yaw + velocity.east * sin_yaw
        moving = speed > _STILL or speed < -_STILL
        if distance <= self._arrival_radius and not moving:
            return 0.0, turn if yaw is None else turn + self._heading_p * _wrapped(yaw - s[2])

        along = self._position_p * (north * cos_yaw + east * sin_yaw)  # k rho cos(e_alpha)
        wanted, most = self._position_p * distance, self._v_max
        if wanted > self._joint:  # a speed that can be braked from, as the quadcopter's
            most = min(most, sqrt(self._joint * (2 * wanted - self._joint)))
        if wanted > most:
            along *= most / wanted
        if velocity is not None and speed > 0 and distance < _NEAR:
            ahead = _LOOK_AHEAD * (1 - distance / _NEAR)
            north, east = north + ahead * velocity.north, east + ahead * velocity.east
        error = _wrapped(atan2(east, north) - s[2])
        return speed + along, turn + _clamped(self._heading_p * error, self._yaw_rate_max)

    def _along(self, s: StateVector, velocity: Vec3) -> tuple[float, float]:
        """Return the motion that turns to a velocity's heading and drives when it points there."""
        north, east, _ = velocity
        speed = sqrt(north * north + east * east)
        if speed < _STILL:
            return 0.0, 0.0
        error = _wrapped(atan2(east, north) - s[2])
        facing = cos(error)
        return (speed * facing * facing if facing > 0 else 0.0), self._heading_p * error

    def _wheel_speeds(self, speed: float, yaw_rate: float) -> Wheels:
        """Return wheel speed commands (eq. 16) within all limits; the turn is kept first."""
        rim_max, radius = self._rim_max, self._wheel_radius
        turn = _clamped(_clamped(yaw_rate, self._yaw_rate_max) * self._half_track, rim_max)
        speed = _clamped(_clamped(speed, self._v_max), rim_max - abs(turn))
        return (speed + turn) / radius, (speed - turn) / radius

    def _torques(self, s: StateVector) -> Wheels:
        """Return the torques of the wheels' PI loops within the limit; the turn is kept first.

        This is the link between (16) and (1), which the paper leaves out. A wheel that is
        clamped stops integrating, unless that leads out of the clamp.
        """
        speed, turn = s[3], s[4] * self._half_track
        left_command, right_command = self.speed_commands
        left_error = left_command - (speed + turn) / self._wheel_radius
        right_error = right_command - (speed - turn) / self._wheel_radius
        left_i, right_i = self._integrals
        left = self._wheel_p * left_error + left_i
        right = self._wheel_p * right_error + right_i

        limit = self._torque_limit
        if -limit <= left <= limit and -limit <= right <= limit:
            step = self._wheel_i * self._dt
            self._integrals = (left_i + step * left_error, right_i + step * right_error)
            return left, right
        difference = _clamped((left - right) / 2, limit)
        common = _clamped((left + right) / 2, limit - abs(difference))
        return common + difference, common - difference


def _clamped(value: float, limit: float) -> float:
    """Return `value` within +-`limit`."""
    return limit if value > limit else -limit if value < -limit else value


def _wrapped(angle: float) -> float:
    """Return `angle` in [-pi, pi)."""
    if -pi <= angle < pi:
        return angle
    return (angle + pi) % (2 * pi) - pi
