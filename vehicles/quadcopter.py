"""Quadcopter: parameters, state and equations of motion (paper eq. 7-14). NED, body FRD.

Rotors: 1 front, 2 right, 3 rear, 4 left; 1 and 3 spin clockwise seen from above.
"""

from collections.abc import Callable
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


class RotorSpeeds(NamedTuple):
    """Speeds of rotors 1 to 4, rad/s, all positive."""

    w1: float = 0.0
    w2: float = 0.0
    w3: float = 0.0
    w4: float = 0.0


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


Step = Callable[[QuadcopterState, RotorSpeeds, Force | None], QuadcopterState]


def thrust(state: QuadcopterState, p: QuadcopterParams) -> float:
    """Return the total thrust in N (eq. 10)."""
    w1, w2, w3, w4 = state[13:]
    return p.thrust_coefficient * (w1 * w1 + w2 * w2 + w3 * w3 + w4 * w4)


def spinner(
    p: QuadcopterParams, dt: float
) -> Callable[[QuadcopterState, RotorSpeeds], RotorSpeeds]:
    """Return a function that advances only the rotors by `dt`: all that moves on the ground."""
    left = exp(-dt / p.motor_lag)

    def spin(state: QuadcopterState, commands: RotorSpeeds) -> RotorSpeeds:
        w1, w2, w3, w4 = state[13:]
        c1, c2, c3, c4 = commands
        return RotorSpeeds(
            c1 + (w1 - c1) * left,
            c2 + (w2 - c2) * left,
            c3 + (w3 - c3) * left,
            c4 + (w4 - c4) * left,
        )

    return spin


def stepper(params: QuadcopterParams, dt: float) -> Step:
    """Return a function that advances a flying quadcopter by `dt` under constant commands.

    The motors' first-order lag is linear, so it is solved exactly at dt/2 and dt; thrust
    (10) and torques (11)-(13) from those speeds drive a classical Runge-Kutta step of the
    rigid body (8), (9), (14): fourth order, and stable for any motor lag.

    Where we differ from the paper's print: roll moments act about x and pitch moments about y
    in (12); shaft torques Q_i and the rotors' momentum in (13) are summed with the sign of
    each rotor's spin, and (13) is the reaction on the body: only so is angular momentum kept.
    A disturbance force is turned into NED once per step, at the attitude where it starts.

    The mathematics is written out on plain floats because this is the simulator's hot path.
    """
    h, half, sixth = dt, dt / 2, dt / 6
    at_half, at_end = exp(-half / params.motor_lag), exp(-dt / params.motor_lag)
    lift = params.thrust_coefficient / params.mass
    roll = params.thrust_coefficient * params.arm_length / params.inertia_x
    pitch = params.thrust_coefficient * params.arm_length / params.inertia_y
    drag = params.thrust_coefficient * params.torque_per_thrust / params.inertia_z
    spin_up = params.rotor_inertia / params.inertia_z / params.motor_lag  # J_M w' of (11) over J_z
    gyro_x, gyro_y = (
        params.rotor_inertia / params.inertia_x,
        params.rotor_inertia / params.inertia_y,
    )
    euler_x = (params.inertia_y - params.inertia_z) / params.inertia_x
    euler_y = (params.inertia_z - params.inertia_x) / params.inertia_y
    euler_z = (params.inertia_x - params.inertia_y) / params.inertia_z
    inverse_mass = 1 / params.mass

    def derivative(
        w: float, x: float, y: float, z: float, p: float, q: float, r: float,
        w1: float, w2: float, w3: float, w4: float, c: float,
    ) -> tuple[float, ...]:  # fmt: skip
        """Return acceleration without gravity, attitude rate and angular acceleration."""
        s1, s2, s3, s4 = w1 * w1, w2 * w2, w3 * w3, w4 * w4
        odd, even = s1 + s3, s2 + s4
        spin = w1 - w2 + w3 - w4
        a = -lift * (odd + even)
        b = a + a
        return (
            b * (x * z + w * y),
            b * (y * z - w * x),
            a - b * (x * x + y * y),
            -0.5 * (x * p + y * q + z * r),
            0.5 * (w * p + y * r - z * q),
            0.5 * (w * q - x * r + z * p),
            0.5 * (w * r + x * q - y * p),
            roll * (s4 - s2) + (euler_x * r - gyro_x * spin) * q,
            pitch * (s1 - s3) + (euler_y * r + gyro_y * spin) * p,
            drag * (even - odd) + spin_up * (spin - c) + euler_z * p * q,
        )

    def step(state: QuadcopterState, commands: RotorSpeeds, force: Force | None) -> QuadcopterState:
        n, e, d, vn, ve, vd, w, x, y, z, p, q, r, w1, w2, w3, w4 = state
        c1, c2, c3, c4 = commands
        c = c1 - c2 + c3 - c4
        u1, u2, u3, u4 = w1 - c1, w2 - c2, w3 - c3, w4 - c4
        m1, m2, m3, m4 = c1 + u1 * at_half, c2 + u2 * at_half, c3 + u3 * at_half, c4 + u4 * at_half
        e1, e2, e3, e4 = c1 + u1 * at_end, c2 + u2 * at_end, c3 + u3 * at_end, c4 + u4 * at_end

        an1, ae1, ad1, kw1, kx1, ky1, kz1, kp1, kq1, kr1 = derivative(
            w, x, y, z, p, q, r, w1, w2, w3, w4, c
        )
        an2, ae2, ad2, kw2, kx2, ky2, kz2, kp2, kq2, kr2 = derivative(
            w + half * kw1, x + half * kx1, y + half * ky1, z + half * kz1,
            p + half * kp1, q + half * kq1, r + half * kr1, m1, m2, m3, m4, c,
        )  # fmt: skip
        an3, ae3, ad3, kw3, kx3, ky3, kz3, kp3, kq3, kr3 = derivative(
            w + half * kw2, x + half * kx2, y + half * ky2, z + half * kz2,
            p + half * kp2, q + half * kq2, r + half * kr2, m1, m2, m3, m4, c,
        )  # fmt: skip
        an4, ae4, ad4, kw4, kx4, ky4, kz4, kp4, kq4, kr4 = derivative(
            w + h * kw3, x + h * kx3, y + h * ky3, z + h * kz3,
            p + h * kp3, q + h * kq3, r + h * kr3, e1, e2, e3, e4, c,
        )  # fmt: skip

        gn, ge, gd = 0.0, 0.0, GRAVITY
        if force is not None:
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
        return QuadcopterState(
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
            e1,
            e2,
            e3,
            e4,
        )

    return step
