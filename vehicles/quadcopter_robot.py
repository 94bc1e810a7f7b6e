"""A quadcopter as the autopilot sees it: physics, ground contact and onboard controllers."""

from collections.abc import Callable, Mapping

from .disturbance import BodyForce
from .physics import GRAVITY, Force
from .quadcopter import (
    QuadcopterParams,
    QuadcopterState,
    RotorSpeeds,
    spinner,
    stepper,
    thrust,
)
from .quadcopter_control import QuadcopterControl
from .quadcopter_tuning import QuadcopterTuning
from .robot import AttitudeSetpoint, Kinematics, Limits, Setpoint
from .speed_limit import SpeedLimit

_OFF = RotorSpeeds()
_FASTEST = 20.0  # m/s that anybody may ask for, horizontally
_FASTEST_CLIMB = 10.0  # m/s
_SKIP = 0.05  # m/s: a slower touch belongs to the landing before it
_STOPPED = 1.0  # rad/s: slower rotors with no command are at rest


class Quadcopter:
    """Implements `Robot`. The ground is a level plane at the height where it starts.

    It stands still until its thrust exceeds its weight; touching down stops it and levels it.
    `retuned` returns a tuning with changes in it, or raises ValueError.
    """

    speed_limit = SpeedLimit(_FASTEST)
    climb_limit = SpeedLimit(_FASTEST_CLIMB)
    descent_limit = SpeedLimit(_FASTEST_CLIMB)

    def __init__(
        self,
        params: QuadcopterParams,
        control: QuadcopterControl,
        state: QuadcopterState,
        disturbance: BodyForce,
        dt: float,
        control_every: int,
        retuned: Callable[[QuadcopterTuning, Mapping[str, float]], QuadcopterTuning],
    ) -> None:
        self.dt = dt
        self.control_every = control_every
        self.motors_on = False
        self.on_ground = True
        self.impact_speed = 0.0  # m/s down, of the last touch-down
        self.state = state
        self._params = params
        self._ground = state.down
        self._control = control
        self._retuned = retuned
        self._disturbance = disturbance
        self._commands = _OFF
        self._spin = spinner(params, dt)
        self._step = stepper(params, dt)

    def kinematics(self) -> Kinematics:
        """Return the true state."""
        return Kinematics(*self.state[:13])

    def control(self, setpoint: Setpoint | AttitudeSetpoint) -> None:
        """Run the PID stack once and set the rotor commands; with motors off they are zero."""
        if not self.motors_on:
            self._commands = _OFF
        elif isinstance(setpoint, Setpoint):
            self._commands = self._control.update(self.state, setpoint, self.on_ground)
        else:
            self._commands = self._control.point(self.state, setpoint, self.on_ground)

    @property
    def limits(self) -> Limits:
        """Return the limits that hold now."""
        return self._control.limits

    def retune(self, **changes: float) -> None:
        """Replace gains and limits by their names; ValueError changes nothing."""
        self._control.retune(self._retuned(self._control.tuning, changes))
        self.limits_changed()

    def limits_changed(self) -> None:
        """Take up new speed limits."""
        self._control.limit_speeds(self.speed_limit, self.climb_limit, self.descent_limit)

    def reset_control(self) -> None:
        """Forget integrals and held references."""
        self._control.reset()

    def advance(self) -> None:
        """Advance physics and disturbance by one step of `dt`."""
        commands = self._commands if self.motors_on else _OFF
        if self.on_ground and not self._lifts_off(commands):
            return
        state = self._step(self.state, commands, self._disturbance.next())
        if state[2] >= self._ground and state[5] >= 0:
            self._touch_down(state)
        else:
            self.state = state

    def actuators(self) -> tuple[float, ...]:
        """Return rotor speeds and their commands in rad/s."""
        return (*self.state[13:], *(self._commands if self.motors_on else _OFF))

    def outputs(self) -> tuple[float, ...]:
        """Return the rotor commands as shares of full speed, 0..1."""
        most = self._params.max_rotor_speed
        return tuple(w / most for w in (self._commands if self.motors_on else _OFF))

    def specific_force(self) -> Force:
        """Return what an IMU feels (m/s^2, FRD): the rotors' lift and the disturbance."""
        if self.on_ground:
            return (0.0, 0.0, -GRAVITY)  # it stands level
        fx, fy, fz = self._disturbance.force or (0.0, 0.0, 0.0)
        mass = self._params.mass
        return (fx / mass, fy / mass, (fz - thrust(self.state, self._params)) / mass)

    def shaft_power(self) -> float:
        """Return the power in W against the propellers' drag (eq. 13: torque k_Q w^2)."""
        w1, w2, w3, w4 = self.state[13:]
        drag = self._params.thrust_coefficient * self._params.torque_per_thrust
        return drag * (w1 * w1 * w1 + w2 * w2 * w2 + w3 * w3 * w3 + w4 * w4 * w4)

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """Return the columns of `actuators`."""
        speeds = [f"rotor{i}_speed_rad_s" for i in range(1, 5)]
        commands = [f"rotor{i}_command_rad_s" for i in range(1, 5)]
        return (*speeds, *commands)

    def _lifts_off(self, commands: RotorSpeeds) -> bool:
        """Return whether the thrust exceeds the weight; if not, turn the rotors for `dt`."""
        state = self.state
        if commands is _OFF and state.w1 == state.w2 == state.w3 == state.w4 == 0:
            return False
        if thrust(state, self._params) > self._params.weight:
            self.on_ground = False
            return True
        speeds = self._spin(state, commands)
        if commands is _OFF and max(speeds) < _STOPPED:
            speeds = _OFF
        self.state = QuadcopterState(*state[:13], *speeds)
        return False

    def _touch_down(self, state: QuadcopterState) -> None:
        """Stand still and level at `state`, on the ground, keeping yaw."""
        self.on_ground = True
        if state.v_down > _SKIP:
            self.impact_speed = state.v_down
        w, z = state.qw, state.qz
        norm = (w * w + z * z) ** 0.5
        w, z = (w / norm, z / norm) if norm > 0 else (1.0, 0.0)
        self.state = QuadcopterState(
            state.north, state.east, self._ground, 0.0, 0.0, 0.0, w, 0.0, 0.0, z, 0.0, 0.0, 0.0,
            *state[13:],
        )  # fmt: skip
