"""A rover as the autopilot sees it: physics and onboard controllers."""

from collections.abc import Callable, Mapping
from math import cos, nan, sin
from typing import Final

from .disturbance import BodyForce
from .physics import GRAVITY, Force
from .robot import AttitudeSetpoint, Kinematics, Limits, Robot, Setpoint
from .rover import (
    RoverParams,
    RoverPhysics,
    RoverState,
    StateVector,
    Wheels,
    body_velocity,
    derivative,
    wheel_speeds,
)
from .rover_control import RoverControl, RoverTuning

_OFF: Wheels = (0.0, 0.0)
_NO_COMMANDS = (nan, nan)
_FASTEST: Final = 20.0  # m/s that anybody may ask for; the wheels have their own limit
_PARKED: Final = 1e-3  # m/s and rad/s: slower than this with motors off, it stands


class Rover(Robot):
    """Implements `Robot`. It drives on a level plane at the height where it starts.

    With motors off it coasts to a halt against drag, and once still it stays where it is.
    `retuned` returns a tuning with changes in it, or raises ValueError.
    """

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
        super().__init__(dt, control_every, _FASTEST, _FASTEST)
        self._state: StateVector = state
        self._params = params
        self._down = down
        self._control = control
        self._retuned = retuned
        self._disturbance = disturbance
        self._physics = RoverPhysics(params, dt)
        self._torques: Wheels = _OFF

    @property
    def state(self) -> RoverState:
        """Return the true state."""
        return RoverState(*self._state)

    def place(self) -> tuple[float, float, float]:
        """Return where it truly is: north, east, down."""
        return (self._state[0], self._state[1], self._down)

    def kinematics(self) -> Kinematics:
        """Return the true state."""
        north, east, yaw, speed, yaw_rate = self._state
        cos_yaw, sin_yaw = cos(yaw), sin(yaw)
        fields = (
            north, east, self._down, speed * cos_yaw, speed * sin_yaw, 0.0,
            cos(yaw / 2), 0.0, 0.0, sin(yaw / 2), 0.0, 0.0, yaw_rate,
        )  # fmt: skip
        return tuple.__new__(Kinematics, fields)  # what Kinematics(...) does in twice the time

    def control(self, setpoint: Setpoint | AttitudeSetpoint) -> None:
        """Run the PID stack once and set the wheel torques; with motors off they are zero."""
        if self.motors_on:
            self._torques = self._control.update(self._state, setpoint)
        else:
            self._torques = _OFF

    @property
    def limits(self) -> Limits:
        """Return the limits that hold now."""
        return self._control.limits

    def retune(self, **changes: float) -> None:
        """Replace gains and limits by their names; ValueError changes nothing."""
        self._control.retune(self._retuned(self._control.tuning, changes))
        self._limits_changed()

    def reset_control(self) -> None:
        """Forget integrals."""
        self._control.reset()

    def advance(self) -> None:
        """Advance physics and disturbance by one step of `dt`."""
        torques = self._torques
        if not self.motors_on:
            torques = _OFF
            north, east, yaw, speed, yaw_rate = self._state
            if -_PARKED < speed < _PARKED and -_PARKED < yaw_rate < _PARKED:
                if speed or yaw_rate:
                    self._state = (north, east, yaw, 0.0, 0.0)
                return
        self._state = self._physics.step(self._state, torques, self._disturbance.next())

    def actuators(self) -> tuple[float, ...]:
        """Return wheel speeds and their commands in rad/s."""
        _, _, _, speed, yaw_rate = self._state
        left, right = wheel_speeds(speed, yaw_rate, self._params)
        left_command, right_command = self._control.speed_commands if self.motors_on else _OFF
        return (left, right, left_command, right_command)

    def commands(self) -> tuple[float, ...]:
        """Return speed (m/s) and yaw rate (rad/s) asked of the wheels; NaN with motors off."""
        if not self.motors_on:
            return _NO_COMMANDS
        return body_velocity(self._control.speed_commands, self._params)

    def outputs(self) -> tuple[float, ...]:
        """Return the wheel speed commands as shares of the fastest, -1..1."""
        most = self._control.tuning.wheel_speed_max
        left, right = self._control.speed_commands if self.motors_on else _OFF
        return (left / most, right / most)

    def specific_force(self) -> Force:
        """Return what an IMU over the axle feels (m/s^2, FRD)."""
        torques = self._torques if self.motors_on else _OFF
        _, _, _, speed, yaw_rate = self._state
        if not self.motors_on and speed == yaw_rate == 0:
            return (0.0, 0.0, -GRAVITY)  # parked: friction holds it
        along = derivative(self._state, torques, self._disturbance.force, self._params).speed
        return (along, speed * yaw_rate, -GRAVITY)

    def shaft_power(self) -> float:
        """Return the power in W that drives the wheels; braking gives none back."""
        if not self.motors_on:
            return 0.0
        _, _, _, speed, yaw_rate = self._state
        left_speed, right_speed = wheel_speeds(speed, yaw_rate, self._params)
        left, right = self._torques
        return max(0.0, left * left_speed) + max(0.0, right * right_speed)

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """Return the columns of `actuators`."""
        return (
            "left_wheel_speed_rad_s",
            "right_wheel_speed_rad_s",
            "left_wheel_command_rad_s",
            "right_wheel_command_rad_s",
        )

    @property
    def command_names(self) -> tuple[str, ...]:
        """Return the columns of `commands`."""
        return ("speed_command_m_s", "yaw_rate_command_rad_s")

    def _limits_changed(self) -> None:
        """Take up a new speed limit."""
        self._control.limit_speed(self.speed_limit)
