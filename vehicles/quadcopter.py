"""Quadcopter: parameters, state and equations of motion (paper eq. 7-14). NED, body FRD.

Rotors: 1 front, 2 right, 3 rear, 4 left; 1 and 3 spin clockwise seen from above.
"""

from dataclasses import dataclass
from math import exp, sqrt
from typing import NamedTuple

from .physics import GRAVITY, Force, require_positive


@dataclass(frozen=True, slots=True, kw_only=True)
class QuadcopterParams:
    """Physical constants of one quadcopter, SI units (paper Table 1 where it has them)."""

    mass: float = 1.2  # kg
    inertia_x: float = 4.836e-3  # kg m^2, body axes
    inertia_y: float = 4.836e-3
    inertia_z: float = 8.325e-3  # Table 1 prints a tenth of it, which no flat machine can have
    rotor_inertia: float = 1.05e-5  # kg m^2, motor and propeller about the shaft
    arm_length: float = 0.20  # m, shaft to centre of gravity
    thrust_coefficient: float = 8.54858e-6  # N s^2: thrust over speed squared
    torque_per_thrust: float = 0.016  # m: propeller drag torque over thrust, k_Q / k
    max_rotor_speed: float = 838.0  # rad/s
    motor_lag: float = 0.02  # s, time constant of a motor's speed servo

    def __post_init__(self) -> None:
        require_positive(self, may_be_zero=("rotor_inertia",))
        if 4 * self.max_rotor_thrust <= self.weight:
            raise ValueError(
                f"mass {self.mass} kg weighs {self.weight:.1f} N but the rotors lift at most "
                f"{4 * self.max_rotor_thrust:.1f} N: lower mass or raise max_rotor_speed"
            )

    @property
    def weight(self) -> float:
        """Return M g in N."""
        return self.mass * GRAVITY

    @property
    def max_rotor_thrust(self) -> float:
        """Return the thrust of one rotor at full speed in N (eq. 10)."""
        return self.thrust_coefficient * self.max_rotor_speed * self.max_rotor_speed


class QuadcopterState(NamedTuple):
    """Position and velocity in NED, attitude FRD to NED, body rates, rotor speeds."""

    north: float = 0.0
    east: float = 0.0
    down: float = 0.0
    v_north: float = 0.0
    v_east: float = 0.0
    v_down: float = 0.0
    qw: float = 1.0
    qx: float = 0.0
    qy: float = 0.0
    qz: float = 0.0
    roll_rate: float = 0.0
    pitch_rate: float = 0.0
    yaw_rate: float = 0.0
    w1: float = 0.0
    w2: float = 0.0
    w3: float = 0.0
    w4: float = 0.0


StateVector = tuple[
    float, float, float, float, float, float, float, float, float,
    float, float, float, float, float, float, float, float,
]  # fmt: skip
"""A QuadcopterState without its names: what the hot path passes on."""

RotorSpeeds = tuple[float, float, float, float]
"""Speeds of rotors 1 to 4, rad/s, all positive."""


def thrust(state: StateVector, p: QuadcopterParams) -> float:
    """Return the total thrust in N (eq. 10)."""
    w1, w2, w3, w4 = state[13], state[14], state[15], state[16]
    return p.thrust_coefficient * (w1 * w1 + w2 * w2 + w3 * w3 + w4 * w4)


class QuadcopterPhysics:
    """Advances one quadcopter by `dt` at a time."""

    def __init__(self, p: QuadcopterParams, dt: float) -> None:
        self._dt = dt
        self._inverse_mass = 1 / p.mass
        self._left_at_half = exp(-(dt / 2) / p.motor_lag)  # of a difference in rotor speed
        self._left_at_end = exp(-dt / p.motor_lag)
        self._sink = -(p.thrust_coefficient / p.mass)  # acceleration down over speeds squared
        self._moments = (  # angular acceleration over speeds squared, about x, y and z
            p.thrust_coefficient * p.arm_length / p.inertia_x,
            p.thrust_coefficient * p.arm_length / p.inertia_y,
            p.thrust_coefficient * p.torque_per_thrust / p.inertia_z,
            p.rotor_inertia / p.inertia_z / p.motor_lag,  # J_M w' of (11) over J_z
        )
        self._gyroscopic = p.rotor_inertia / p.inertia_x, p.rotor_inertia / p.inertia_y
        self._euler = (
            (p.inertia_y - p.inertia_z) / p.inertia_x,
            (p.inertia_z - p.inertia_x) / p.inertia_y,
            (p.inertia_x - p.inertia_y) / p.inertia_z,
        )

    def spin(self, state: StateVector, commands: RotorSpeeds) -> RotorSpeeds:
        """Return the rotor speeds after `dt`: all that moves on the ground."""
        w1, w2, w3, w4 = state[13], state[14], state[15], state[16]
        c1, c2, c3, c4 = commands
        left = self._left_at_end
        return (
            c1 + (w1 - c1) * left,
            c2 + (w2 - c2) * left,
            c3 + (w3 - c3) * left,
            c4 + (w4 - c4) * left,
        )

    def step(self, state: StateVector, commands: RotorSpeeds, force: Force | None) -> StateVector:
        """Return the state of a flying quadcopter after `dt` under constant commands.

        The motors' first-order lag is linear, so it is solved exactly at dt/2 and dt; thrust
        (10) and torques (11)-(13) from those speeds drive a classical Runge-Kutta step of the
        rigid body (8), (9), (14): fourth order, and stable for any motor lag.

        Where we differ from the paper's print: roll moments act about x and pitch moments about
        y in (12); shaft torques Q_i and the rotors' momentum in (13) are summed with the sign of
        each rotor's spin, and (13) is the reaction on the body: only so is angular momentum kept.
        A disturbance force is turned into NED once per step, at the attitude where it starts.

        The mathematics is written out on plain floats, slope by slope, because this is the
        simulator's hot path: a function for the slope costs a third more. In each, `a` is the
        thrust's acceleration, `b` twice that, `mx my mz` are the rotors' moments over the
        inertias and `gx gy` their gyroscopic part.
        """
        n, e, d, vn, ve, vd, w, x, y, z, p, q, r, w1, w2, w3, w4 = state
        c1, c2, c3, c4 = commands
        h = self._dt
        half, sixth = h / 2, h / 6
        at_half, at_end, sink = self._left_at_half, self._left_at_end, self._sink
        roll, pitch, drag, spin_up = self._moments
        gyro_x, gyro_y = self._gyroscopic
        euler_x, euler_y, euler_z = self._euler
        c = c1 - c2 + c3 - c4
        u1, u2 = w1 - c1, w2 - c2
        u3, u4 = w3 - c3, w4 - c4

        s1, s2 = w1 * w1, w2 * w2
        s3, s4 = w3 * w3, w4 * w4
        odd, even, spin = s1 + s3, s2 + s4, w1 - w2 + w3 - w4
        a = sink * (odd + even)
        b = a + a
        an1, ae1, ad1 = b * (x * z + w * y), b * (y * z - w * x), a - b * (x * x + y * y)
        kw1 = -0.5 * (x * p + y * q + z * r)
        kx1 = 0.5 * (w * p + y * r - z * q)
        ky1 = 0.5 * (w * q - x * r + z * p)
        kz1 = 0.5 * (w * r + x * q - y * p)
        kp1 = roll * (s4 - s2) + (euler_x * r - gyro_x * spin) * q
        kq1 = pitch * (s1 - s3) + (euler_y * r + gyro_y * spin) * p
        kr1 = drag * (even - odd) + spin_up * (spin - c) + euler_z * p * q

        w1, w2 = c1 + u1 * at_half, c2 + u2 * at_half
        w3, w4 = c3 + u3 * at_half, c4 + u4 * at_half
        s1, s2 = w1 * w1, w2 * w2
        s3, s4 = w3 * w3, w4 * w4
        odd, even, spin = s1 + s3, s2 + s4, w1 - w2 + w3 - w4
        a = sink * (odd + even)
        b = a + a
        mx, my = roll * (s4 - s2), pitch * (s1 - s3)
        mz = drag * (even - odd) + spin_up * (spin - c)
        gx, gy = gyro_x * spin, gyro_y * spin
        wi, xi = w + half * kw1, x + half * kx1
        yi, zi = y + half * ky1, z + half * kz1
        pi, qi, ri = p + half * kp1, q + half * kq1, r + half * kr1
        an2, ae2, ad2 = (
            b * (xi * zi + wi * yi),
            b * (yi * zi - wi * xi),
            a - b * (xi * xi + yi * yi),
        )
        kw2 = -0.5 * (xi * pi + yi * qi + zi * ri)
        kx2 = 0.5 * (wi * pi + yi * ri - zi * qi)
        ky2 = 0.5 * (wi * qi - xi * ri + zi * pi)
        kz2 = 0.5 * (wi * ri + xi * qi - yi * pi)
        kp2 = mx + (euler_x * ri - gx) * qi
        kq2 = my + (euler_y * ri + gy) * pi
        kr2 = mz + euler_z * pi * qi

        wi, xi = w + half * kw2, x + half * kx2
        yi, zi = y + half * ky2, z + half * kz2
        pi, qi, ri = p + half * kp2, q + half * kq2, r + half * kr2
        an3, ae3, ad3 = (
            b * (xi * zi + wi * yi),
            b * (yi * zi - wi * xi),
            a - b * (xi * xi + yi * yi),
        )
        kw3 = -0.5 * (xi * pi + yi * qi + zi * ri)
        kx3 = 0.5 * (wi * pi + yi * ri - zi * qi)
        ky3 = 0.5 * (wi * qi - xi * ri + zi * pi)
        kz3 = 0.5 * (wi * ri + xi * qi - yi * pi)
        kp3 = mx + (euler_x * ri - gx) * qi
        kq3 = my + (euler_y * ri + gy) * pi
        kr3 = mz + euler_z * pi * qi

        w1, w2 = c1 + u1 * at_end, c2 + u2 * at_end
        w3, w4 = c3 + u3 * at_end, c4 + u4 * at_end
        s1, s2 = w1 * w1, w2 * w2
        s3, s4 = w3 * w3, w4 * w4
        odd, even, spin = s1 + s3, s2 + s4, w1 - w2 + w3 - w4
        a = sink * (odd + even)
        b = a + a
        wi, xi = w + h * kw3, x + h * kx3
        yi, zi = y + h * ky3, z + h * kz3
        pi, qi, ri = p + h * kp3, q + h * kq3, r + h * kr3
        an4, ae4, ad4 = (
            b * (xi * zi + wi * yi),
            b * (yi * zi - wi * xi),
            a - b * (xi * xi + yi * yi),
        )
        kw4 = -0.5 * (xi * pi + yi * qi + zi * ri)
        kx4 = 0.5 * (wi * pi + yi * ri - zi * qi)
        ky4 = 0.5 * (wi * qi - xi * ri + zi * pi)
        kz4 = 0.5 * (wi * ri + xi * qi - yi * pi)
        kp4 = roll * (s4 - s2) + (euler_x * ri - gyro_x * spin) * qi
        kq4 = pitch * (s1 - s3) + (euler_y * ri + gyro_y * spin) * pi
        kr4 = drag * (even - odd) + spin_up * (spin - c) + euler_z * pi * qi

        gn, ge, gd = 0.0, 0.0, GRAVITY
        if force is not None:
            inverse_mass = self._inverse_mass
            fx, fy, fz = force
            fx, fy, fz = fx * inverse_mass, fy * inverse_mass, fz * inverse_mass
            tx, ty, tz = 2 * (y * fz - z * fy), 2 * (z * fx - x * fz), 2 * (x * fy - y * fx)
            gn = fx + w * tx + y * tz - z * ty
            ge = fy + w * ty + z * tx - x * tz
            gd += fz + w * tz + x * ty - y * tx

        n += h * (vn + half * gn + sixth * (an1 + an2 + an3))
        e += h * (ve + half * ge + sixth * (ae1 + ae2 + ae3))
        d += h * (vd + half * gd + sixth * (ad1 + ad2 + ad3))
        w += sixth * (kw1 + 2 * (kw2 + kw3) + kw4)
        x += sixth * (kx1 + 2 * (kx2 + kx3) + kx4)
        y += sixth * (ky1 + 2 * (ky2 + ky3) + ky4)
        z += sixth * (kz1 + 2 * (kz2 + kz3) + kz4)
        norm = 1 / sqrt(w * w + x * x + y * y + z * z)
        return (
            n,
            e,
            d,
            vn + h * gn + sixth * (an1 + 2 * (an2 + an3) + an4),
            ve + h * ge + sixth * (ae1 + 2 * (ae2 + ae3) + ae4),
            vd + h * gd + sixth * (ad1 + 2 * (ad2 + ad3) + ad4),
            w * norm,
            x * norm,
            y * norm,
            z * norm,
            p + sixth * (kp1 + 2 * (kp2 + kp3) + kp4),
            q + sixth * (kq1 + 2 * (kq2 + kq3) + kq4),
            r + sixth * (kr1 + 2 * (kr2 + kr3) + kr4),
            w1,
            w2,
            w3,
            w4,
        )
