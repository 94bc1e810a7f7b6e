"""The quadcopter's outer loops: position, velocity and height (paper eq. 17 and 18)."""

from math import copysign, inf, sqrt, tan
from typing import Final

from .attitude_control import AttitudeControl, Commands
from .physics import GRAVITY
from .pid import Gains, Pid
from .quadcopter import QuadcopterParams, RotorSpeeds, StateVector
from .quadcopter_tuning import QuadcopterTuning
from .robot import AttitudeSetpoint, Limits, Setpoint, Vec3

_IDLE: Final = 0.12  # share of full rotor speed while armed on the ground
_CLIMBS: Final = 0.02  # m/s (m/s^2): so much asks to leave the ground
_HEIGHT_LEAD: Final = 0.5  # m, how far a height reference may run ahead of the vehicle
_HEIGHT_TRIM: Final = 0.3  # m: integrals trim small errors only, else a step would wind them up
_BRAKING_TIME: Final = 0.7  # s: a hold begins this far ahead, horizontally
_CLIMB_BRAKING_TIME: Final = 0.35  # s: and vertically
_BRAKING_LAG: Final = 0.35  # s before the vehicle leans against its motion
_STOPPING: Final = 3.5  # m/s^2, of a hold that begins fast
_BRAKING: Final = 2.0  # m/s^2, before a position, where `accel_max` does not say
_BRAKING_SHARE: Final = 0.7  # of `accel_max`: the rest corrects


class QuadcopterControl:
    """Turns a setpoint and the true state into rotor speed commands, once per `dt`."""

    def __init__(self, params: QuadcopterParams, tuning: QuadcopterTuning, dt: float) -> None:
        self.tuning = tuning
        self._dt = dt
        self._altitude = Pid(Gains(0.0))
        self._attitude = AttitudeControl(params, tuning, dt)
        self._lift_max = 4 * params.max_rotor_thrust / params.mass
        self._full = params.max_rotor_speed
        self._idle = self._evenly(_IDLE)
        self._hover = sqrt(GRAVITY / self._lift_max)  # share of full rotor speed
        self.retune(tuning)
        self.reset()

    def retune(self, tuning: QuadcopterTuning) -> None:
        """Take up new gains and limits, keeping integrals and held references."""
        self.tuning = t = tuning
        self._attitude.retune(t)
        self._altitude.retune(Gains(t.altitude_p, t.altitude_i, t.altitude_d, t.altitude_i_limit))
        self._position_d = t.position_d
        self._altitude_p = t.altitude_p
        self._altitude_d = t.altitude_d
        self._climb_accel_max = t.climb_accel_max
        self._spool_time = t.spool_time
        self._speed_per_metre = t.position_p / t.position_d
        self._metres_per_climb = t.altitude_d / t.altitude_p
        self._height_trim = inf if t.printed_form else _HEIGHT_TRIM
        self._accel_max = t.accel_max or inf
        self._stopping = inf if t.printed_form else _STOPPING
        self._braking = inf if t.printed_form else _BRAKING_SHARE * t.accel_max or _BRAKING
        self._slope_max = GRAVITY * tan(t.tilt_limit)
        self.limit_speeds(None, None, None)

    def limit_speeds(self, speed: float | None, up: float | None, down: float | None) -> None:
        """Fly within these speeds (m/s), None: those of the tuning."""
        t = self.tuning
        self._v_max = speed or t.v_max
        self._up_max = up or t.v_up_max
        self._down_max = down or t.v_down_max

    @property
    def limits(self) -> Limits:
        """Return the limits that hold now."""
        t, hover = self.tuning, GRAVITY / self._lift_max
        return Limits(
            self._v_max, t.yaw_rate_max, self._up_max, self._down_max, t.tilt_limit, hover
        )

    @property
    def commands(self) -> Commands:
        """Return the roll, pitch and yaw (rad) and the thrust (N) asked for last; NaN: none."""
        return self._attitude.commands

    def reset(self) -> None:
        """Forget integrals and held references."""
        self._altitude.reset()
        self._attitude.reset()
        self._hold: Vec3 | None = None
        self._height: float | None = None  # reference (NED down) while velocity is tracked
        self._v_down = 0.0  # and its speed
        self._spooled = 0.0  # s since rotors on the ground began to turn faster

    def update(self, state: StateVector, setpoint: Setpoint, on_ground: bool) -> RotorSpeeds:
        """Return the rotor speed commands for the next `dt`.

        On the ground the rotors idle until the setpoint asks to go up, then spool up.
        """
        if on_ground and (rotors := self._standing(_asks_up(setpoint, state[2]))):
            return rotors
        acceleration = self._acceleration(state, setpoint)
        return self._attitude.accelerate(state, acceleration, setpoint.yaw, setpoint.yaw_rate)

    def point(self, state: StateVector, setpoint: AttitudeSetpoint, on_ground: bool) -> RotorSpeeds:
        """Return the rotor speed commands for a pilot's angles and thrust or climb rate.

        On the ground the rotors only turn, all alike, until they lift the vehicle.
        """
        self._hold = None
        thrust, climb = setpoint.thrust, setpoint.climb_rate or 0.0
        if thrust is not None:
            self._height = None
            if on_ground and thrust * self._lift_max <= GRAVITY:
                self.reset()
                return self._evenly(max(_IDLE, sqrt(max(thrust, 0.0))))
            return self._attitude.point(state, setpoint, None)
        if on_ground and (rotors := self._standing(climb > _CLIMBS)):
            return rotors
        a_down = self._vertical(state, None, -climb, 0.0, self._climb_accel_max)
        return self._attitude.point(state, setpoint, a_down)

    def _standing(self, asks_up: bool) -> RotorSpeeds | None:
        """Return the rotor speeds of a vehicle on the ground, None when it shall lift off."""
        if not asks_up:
            self.reset()
            return self._idle
        whole = self._spool_time
        if self._spooled >= whole:
            return None
        self._spooled += self._dt
        return self._evenly(_IDLE + (self._hover - _IDLE) * min(self._spooled / whole, 1.0))

    def _acceleration(self, s: StateVector, setpoint: Setpoint) -> tuple[float, float, float]:
        """Return the acceleration to fly, NED (eq. 18 and the braces of 17).

        Both are written as eq. 18: a = Kd (v_cmd - v) + a_f, v_cmd = Kp/Kd e + v_d + v_f.
        Within the speed limits, which apply to v_cmd, this is the same. So far from a position
        that Kp/Kd e could not be braked from, it is what can: sqrt(2 a e), moved to join.
        """
        position, velocity, acceleration, _, _ = setpoint
        braking, accel_max, soft = self._braking, self._accel_max, self._climb_accel_max
        if position is None and velocity is None and acceleration is None:
            position = self._hold
            if position is None:
                position = self._hold = self._stopping_point(s)
            braking, accel_max, soft = self._stopping, inf, 0.0
        else:
            self._hold = None
        if position is None and velocity is None:
            self._height = None
            assert acceleration is not None  # noqa: S101 for the type checker
            return self._limited(s, acceleration)

        vn = ve = vd = an = ae = ad = 0.0
        if velocity is not None:
            vn, ve, vd = velocity
        if acceleration is not None:
            an, ae, ad = acceleration
        v_max = self._v_max
        down = None
        if position is not None:
            north, east, down = position
            k = self._speed_per_metre
            pn, pe = k * (north - s[0]), k * (east - s[1])
            speed = sqrt(pn * pn + pe * pe)
            joint = braking / k
            if speed > v_max or speed > joint:
                most = v_max if joint >= v_max else min(v_max, _braked(speed, joint))
                pn, pe = pn * most / speed, pe * most / speed
            vn, ve = vn + pn, ve + pe
        speed = sqrt(vn * vn + ve * ve)
        if speed > v_max:
            vn, ve = vn * v_max / speed, ve * v_max / speed
        d = self._position_d
        an += d * (vn - s[3])
        ae += d * (ve - s[4])
        if accel_max < inf:
            size = sqrt(an * an + ae * ae)
            if size > accel_max:
                an, ae = an * accel_max / size, ae * accel_max / size
        return an, ae, self._vertical(s, down, vd, ad, soft)

    def _stopping_point(self, s: StateVector) -> Vec3:
        """Return where the vehicle can come to rest without flying back."""
        north, east, down, v_north, v_east, v_down = s[0], s[1], s[2], s[3], s[4], s[5]
        speed = sqrt(v_north * v_north + v_east * v_east)
        time = max(_BRAKING_TIME, _BRAKING_LAG + speed / (2 * self._stopping))
        return Vec3(
            north + v_north * time,
            east + v_east * time,
            down + v_down * _CLIMB_BRAKING_TIME,
        )

    def _vertical(
        self, s: StateVector, down: float | None, v_down: float, a_down: float, soft: float
    ) -> float:
        """Return the acceleration down that flies to a height, or a velocity where it is None.

        `soft` (m/s^2) limits what is asked for; 0 does not.
        """
        up, fall, per_climb = self._up_max, self._down_max, self._metres_per_climb
        v_down = -up if v_down < -up else fall if v_down > fall else v_down
        if down is None:
            if soft:
                v_down = self._ramped(s[5], v_down, soft * self._dt)
            down = self._advance_height(s[2], v_down)
        else:
            self._height = None
        error = limited = down - s[2]
        if soft:
            limited = _braked(error, _BRAKING_SHARE * soft * per_climb * per_climb)
        low, high = (-up - v_down) * per_climb, (fall - v_down) * per_climb
        limited = low if limited < low else high if limited > high else limited
        rate = v_down - s[5]
        trims = abs(error) < self._height_trim
        if soft and self._height is None:  # the integral, too, and it must not wind up on this
            p, rest = self._altitude_p, self._altitude_d * rate
            rest += self._altitude.integral
            soft_limited = min(max(limited, (-soft - rest) / p), (soft - rest) / p)
            trims = trims and soft_limited == limited
            limited = soft_limited
        return a_down + self._altitude.update(limited, rate, self._dt if trims else 0.0)

    def _ramped(self, v_now: float, v_down: float, step: float) -> float:
        """Return the speed of the height reference, `step` nearer to `v_down`."""
        last = v_now if self._height is None else self._v_down
        self._v_down = min(max(v_down, last - step), last + step)
        return self._v_down

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

    def _limited(self, s: StateVector, acceleration: Vec3) -> tuple[float, float, float]:
        """Return an acceleration that does not push beyond the tilt and speed limits."""
        an, ae, ad = acceleration
        size, most = sqrt(an * an + ae * ae), self._slope_max
        if size > most:
            an, ae = an * most / size, ae * most / size
        vn, ve, vd = s[3], s[4], s[5]
        speed = sqrt(vn * vn + ve * ve)
        if speed > 0:
            excess = (an * vn + ae * ve) / speed - self._position_d * (self._v_max - speed)
            if excess > 0:
                an -= excess * vn / speed
                ae -= excess * ve / speed
        d = self._altitude_d
        low, high = d * (-self._up_max - vd), d * (self._down_max - vd)
        return an, ae, low if ad < low else high if ad > high else ad

    def _evenly(self, share: float) -> RotorSpeeds:
        """Return all rotors at this share of full speed."""
        w = self._full * share
        return w, w, w, w


def _braked(value: float, joint: float) -> float:
    """Return `value` as it is up to `joint`, then growing as its square root only.

    A speed proportional to a distance cannot be braked from afar; this one can, at one constant
    deceleration beyond the joint.
    """
    size = abs(value)
    return value if size <= joint else copysign(sqrt(joint * (2 * size - joint)), value)


def _asks_up(setpoint: Setpoint, down: float) -> bool:
    """Return whether `setpoint` wants a quadcopter that stands at `down` to leave the ground."""
    position, velocity, acceleration, _, _ = setpoint
    if position is not None:
        return position.down < down - 0.05
    if velocity is not None:
        return velocity.down < -_CLIMBS
    return acceleration is not None and acceleration.down < -_CLIMBS
