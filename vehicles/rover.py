"""Differential-drive rover: parameters, state and equations of motion (paper eq. 1-4 and 6).

The paper writes its equations for z up. On board z is down, so the yaw's sign is turned: a
positive yaw rate turns right, and the left wheel drives it.
"""

from dataclasses import dataclass
from math import cos, sin
from typing import NamedTuple

from .physics import Force, require_positive


@dataclass(frozen=True, slots=True, kw_only=True)
class RoverParams:
    """Physical constants of one rover, SI units (paper Table 1 where it has them)."""

    mass: float = 8.4  # kg
    inertia: float = 0.175  # kg m^2, about the centre of gravity
    wheel_radius: float = 0.0975  # m
    half_track: float = 0.20  # m, from point B to each wheel
    cg_offset: float = 0.05  # m, from point B forward to the centre of gravity
    drag_linear: float = 4.0  # N s/m
    drag_angular: float = 0.4  # N m s/rad
    torque_limit: float = 1.0  # N m, at each wheel

    def __post_init__(self) -> None:
        require_positive(self, may_be_zero=("cg_offset", "drag_linear", "drag_angular"))

    @property
    def inertia_b(self) -> float:
        """Return the moment of inertia about point B in kg m^2 (eq. 3)."""
        return self.inertia + self.mass * self.cg_offset**2


class RoverState(NamedTuple):
    """Pose of point B in local NED (m, rad clockwise from north) and body velocity."""

    north: float = 0.0
    east: float = 0.0
    yaw: float = 0.0
    speed: float = 0.0  # m/s along body x
    yaw_rate: float = 0.0  # rad/s about body z (down)


StateVector = tuple[float, float, float, float, float]
"""A RoverState without its names: what the hot path passes on."""

Wheels = tuple[float, float]
"""One quantity of the left and of the right wheel: torque (N m) or speed (rad/s)."""


def wheel_speeds(speed: float, yaw_rate: float, p: RoverParams) -> Wheels:
    """Return the wheel speeds of a motion (eq. 16).

    The paper prints l omega / (2 r); with l from point B to a wheel, as in (6), the inverse
    of (6) is l omega / r.
    """
    turn = yaw_rate * p.half_track
    return (speed + turn) / p.wheel_radius, (speed - turn) / p.wheel_radius


def body_velocity(wheels: Wheels, p: RoverParams) -> tuple[float, float]:
    """Return speed and yaw rate of a pair of rolling wheels (eq. 6, no gearbox)."""
    left, right = wheels
    return (
        p.wheel_radius * (left + right) / 2,
        p.wheel_radius * (left - right) / (2 * p.half_track),
    )


def derivative(
    state: StateVector, torques: Wheels, force: Force | None, p: RoverParams
) -> RoverState:
    """Return the time derivative of `state` (eq. 1-4).

    A disturbance acts at the centre of gravity: its x part pushes along, its y part turns the
    rover about point B, whose wheels do not slip sideways.
    """
    _, _, yaw, speed, yaw_rate = state
    left, right = torques
    along, across, _ = force or (0.0, 0.0, 0.0)
    drive = (left + right) / p.wheel_radius - p.drag_linear * speed
    moment = (left - right) * p.half_track / p.wheel_radius - p.drag_angular * yaw_rate
    return RoverState(
        north=speed * cos(yaw),
        east=speed * sin(yaw),
        yaw=yaw_rate,
        speed=(drive + along) / p.mass,
        yaw_rate=(moment + across * p.cg_offset) / p.inertia_b,
    )


class RoverPhysics:
    """Advances one rover by `dt` at a time."""

    def __init__(self, p: RoverParams, dt: float) -> None:
        self._dt = dt
        self._per_force = 1 / p.mass
        self._drag = p.drag_linear / p.mass
        self._angular_drag = p.drag_angular / p.inertia_b
        self._per_torque = 1 / (p.wheel_radius * p.mass)
        self._per_difference = p.half_track / (p.wheel_radius * p.inertia_b)
        self._lever = p.cg_offset * (1 / p.inertia_b)

    def step(self, state: StateVector, torques: Wheels, force: Force | None) -> StateVector:
        """Return the state after `dt` under constant torques.

        It is one midpoint step of `derivative` (second order), written out on plain floats:
        position is not fed back, so only speed, yaw rate and yaw are needed at the midpoint.
        """
        north, east, yaw, speed, yaw_rate = state
        left, right = torques
        dt, drag, angular_drag = self._dt, self._drag, self._angular_drag
        half = dt / 2
        push = (left + right) * self._per_torque
        turn = (left - right) * self._per_difference
        if force is not None:
            push += force[0] * self._per_force
            turn += force[1] * self._lever
        speed_mid = speed + half * (push - drag * speed)
        rate_mid = yaw_rate + half * (turn - angular_drag * yaw_rate)
        yaw_mid = yaw + half * yaw_rate
        return (
            north + dt * speed_mid * cos(yaw_mid),
            east + dt * speed_mid * sin(yaw_mid),
            yaw + dt * rate_mid,
            speed + dt * (push - drag * speed_mid),
            yaw_rate + dt * (turn - angular_drag * rate_mid),
        )
