"""The quadcopter's cascade: position, attitude and height loops, mixer (paper eq. 17-20)."""

from dataclasses import dataclass
from math import asin, atan, atan2, cos, inf, pi, sin, sqrt, tan

from .mixer import Wrench, allocate, clip
from .physics import GRAVITY, require_positive
from .pid import Gains, Pid
from .quadcopter import QuadcopterParams, QuadcopterState, RotorSpeeds
from .robot import Setpoint, Vec3

_IDLE = 0.12  # share of full rotor speed while armed on the ground
_HEIGHT_LEAD = 0.5  # m, how far a height reference may run ahead of the vehicle
_YAW_LEAD = 0.2  # rad, the same for a yaw reference
_HEIGHT_TRIM = 0.3  # m: integrals trim small errors only, else a step would wind them up
_YAW_TRIM = 0.1  # rad
_BRAKING_TIME = 0.7  # s: a hold begins this far ahead, horizontally
_CLIMB_BRAKING_TIME = 0.35  # s: and vertically
_MIN_LIFT = 0.3  # floor of cos(roll) cos(pitch) in (17), and of lift over weight


@dataclass(frozen=True, slots=True, kw_only=True)
class QuadcopterTuning:
    """Gains and limits of the onboard controllers."""

    roll_p: float = 120.0  # 1/s^2; N m/rad in `printed_form`; pitch uses the same
    roll_d: float = 20.0  # 1/s; N m s/rad
    yaw_p: float = 6.0
    yaw_i: float = 0.5
    yaw_d: float = 4.0
    altitude_p: float = 12.0  # 1/s^2
    altitude_i: float = 4.0  # 1/s^3
    altitude_d: float = 6.0  # 1/s
    altitude_i_limit: float = 2.0  # m/s^2, the integral's share
    position_p: float = 4.0  # 1/s^2
    position_d: float = 3.1  # 1/s
    v_max: float = 1.5  # m/s, horizontal
    v_up_max: float = 2.5  # m/s
    v_down_max: float = 1.5  # m/s
    tilt_limit: float = 0.5235987755982988  # rad, 30 degrees
    yaw_rate_max: float = 2.0  # rad/s
    printed_form: bool = False
    """Attitude gains give torques, not accelerations, and the derivative is that of the angle
    error, a moving command included: Table 2 flies only so. Eq. 19 and 20 as in the text."""

    def __post_init__(self) -> None:
        require_positive(self, may_be_zero=("yaw_i", "altitude_i", "altitude_i_limit", "roll_d"))
        if self.tilt_limit > 1.2:
            raise ValueError(f"tilt_limit must be at most 1.2 rad (69 deg), got {self.tilt_limit}")


PROFILES = {
    "default": QuadcopterTuning(),
    "paper": QuadcopterTuning(  # Table 2
        roll_p=3.0,
        roll_d=2.0,
        yaw_p=0.5,
        yaw_i=0.1,
        yaw_d=0.1,
        altitude_p=30.0,
        altitude_i=20.0,
        altitude_d=15.0,
        altitude_i_limit=100.0,
        position_p=5.0,
        position_d=3.0,
        v_up_max=100.0,
        v_down_max=100.0,
        printed_form=True,
    ),
}


class QuadcopterControl:
    """Turns a setpoint and the true state into rotor speed commands, once per `dt`."""

    def __init__(self, params: QuadcopterParams, tuning: QuadcopterTuning, dt: float) -> None:
        self._p = params
        self._t = t = tuning
        self._dt = dt
        self._altitude = Pid(Gains(t.altitude_p, t.altitude_i, t.altitude_d, t.altitude_i_limit))
        self._yaw = Pid(Gains(t.yaw_p, t.yaw_i, t.yaw_d, 100.0 if t.printed_form else 0.5))
        self._speed_per_metre = t.position_p / t.position_d
        self._metres_per_climb = t.altitude_d / t.altitude_p
        self._yaw_error_max = t.yaw_rate_max * t.yaw_d / t.yaw_p
        self._tan_tilt_limit = tan(t.tilt_limit)
        self._height_trim = inf if t.printed_form else _HEIGHT_TRIM
        self._mix = clip if t.printed_form else allocate
        self._lift_max = 4 * params.max_rotor_thrust / params.mass
        full = params.max_rotor_speed
        self._idle = RotorSpeeds(full * _IDLE, full * _IDLE, full * _IDLE, full * _IDLE)
        self.reset()

    def reset(self) -> None:
        """Forget integrals and held references."""
        self._altitude.reset()
        self._yaw.reset()
        self._hold: Vec3 | None = None
        self._height: float | None = None  # reference (NED down) while velocity is tracked
        self._yaw_target: float | None = None
        self._last_tilt: tuple[float, float] | None = None  # commands, in the printed form

    def update(self, state: QuadcopterState, setpoint: Setpoint, on_ground: bool) -> RotorSpeeds:
        """Return the rotor speed commands for the next `dt`.

        On the ground the rotors idle until the setpoint asks to go up.
        """
        if on_ground and not _asks_up(setpoint, state):
            self.reset()
            return self._idle
        p = self._p
        acceleration = self._acceleration(state, setpoint)
        wrench = self._wrench(state, setpoint, acceleration)
        f1, f2, f3, f4 = self._mix(wrench, p.arm_length, p.torque_per_thrust, p.max_rotor_thrust)
        k = 1 / p.thrust_coefficient
        return RotorSpeeds(sqrt(f1 * k), sqrt(f2 * k), sqrt(f3 * k), sqrt(f4 * k))

    def _acceleration(self, s: QuadcopterState, setpoint: Setpoint) -> tuple[float, float, float]:
        """Return the acceleration to fly, NED (eq. 18 and the braces of 17).

        Both are written as eq. 18: a = Kd (v_cmd - v) + a_f, v_cmd = Kp/Kd e + v_d + v_f.
        Within the speed limits, which apply to v_cmd, this is the same.
        """
        t = self._t
        position, velocity, acceleration, _, _ = setpoint
        if position is None and velocity is None and acceleration is None:
            position = self._hold
            if position is None:
                position = self._hold = Vec3(
                    s.north + s.v_north * _BRAKING_TIME,
                    s.east + s.v_east * _BRAKING_TIME,
                    s.down + s.v_down * _CLIMB_BRAKING_TIME,
                )
        else:
            self._hold = None
        if position is None and velocity is None:
            self._height = None
            assert acceleration is not None  # noqa: S101 for the type checker
            return self._limited(s, acceleration)

        vn, ve, vd = velocity or (0.0, 0.0, 0.0)
        an, ae, ad = acceleration or (0.0, 0.0, 0.0)
        v_max, up, fall = t.v_max, t.v_up_max, t.v_down_max
        vd = -up if vd < -up else fall if vd > fall else vd
        if position is not None:
            self._height = None
            north, east, down = position
            k = self._speed_per_metre
            pn, pe = k * (north - s.north), k * (east - s.east)
            speed = sqrt(pn * pn + pe * pe)
            if speed > v_max:
                pn, pe = pn * v_max / speed, pe * v_max / speed
            vn, ve = vn + pn, ve + pe
        else:
            down = self._advance_height(s.down, vd)
        speed = sqrt(vn * vn + ve * ve)
        if speed > v_max:
            vn, ve = vn * v_max / speed, ve * v_max / speed
        d = t.position_d
        an += d * (vn - s.v_north)
        ae += d * (ve - s.v_east)

        error = down - s.down
        low, high = (-up - vd) * self._metres_per_climb, (fall - vd) * self._metres_per_climb
        limited = low if error < low else high if error > high else error
        trims = abs(error) < self._height_trim
        ad += self._altitude.update(limited, vd - s.v_down, self._dt if trims else 0.0)
        return an, ae, ad

    def _advance_height(self, down: float, v_down: float) -> float:
        """Return the height reference of a tracked velocity: an integral that cannot run away."""
        height = self._height
        height = down if height is None else height + v_down * self._dt
        if height > down + _HEIGHT_LEAD:
            height = down + _HEIGHT_LEAD
        elif height < down - _HEIGHT_LEAD:
            height = down - _HEIGHT_LEAD
        self._height = height
        return height

    def _limited(self, s: QuadcopterState, acceleration: Vec3) -> tuple[float, float, float]:
        """Return an acceleration that does not push beyond the tilt and speed limits."""
        t = self._t
        an, ae, ad = acceleration
        size, most = sqrt(an * an + ae * ae), GRAVITY * self._tan_tilt_limit
        if size > most:
            an, ae = an * most / size, ae * most / size
        vn, ve, vd = s.v_north, s.v_east, s.v_down
        speed = sqrt(vn * vn + ve * ve)
        if speed > 0:
            excess = (an * vn + ae * ve) / speed - t.position_d * (t.v_max - speed)
            if excess > 0:
                an -= excess * vn / speed
                ae -= excess * ve / speed
        low, high = t.altitude_d * (-t.v_up_max - vd), t.altitude_d * (t.v_down_max - vd)
        return an, ae, low if ad < low else high if ad > high else ad

    def _wrench(
        self, s: QuadcopterState, setpoint: Setpoint, acceleration: tuple[float, float, float]
    ) -> Wrench:
        """Return thrust and torques (eq. 17); the derivative of an angle comes from body rates."""
        p, t, dt = self._p, self._t, self._dt
        qw, qx, qy, qz = s.qw, s.qx, s.qy, s.qz
        sin_pitch = 2 * (qw * qy - qz * qx)
        upright = 1 - 2 * (qx * qx + qy * qy)  # cos(roll) cos(pitch)
        roll = atan2(2 * (qw * qx + qy * qz), upright)
        pitch = asin(1.0 if sin_pitch > 1 else -1.0 if sin_pitch < -1 else sin_pitch)
        yaw = atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))

        roll_cmd, pitch_cmd = self._tilt(acceleration, yaw)
        yaw_error, yaw_rate_cmd = self._yaw_error(yaw, setpoint.yaw, setpoint.yaw_rate)
        thrust = p.mass * (GRAVITY - acceleration[2])
        thrust = thrust / (upright if upright > _MIN_LIFT else _MIN_LIFT) if thrust > 0 else 0.0

        if t.printed_form:
            last = self._last_tilt or (roll_cmd, pitch_cmd)
            self._last_tilt = (roll_cmd, pitch_cmd)
            roll_error_rate = (roll_cmd - last[0]) / dt - s.roll_rate
            pitch_error_rate = (pitch_cmd - last[1]) / dt - s.pitch_rate
            roll_torque = t.roll_p * (roll_cmd - roll) + t.roll_d * roll_error_rate
            pitch_torque = t.roll_p * (pitch_cmd - pitch) + t.roll_d * pitch_error_rate
            yaw_torque = self._yaw.update(yaw_error, yaw_rate_cmd - s.yaw_rate, dt)
        else:
            roll_torque = p.inertia_x * (t.roll_p * (roll_cmd - roll) - t.roll_d * s.roll_rate)
            pitch_torque = p.inertia_y * (t.roll_p * (pitch_cmd - pitch) - t.roll_d * s.pitch_rate)
            limit = self._yaw_error_max
            limited = -limit if yaw_error < -limit else limit if yaw_error > limit else yaw_error
            yaw_torque = p.inertia_z * self._yaw.update(
                limited, yaw_rate_cmd - s.yaw_rate, dt if abs(yaw_error) < _YAW_TRIM else 0.0
            )

        yaw_limit = 0.3 * thrust * p.torque_per_thrust
        if yaw_torque > yaw_limit:
            yaw_torque = yaw_limit
        elif yaw_torque < -yaw_limit:
            yaw_torque = -yaw_limit
        return Wrench(thrust, roll_torque, pitch_torque, yaw_torque)

    def _tilt(self, acceleration: tuple[float, float, float], yaw: float) -> tuple[float, float]:
        """Return the roll and pitch that point the thrust along `acceleration` (eq. 19).

        Eq. 19 is printed for z up; in NED both signs turn. It assumes small angles and a thrust
        of M g; we divide by the lift asked for and take the arc tangent, so that climbing does
        not disturb a horizontal acceleration. `printed_form` keeps both assumptions.
        """
        printed = self._t.printed_form
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
        rate_max = self._t.yaw_rate_max
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


def _wrapped(angle: float) -> float:
    """Return `angle` in [-pi, pi)."""
    if -pi <= angle < pi:
        return angle
    return (angle + pi) % (2 * pi) - pi


def _asks_up(setpoint: Setpoint, state: QuadcopterState) -> bool:
    """Return whether `setpoint` wants a quadcopter that stands on the ground to leave it."""
    position, velocity, acceleration, _, _ = setpoint
    if position is not None:
        return position.down < state.down - 0.05
    if velocity is not None:
        return velocity.down < -0.02
    return acceleration is not None and acceleration.down < -0.02
