"""Gains and limits change while the vehicle moves, or are refused and nothing changes."""

from math import inf, nan

import pytest

from mavherd.vehicles.build import make_robot
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.robot import AttitudeSetpoint, Limits, Setpoint, Vec3

AWAY = Setpoint(position=Vec3(500, 0, -10))


def robot(kind, **config):
    robot = make_robot(VehicleConfig(kind=kind, system_id=1, **config))
    robot.motors_on = True
    return robot


def run(robot, setpoint, seconds):
    for i in range(round(seconds / robot.dt)):
        if i % robot.control_every == 0:
            robot.control(setpoint)
        robot.advance()
    return robot.kinematics()


def test_a_new_limit_counts_at_once():
    quad = robot("quadcopter")
    assert run(quad, AWAY, 8.0).v_north == pytest.approx(1.5, abs=0.05)
    quad.retune(v_max=4.0)
    assert run(quad, AWAY, 5.0).v_north == pytest.approx(4.0, abs=0.05)
    rover = robot("rover")
    run(rover, AWAY, 3.0)
    rover.retune(v_max=0.5)
    assert run(rover, AWAY, 3.0).v_north == pytest.approx(0.5, abs=0.05)


def test_retuning_to_what_it_is_changes_nothing_in_flight():
    plain, retuned = robot("quadcopter"), robot("quadcopter")
    for quad in (plain, retuned):
        run(quad, AWAY, 2.0)
    retuned.retune(roll_p=120.0, altitude_i=4.0, yaw_i=0.5)
    assert run(plain, AWAY, 2.0) == run(retuned, AWAY, 2.0)


def test_changed_gains_fly_as_those_given_at_boot():
    booted = robot("quadcopter", params={"position_p": 6.0, "altitude_p": 20.0, "tilt_limit": 0.2})
    retuned = robot("quadcopter")
    retuned.retune(position_p=6.0, altitude_p=20.0, tilt_limit=0.2)
    assert run(booted, AWAY, 4.0) == run(retuned, AWAY, 4.0)


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("quadcopter", {"tilt_limit": 1.3}),
        ("quadcopter", {"v_max": -1.0}),
        ("quadcopter", {"v_max": nan}),
        ("quadcopter", {"roll_p": inf}),
        ("quadcopter", {"roll_p": 1e9}),
        ("quadcopter", {"accel_max": 1e-6}),
        ("quadcopter", {"mass": 1.3}),  # a body parameter
        ("quadcopter", {"wheel_p": 1.0}),
        ("quadcopter", {"no_such": 1.0}),
        ("rover", {"wheel_p": 39.0}),  # too fast a loop for the control rate
        ("rover", {"accel_max": 1e9}),
        ("rover", {"v_max": 0.0}),
        ("rover", {"half_track": 0.3}),
    ],
)
def test_what_cannot_be_is_refused_and_changes_nothing(kind, change):
    touched, plain = robot(kind), robot(kind)
    with pytest.raises(ValueError, match=next(iter(change)).partition("_")[0]):
        touched.retune(position_p=3.0, **change)
    assert run(touched, AWAY, 2.0) == run(plain, AWAY, 2.0)


def test_a_speed_limit_replaces_v_max_until_it_is_lifted():
    quad = robot("quadcopter")
    run(quad, AWAY, 6.0)
    for limit, speed in ((0.5, 0.5), (5.0, 5.0), (None, 1.5)):
        quad.speed_limit = limit
        assert quad.speed_limit == limit
        assert run(quad, AWAY, 6.0).v_north == pytest.approx(speed, abs=0.05)


def test_a_rover_keeps_a_speed_limit_too():
    rover = robot("rover")
    for limit, speed in ((0.3, 0.3), (1.5, 1.5), (None, 1.0)):
        rover.speed_limit = limit
        assert run(rover, AWAY, 5.0).v_north == pytest.approx(speed, abs=0.05)


def test_climb_and_descent_limits():
    quad = robot("quadcopter")
    quad.climb_limit, quad.descent_limit = 1.0, 0.4
    assert run(quad, Setpoint(position=Vec3(0, 0, -50)), 5.0).v_down == pytest.approx(-1, abs=0.02)
    assert run(quad, Setpoint(position=Vec3(0, 0, 50)), 4.0).v_down == pytest.approx(0.4, abs=0.02)
    quad.climb_limit = None
    assert run(quad, Setpoint(position=Vec3(0, 0, -50)), 4.0).v_down == pytest.approx(
        -2.5, abs=0.03
    )


def test_a_retune_keeps_a_limit_that_is_in_force():
    quad = robot("quadcopter")
    quad.speed_limit = 0.7
    quad.retune(v_max=3.0)
    assert quad.limits.speed == 0.7
    quad.speed_limit = None
    assert quad.limits.speed == 3.0


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
@pytest.mark.parametrize("name", ["speed_limit", "climb_limit", "descent_limit"])
def test_a_limit_is_a_speed(kind, name):
    vehicle = robot(kind)
    assert getattr(vehicle, name) is None
    for value in (0.0, -1.0, nan, inf):
        with pytest.raises(ValueError, match=name):
            setattr(vehicle, name, value)
    assert getattr(vehicle, name) is None
    setattr(vehicle, name, 1e9)
    assert getattr(vehicle, name) <= 20
    setattr(vehicle, name, 1e-320)
    assert getattr(vehicle, name) >= 0.01


def test_limits_say_what_holds():
    assert robot("rover").limits == Limits(1.0, 2.0)
    quad = robot("quadcopter", profile="ardupilot")
    assert quad.limits[:5] == (10.0, 2.0, 2.5, 1.5, pytest.approx(0.5236, abs=1e-4))
    weight, thrust = 1.2 * 9.80665, 4 * 8.54858e-6 * 838.0**2
    assert quad.limits.hover_thrust == pytest.approx(weight / thrust)


def test_a_rover_is_steered_by_shares_of_its_speed():
    rover = robot("rover")
    assert run(rover, AttitudeSetpoint(thrust=0.5), 3.0).v_north == pytest.approx(0.5, abs=0.01)
    assert run(rover, AttitudeSetpoint(thrust=-9.0), 4.0).v_north == pytest.approx(-1, abs=0.02)
    run(rover, AttitudeSetpoint(), 3.0)
    turning = run(rover, AttitudeSetpoint(yaw_rate=0.6, thrust=0.0), 1.0)
    assert turning.yaw_rate == pytest.approx(0.6, abs=0.01)
    facing = run(rover, AttitudeSetpoint(yaw=-1.0, thrust=0.0), 4.0)
    assert facing.qz == pytest.approx(-0.4794, abs=0.01)  # sin(-1 / 2)
