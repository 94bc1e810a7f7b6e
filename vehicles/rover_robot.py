"""A rover as the autopilot sees it: physics and onboard controllers."""

from math import cos, sin

from .disturbance import BodyForce
from .robot import Kinematics, Setpoint
from .rover import RoverParams, RoverState, Wheels, stepper, wheel_speeds
from .rover_control import RoverControl

_OFF = Wheels()
_PARKED = 1e-3  # m/s and rad/s: slower than this with motors off, it stands


class Rover:
    """Implements `Robot`. It drives on a level plane at the height where it starts.

    With motors off it coasts to a halt against drag, and once still it stays where it is.
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
    ) -> None:
        self.dt = dt
        self.control_every = control_every
        self.motors_on = False
        self.on_ground = True
        self.state = state
        self._params = params
        self._down = down
        self._control = control
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

    def control(self, setpoint: Setpoint) -> None:
        """Run the PID stack once and set the wheel torques; with motors off they are zero."""
        if self.motors_on:
            self._torques = self._control.update(self.state, setpoint)
        else:
            self._torques = _OFF

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

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """Return the columns of `actuators`."""
        return (
            "left_wheel_speed_rad_s",
            "right_wheel_speed_rad_s",
            "left_wheel_command_rad_s",
            "right_wheel_command_rad_s",
        )
