"""The rover moves as eq. 1-4, 6 and 16 say, with the yaw sign turned for z down."""

from math import cos, exp, hypot, isclose, log2, pi, sin

import pytest

from mavherd.vehicles.rover import (
    RoverParams,
    RoverPhysics,
    RoverState,
    body_velocity,
    derivative,
    wheel_speeds,
)

P = RoverParams()


def drive(torques, seconds, start=None, dt=0.002, force=None, p=P):
    physics, state = RoverPhysics(p, dt), start or RoverState()
    for _ in range(round(seconds / dt)):
        state = physics.step(state, torques, force)
    return RoverState(*state)


def test_equal_torques_drive_straight_to_the_drag_limited_speed():
    end = drive((0.1, 0.1), 60)
    assert end.east == end.yaw == 0.0
    assert isclose(end.speed, 0.2 / P.wheel_radius / P.drag_linear, rel_tol=1e-3)


def test_speed_builds_up_with_the_time_constant_of_mass_over_drag():
    final = 0.2 / P.wheel_radius / P.drag_linear
    end = drive((0.1, 0.1), P.mass / P.drag_linear)
    assert isclose(end.speed, final * (1 - exp(-1)), rel_tol=1e-3)


def test_the_left_wheel_turns_right():
    assert drive((0.2, 0.1), 1.0).yaw > 0.1  # clockwise from above, as NED counts
    assert drive((0.1, 0.2), 1.0).yaw < -0.1


def test_opposite_torques_turn_on_the_spot_to_the_drag_limited_rate():
    end = drive((0.1, -0.1), 30)
    assert hypot(end.north, end.east) < 1e-12
    moment = 0.2 * P.half_track / P.wheel_radius
    assert isclose(end.yaw_rate, moment / P.drag_angular, rel_tol=1e-6)


def test_turning_inertia_is_that_about_the_axle():
    rate = derivative(RoverState(), (0.1, -0.1), None, P).yaw_rate
    moment = 0.2 * P.half_track / P.wheel_radius
    assert isclose(rate, moment / (P.inertia + P.mass * P.cg_offset**2))


def test_mirrored_torques_drive_the_mirrored_path():
    right, left = drive((0.3, 0.2), 3.0), drive((0.2, 0.3), 3.0)
    assert (right.north, right.speed) == pytest.approx((left.north, left.speed))
    assert (right.east, right.yaw) == pytest.approx((-left.east, -left.yaw))


def test_the_path_does_not_depend_on_the_heading():
    north = drive((0.3, 0.2), 3.0)
    yaw = 2.0
    turned = drive((0.3, 0.2), 3.0, RoverState(yaw=yaw))
    assert isclose(turned.north, north.north * cos(yaw) - north.east * sin(yaw))
    assert isclose(turned.east, north.north * sin(yaw) + north.east * cos(yaw))


def test_wheel_speeds_are_the_inverse_of_body_velocity():
    for speed, yaw_rate in ((0.5, 0.0), (0.0, 1.2), (-0.3, -0.7)):
        assert body_velocity(wheel_speeds(speed, yaw_rate, P), P) == pytest.approx(
            (speed, yaw_rate)
        )


def test_one_turn_of_both_wheels_rolls_one_circumference():
    speed, _ = body_velocity((2 * pi, 2 * pi), P)
    assert isclose(speed, 2 * pi * P.wheel_radius)


def test_the_step_follows_the_derivative():
    state = RoverState(1.0, 2.0, 0.5, 0.8, -0.6)
    torques, force, dt = (0.3, -0.2), (0.4, -0.3, 0.1), 1e-6
    end = RoverPhysics(P, dt).step(state, torques, force)
    slope = [(b - a) / dt for a, b in zip(state, end, strict=True)]
    assert slope == pytest.approx(derivative(state, torques, force, P), rel=1e-4)


def test_halving_the_step_shrinks_the_error_fourfold():
    start = RoverState(speed=1.0, yaw_rate=1.5)
    exact = drive((0.6, 0.2), 1.6, start, dt=0.0005)
    coarse, fine = (
        hypot(*(a - b for a, b in zip(drive((0.6, 0.2), 1.6, start, dt), exact, strict=True)))
        for dt in (0.04, 0.02)
    )
    assert 1.8 < log2(coarse / fine) < 2.2


def test_the_step_in_use_agrees_with_2_khz():
    start = RoverState(speed=1.0, yaw_rate=1.5)
    a, b = (drive((0.6, 0.2), 1.0, start, dt) for dt in (0.002, 0.0005))
    assert a == pytest.approx(b, abs=1e-5)


def test_a_side_force_turns_but_never_slips():
    end = drive((0.0, 0.0), 1.0, force=(0.0, 0.4, 0.0))
    assert end.yaw > 0
    assert hypot(end.north, end.east) == 0.0


def test_a_force_along_the_body_accelerates_the_mass():
    assert isclose(derivative(RoverState(), (0.0, 0.0), (0.42, 0.0, 9.0), P).speed, 0.42 / P.mass)


@pytest.mark.parametrize(("name", "value"), [("mass", 0.0), ("wheel_radius", -0.1)])
def test_impossible_constants_are_refused_by_name(name, value):
    with pytest.raises(ValueError, match=name):
        RoverParams(**{name: value})
