"""A quadcopter as the autopilot sees it: physics, ground contact and onboard controllers."""

from collections.abc import Callable, Mapping
from typing import Final

from .attitude_control import NO_COMMANDS
from .disturbance import BodyForce
from .physics import GRAVITY, Force
from .quadcopter import (
    QuadcopterParams,
    QuadcopterPhysics,
    QuadcopterState,
    RotorSpeeds,
    StateVector,
    thrust,
)
from .quadcopter_control import QuadcopterControl
from .quadcopter_tuning import QuadcopterTuning
from .robot import AttitudeSetpoint, Kinematics, Limits, Robot, Setpoint

_OFF: RotorSpeeds = (0.0, 0.0, 0.0, 0.0)
_FASTEST: Final = 20.0  # m/s that anybody may ask for, horizontally
_FASTEST_CLIMB: Final = 10.0  # m/s
_SKIP: Final = 0.05  # m/s: a slower touch belongs to the landing before it
_STOPPED: Final = 1.0  # rad/s: slower rotors with no command are at rest


class Quadcopter(Robot):
    """Implements `Robot`. The ground is a level plane at the height where it starts.

    It stands still until its thrust exceeds its weight; touching down stops it and levels it.
    `retuned` returns a tuning with changes in it, or raises ValueError.
    """

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
        super().__init__(dt, control_every, _FASTEST, _FASTEST_CLIMB)
        self.impact_speed = 0.0  # m/s down, of the last touch-down
        self._state: StateVector = state
        self._params = params
        self._ground = state.down
        self._control = control
        self._retuned = retuned
        self._disturbance = disturbance
        self._physics = QuadcopterPhysics(params, dt)
        self._commands: RotorSpeeds = _OFF
        self._is_controlled = False  # the commands are the controllers', not those of no motors

    @property
    def state(self) -> QuadcopterState:
        """Return the true state with the rotors."""
        return QuadcopterState(*self._state)

    def place(self) -> tuple[float, float, float]:
        """Return where it truly is: north, east, down."""
        state = self._state
        return (state[0], state[1], state[2])

    def kinematics(self) -> Kinematics:
        """Return the true state."""
        n, e, d, vn, ve, vd, w, x, y, z, p, q, r, _, _, _, _ = self._state
        fields = (n, e, d, vn, ve, vd, w, x, y, z, p, q, r)
        return tuple.__new__(Kinematics, fields)  # what Kinematics(...) does in twice the time

    def control(self, setpoint: Setpoint | AttitudeSetpoint) -> None:
        """Run the PID stack once and set the rotor commands; with motors off they are zero."""
        self._is_controlled = self.motors_on
        if not self.motors_on:
            self._commands = _OFF
        elif isinstance(setpoint, Setpoint):
            self._commands = self._control.update(self._state, setpoint, self.on_ground)
        else:
            self._commands = self._control.point(self._state, setpoint, self.on_ground)

    @property
    def limits(self) -> Limits:
        """Return the limits that hold now."""
        return self._control.limits

    def retune(self, **changes: float) -> None:
        """Replace gains and limits by their names; ValueError changes nothing."""
        self._control.retune(self._retuned(self._control.tuning, changes))
        self._limits_changed()

    def reset_control(self) -> None:
        """Forget integrals and held references."""
        self._control.reset()

    def advance(self) -> None:
        """Advance physics and disturbance by one step of `dt`."""
        commands = self._commands if self.motors_on else _OFF
        if self.on_ground and not self._lifts_off(commands):
            return
        state = self._physics.step(self._state, commands, self._disturbance.next())
        if state[2] >= self._ground and state[5] >= 0:
            self._touch_down(state)
        else:
            self._state = state

    def actuators(self) -> tuple[float, ...]:
        """Return rotor speeds and their commands in rad/s."""
        c1, c2, c3, c4 = self._commands if self.motors_on else _OFF
        s = self._state
        return (s[13], s[14], s[15], s[16], c1, c2, c3, c4)

    def commands(self) -> tuple[float, ...]:
        """Return the attitude (rad) and thrust (N) asked for; NaN while there is none."""
        return self._control.commands if self.motors_on else NO_COMMANDS

    def outputs(self) -> tuple[float, ...]:
        """Return the rotor commands as shares of full speed, 0..1."""
        most = self._params.max_rotor_speed
        w1, w2, w3, w4 = self._commands if self.motors_on else _OFF
        return (w1 / most, w2 / most, w3 / most, w4 / most)

    def specific_force(self) -> Force:
        """Return what an IMU feels (m/s^2, FRD): the rotors' lift and the disturbance."""
        if self.on_ground:
            return (0.0, 0.0, -GRAVITY)  # it stands level
        fx, fy, fz = self._disturbance.force or (0.0, 0.0, 0.0)
        mass = self._params.mass
        return (fx / mass, fy / mass, (fz - thrust(self._state, self._params)) / mass)

    def shaft_power(self) -> float:
        """Return the power in W against the propellers' drag (eq. 13: torque k_Q w^2)."""
        s = self._state
        w1, w2, w3, w4 = s[13], s[14], s[15], s[16]
        drag = self._params.thrust_coefficient * self._params.torque_per_thrust
        return drag * (w1 * w1 * w1 + w2 * w2 * w2 + w3 * w3 * w3 + w4 * w4 * w4)

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """Return the columns of `actuators`."""
        speeds = [f"rotor{i}_speed_rad_s" for i in range(1, 5)]
        commands = [f"rotor{i}_command_rad_s" for i in range(1, 5)]
        return (*speeds, *commands)

    @property
    def command_names(self) -> tuple[str, ...]:
        """Return the columns of `commands`."""
        return ("roll_command_rad", "pitch_command_rad", "yaw_command_rad", "thrust_command_n")

    def _limits_changed(self) -> None:
        """Take up new speed limits."""
        self._control.limit_speeds(self.speed_limit, self.climb_limit, self.descent_limit)

    def _lifts_off(self, commands: RotorSpeeds) -> bool:
        """Return whether the thrust exceeds the weight; if not, turn the rotors for `dt`."""
        n, e, d, vn, ve, vd, w, x, y, z, p, q, r, w1, w2, w3, w4 = state = self._state
        is_off = not (self.motors_on and self._is_controlled)
        if is_off and w1 == w2 == w3 == w4 == 0:
            return False
        if thrust(state, self._params) > self._params.weight:
            self.on_ground = False
            return True
        w1, w2, w3, w4 = self._physics.spin(state, commands)
        if is_off and max(w1, w2, w3, w4) < _STOPPED:
            w1, w2, w3, w4 = _OFF
        self._state = (n, e, d, vn, ve, vd, w, x, y, z, p, q, r, w1, w2, w3, w4)
        return False

    def _touch_down(self, state: StateVector) -> None:
        """Stand still and level at `state`, on the ground, keeping yaw."""
        self.on_ground = True
        n, e, _, _, _, v_down, w, _, _, z, _, _, _, w1, w2, w3, w4 = state
        if v_down > _SKIP:
            self.impact_speed = v_down
        norm = (w * w + z * z) ** 0.5
        w, z = (w / norm, z / norm) if norm > 0 else (1.0, 0.0)
        self._state = (
            n, e, self._ground, 0.0, 0.0, 0.0, w, 0.0, 0.0, z, 0.0, 0.0, 0.0, w1, w2, w3, w4,
        )  # fmt: skip
