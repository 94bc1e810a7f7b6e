"""The quadcopter's inner loops: attitude, yaw, thrust and the mixer (paper eq. 17, 19 and 20)."""

from math import asin, atan, atan2, cos, hypot, inf, nan, pi, sin, sqrt, tan
from typing import Final

from .mixer import allocate, clip
from .physics import GRAVITY
from .pid import Gains, Pid
from .quadcopter import QuadcopterParams, RotorSpeeds, StateVector
from .quadcopter_tuning import QuadcopterTuning
from .robot import AttitudeSetpoint

_YAW_LEAD: Final = 0.2  # rad, how far a yaw reference may run ahead of the vehicle
_YAW_TRIM: Final = 0.1  # rad: the integral trims small errors only, else a step would wind it up
_MIN_LIFT: Final = 0.3  # floor of cos(roll) cos(pitch) in (17), and of lift over weight

Commands = tuple[float, float, float, float]
"""Roll, pitch and yaw (rad, NED) and thrust (N) that are asked for; NaN where nothing is."""

NO_COMMANDS: Commands = (nan, nan, nan, nan)


class AttitudeControl:
    """Turns an acceleration, or a pilot's angles and thrust, into rotor speed commands."""

    def __init__(self, params: QuadcopterParams, tuning: QuadcopterTuning, dt: float) -> None:
        self._p = params
        self._dt = dt
        self._mass = params.mass
        self._arm = params.arm_length
        self._torque_per_thrust = params.torque_per_thrust
        self._max_thrust = params.max_rotor_thrust
        self._per_coefficient = 1 / params.thrust_coefficient
        self._lift_max = 4 * params.max_rotor_thrust / params.mass
        self._yaw = Pid(Gains(0.0))
        self.retune(tuning)
        self.reset()

    def retune(self, tuning: QuadcopterTuning) -> None:
        """Take up new gains and limits, keeping the integral."""
        p, t, printed = self._p, tuning, tuning.printed_form
        self._printed = printed
        self._roll_p = t.roll_p
        self._roll_d = t.roll_d
        self._tilt_limit = t.tilt_limit
        self._yaw_rate_max = t.yaw_rate_max
        self._yaw.retune(Gains(t.yaw_p, t.yaw_i, t.yaw_d, 100.0 if printed else 0.5))
        self._yaw_error_max = inf if printed else t.yaw_rate_max * t.yaw_d / t.yaw_p
        self._yaw_trim = inf if printed else _YAW_TRIM
        self._inertia = (1.0, 1.0, 1.0) if printed else (p.inertia_x, p.inertia_y, p.inertia_z)
        self._tan_tilt_limit = tan(t.tilt_limit)

    def reset(self) -> None:
        """Forget the integral and held references."""
        self._yaw.reset()
        self._yaw_target: float | None = None
        self._last_tilt: tuple[float, float] | None = None  # commands, in the printed form
        self.commands: Commands = NO_COMMANDS  # what was asked for last

    def accelerate(
        self,
        s: StateVector,
        acceleration: tuple[float, float, float],
        yaw_target: float | None,
        yaw_rate: float | None,
    ) -> RotorSpeeds:
        """Return the rotor speeds for an acceleration in NED (eq. 17 and 19).

        The derivative of an angle comes from body rates.
        """
        roll, pitch, yaw, upright = _euler(s[6], s[7], s[8], s[9])
        roll_cmd, pitch_cmd = self._tilt(acceleration, yaw)
        yaw_error, yaw_rate_cmd = self._yaw_error(yaw, yaw_target, yaw_rate)
        roll_speed = pitch_speed = 0.0
        if self._printed:
            last = self._last_tilt or (roll_cmd, pitch_cmd)
            self._last_tilt = (roll_cmd, pitch_cmd)
            roll_speed = (roll_cmd - last[0]) / self._dt
            pitch_speed = (pitch_cmd - last[1]) / self._dt
        thrust = self._thrust(acceleration[2], upright)
        self.commands = (roll_cmd, pitch_cmd, yaw + yaw_error, thrust)
        return self._rotors(
            thrust,
            roll_cmd - roll,
            pitch_cmd - pitch,
            yaw_error,
            roll_speed - s[10],
            pitch_speed - s[11],
            yaw_rate_cmd - s[12],
        )

    def point(
        self, s: StateVector, setpoint: AttitudeSetpoint, a_down: float | None
    ) -> RotorSpeeds:
        """Return the rotor speeds for a pilot's angles, or body rates where there are none.

        The thrust is the setpoint's, or what gives the acceleration `a_down`. Angles beyond
        the tilt limit are scaled down together, so their direction stays.
        """
        target_roll, target_pitch, target_yaw, yaw_rate, thrust, _, roll_rate, pitch_rate = setpoint
        roll, pitch, yaw, upright = _euler(s[6], s[7], s[8], s[9])
        if a_down is None:
            force = (thrust or 0.0) * 4 * self._max_thrust
        else:
            force = self._thrust(a_down, upright)
        roll_error = pitch_error = yaw_error = 0.0
        if target_roll is None and target_pitch is None:
            self._yaw_target = None
            self.commands = (nan, nan, nan, force)
        else:
            target_roll, target_pitch = target_roll or 0.0, target_pitch or 0.0
            tilt = hypot(target_roll, target_pitch)
            if tilt > self._tilt_limit:
                target_roll *= self._tilt_limit / tilt
                target_pitch *= self._tilt_limit / tilt
            yaw_error, yaw_rate = self._yaw_error(yaw, target_yaw, yaw_rate)
            roll_error, pitch_error = target_roll - roll, target_pitch - pitch
            self.commands = (target_roll, target_pitch, yaw + yaw_error, force)
        return self._rotors(
            force,
            roll_error,
            pitch_error,
            yaw_error,
            (roll_rate or 0.0) - s[10],
            (pitch_rate or 0.0) - s[11],
            (yaw_rate or 0.0) - s[12],
        )

    def _rotors(
        self,
        thrust: float,
        roll_error: float,
        pitch_error: float,
        yaw_error: float,
        roll_rate_error: float,
        pitch_rate_error: float,
        yaw_rate_error: float,
    ) -> RotorSpeeds:
        """Return the rotor speeds for a thrust (N) and what is wrong in roll, pitch and yaw."""
        inertia_x, inertia_y, inertia_z = self._inertia
        roll_torque = inertia_x * (self._roll_p * roll_error + self._roll_d * roll_rate_error)
        pitch_torque = inertia_y * (self._roll_p * pitch_error + self._roll_d * pitch_rate_error)
        limit = self._yaw_error_max
        limited = -limit if yaw_error < -limit else limit if yaw_error > limit else yaw_error
        dt = self._dt if abs(yaw_error) < self._yaw_trim else 0.0
        yaw_torque = inertia_z * self._yaw.update(limited, yaw_rate_error, dt)
        yaw_limit = 0.3 * thrust * self._torque_per_thrust
        if yaw_torque > yaw_limit:
            yaw_torque = yaw_limit
        elif yaw_torque < -yaw_limit:
            yaw_torque = -yaw_limit
        wrench = (thrust, roll_torque, pitch_torque, yaw_torque)
        if self._printed:
            thrusts = clip(wrench, self._arm, self._torque_per_thrust, self._max_thrust)
        else:
            thrusts = allocate(wrench, self._arm, self._torque_per_thrust, self._max_thrust)
        f1, f2, f3, f4 = thrusts
        k = self._per_coefficient
        return sqrt(f1 * k), sqrt(f2 * k), sqrt(f3 * k), sqrt(f4 * k)

    def _thrust(self, a_down: float, upright: float) -> float:
        """Return the thrust (N) for a vertical acceleration at an attitude (eq. 17)."""
        thrust = self._mass * (GRAVITY - a_down)
        return thrust / (upright if upright > _MIN_LIFT else _MIN_LIFT) if thrust > 0 else 0.0

    def _tilt(self, acceleration: tuple[float, float, float], yaw: float) -> tuple[float, float]:
        """Return the roll and pitch that point the thrust along `acceleration` (eq. 19).

        Eq. 19 is printed for z up; in NED both signs turn. It assumes small angles and a thrust
        of M g; we divide by the lift asked for and take the arc tangent, so that climbing does
        not disturb a horizontal acceleration. `printed_form` keeps both assumptions.
        """
        printed = self._printed
        an, ae, ad = acceleration
        lift = GRAVITY if printed else GRAVITY - ad
        if lift > self._lift_max:
            lift = self._lift_max
        elif lift < _MIN_LIFT * GRAVITY:
            lift = _MIN_LIFT * GRAVITY
        sin_yaw, cos_yaw = sin(yaw), cos(yaw)
        forward = (an * cos_yaw + ae * sin_yaw) / lift
        right = (ae * cos_yaw - an * sin_yaw) / lift
        slope = sqrt(forward * forward + right * right)
        if slope > self._tan_tilt_limit:
            forward *= self._tan_tilt_limit / slope
            right *= self._tan_tilt_limit / slope
        if printed:
            return right, -forward
        pitch = -atan(forward)
        return atan(right * cos(pitch)), pitch

    def _yaw_error(
        self, yaw: float, target: float | None, rate: float | None
    ) -> tuple[float, float]:
        """Return yaw error and rate feed-forward; a rate alone moves the held yaw target."""
        rate_max = self._yaw_rate_max
        rate = rate or 0.0
        rate = -rate_max if rate < -rate_max else rate_max if rate > rate_max else rate
        if target is None:
            target = yaw if self._yaw_target is None else self._yaw_target
            if rate:
                lead = _wrapped(target + rate * self._dt - yaw)
                lead = -_YAW_LEAD if lead < -_YAW_LEAD else _YAW_LEAD if lead > _YAW_LEAD else lead
                target = yaw + lead
        self._yaw_target = target
        return _wrapped(target - yaw), rate


def _euler(qw: float, qx: float, qy: float, qz: float) -> tuple[float, float, float, float]:
    """Return roll, pitch, yaw and cos(roll) cos(pitch) of an attitude."""
    sin_pitch = 2 * (qw * qy - qz * qx)
    upright = 1 - 2 * (qx * qx + qy * qy)
    return (
        atan2(2 * (qw * qx + qy * qz), upright),
        asin(1.0 if sin_pitch > 1 else -1.0 if sin_pitch < -1 else sin_pitch),
        atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz)),
        upright,
    )


def _wrapped(angle: float) -> float:
    """Return `angle` in [-pi, pi)."""
    if -pi <= angle < pi:
        return angle
    return (angle + pi) % (2 * pi) - pi
