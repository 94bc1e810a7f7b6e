"""A rover as the autopilot sees it: physics and onboard controllers."""

from collections.abc import Callable, Mapping
from math import cos, sin

from .disturbance import BodyForce
from .physics import GRAVITY, Force
from .robot import AttitudeSetpoint, Kinematics, Limits, Setpoint
from .rover import RoverParams, RoverState, Wheels, derivative, stepper, wheel_speeds
from .rover_control import RoverControl, RoverTuning
from .speed_limit import SpeedLimit

_OFF = Wheels()
_FASTEST = 20.0  # m/s that anybody may ask for; the wheels have their own limit
_PARKED = 1e-3  # m/s and rad/s: slower than this with motors off, it stands


class Rover:
    """Implements `Robot`. It drives on a level plane at the height where it starts.

    With motors off it coasts to a halt against drag, and once still it stays where it is.
    `retuned` returns a tuning with changes in it, or raises ValueError.
    """

    speed_limit = SpeedLimit(_FASTEST)
    climb_limit = SpeedLimit(_FASTEST)
    descent_limit = SpeedLimit(_FASTEST)

    def __init__(
        self,
        params: RoverParams,
        control: RoverControl,
        state: RoverState,
        down: float,
        disturbance: BodyForce,
        dt: float,
        control_every: int,
        retuned: Callable[[RoverTuning, Mapping[str, float]], RoverTuning],
    ) -> None:
        self.dt = dt
        self.control_every = control_every
        self.motors_on = False
        self.on_ground = True
        self.state = state
        self._params = params
        self._down = down
        self._control = control
        self._retuned = retuned
        self._disturbance = disturbance
        self._torques = _OFF
        self._step = stepper(params, dt)

    def kinematics(self) -> Kinematics:
        """Return the true state."""
        north, east, yaw, speed, yaw_rate = self.state
        cos_yaw, sin_yaw = cos(yaw), sin(yaw)
        return Kinematics(
            north, east, self._down, speed * cos_yaw, speed * sin_yaw, 0.0,
            cos(yaw / 2), 0.0, 0.0, sin(yaw / 2), 0.0, 0.0, yaw_rate,
        )  # fmt: skip

    def control(self, setpoint: Setpoint | AttitudeSetpoint) -> None:
        """Run the PID stack once and set the wheel torques; with motors off they are zero."""
        if self.motors_on:
            self._torques = self._control.update(self.state, setpoint)
        else:
            self._torques = _OFF

    @property
    def limits(self) -> Limits:
        """Return the limits that hold now."""
        return self._control.limits

    def retune(self, **changes: float) -> None:
        """Replace gains and limits by their names; ValueError changes nothing."""
        self._control.retune(self._retuned(self._control.tuning, changes))
        self.limits_changed()

    def limits_changed(self) -> None:
        """Take up a new speed limit."""
        self._control.limit_speed(self.speed_limit)

    def reset_control(self) -> None:
        """Forget integrals."""
        self._control.reset()

    def advance(self) -> None:
        """Advance physics and disturbance by one step of `dt`."""
        torques = self._torques
        if not self.motors_on:
            torques = _OFF
            north, east, yaw, speed, yaw_rate = self.state
            if -_PARKED < speed < _PARKED and -_PARKED < yaw_rate < _PARKED:
                if speed or yaw_rate:
                    self.state = RoverState(north, east, yaw)
                return
        self.state = self._step(self.state, torques, self._disturbance.next())

    def actuators(self) -> tuple[float, ...]:
        """Return wheel speeds and their commands in rad/s."""
        speeds = wheel_speeds(self.state.speed, self.state.yaw_rate, self._params)
        return (*speeds, *(self._control.speed_commands if self.motors_on else _OFF))

    def outputs(self) -> tuple[float, ...]:
        """Return the wheel speed commands as shares of the fastest, -1..1."""
        most = self._control.tuning.wheel_speed_max
        return tuple(w / most for w in (self._control.speed_commands if self.motors_on else _OFF))

    def specific_force(self) -> Force:
        """Return what an IMU over the axle feels (m/s^2, FRD)."""
        s, torques = self.state, self._torques if self.motors_on else _OFF
        if not self.motors_on and s.speed == s.yaw_rate == 0:
            return (0.0, 0.0, -GRAVITY)  # parked: friction holds it
        along = derivative(s, torques, self._disturbance.force, self._params).speed
        return (along, s.speed * s.yaw_rate, -GRAVITY)

    def shaft_power(self) -> float:
        """Return the power in W that drives the wheels; braking gives none back."""
        if not self.motors_on:
            return 0.0
        speeds = wheel_speeds(self.state.speed, self.state.yaw_rate, self._params)
        left = self._torques.left * speeds.left
        right = self._torques.right * speeds.right
        return max(0.0, left) + max(0.0, right)

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """Return the columns of `actuators`."""
        return (
            "left_wheel_speed_rad_s",
            "right_wheel_speed_rad_s",
            "left_wheel_command_rad_s",
            "right_wheel_command_rad_s",
        )
