"""The quadcopter stands, lifts off, falls and touches down as a body on a level plane does."""

from math import isclose, sqrt

import pytest

from mavherd.vehicles.build import make_robot
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.physics import GRAVITY
from mavherd.vehicles.quadcopter_robot import Quadcopter
from mavherd.vehicles.robot import Setpoint, Vec3


def quadcopter(**config) -> Quadcopter:
    robot = make_robot(VehicleConfig(kind="quadcopter", system_id=1, **config))
    assert isinstance(robot, Quadcopter)
    return robot


def run(robot, setpoint, seconds):
    for i in range(round(seconds / robot.dt)):
        if i % robot.control_every == 0:
            robot.control(setpoint)
        robot.advance()
    return robot.kinematics()


def airborne(height=5.0, **config) -> Quadcopter:
    robot = quadcopter(**config)
    robot.motors_on = True
    run(robot, Setpoint(position=Vec3(0.0, 0.0, -height)), 6.0)
    return robot


def test_it_starts_on_the_ground_where_the_configuration_says():
    robot = quadcopter(north=1.0, east=-2.0, down=-3.0, yaw=0.7)
    k = robot.kinematics()
    assert (k.north, k.east, k.down) == (1.0, -2.0, -3.0)
    assert isclose(2 * sqrt(1 - k.qw**2) * k.qw, 2 * k.qw * k.qz)
    assert robot.on_ground
    assert not robot.motors_on


def test_with_motors_off_nothing_moves_whatever_is_asked():
    robot = quadcopter()
    before = robot.kinematics()
    assert run(robot, Setpoint(position=Vec3(0, 0, -3)), 1.0) == before
    assert robot.actuators() == (0.0,) * 8


def test_armed_on_the_ground_it_idles_until_asked_to_climb():
    robot = quadcopter()
    robot.motors_on = True
    for setpoint in (
        Setpoint(),
        Setpoint(yaw=1.0),
        Setpoint(position=Vec3(4.0, 0.0, 0.0)),
        Setpoint(velocity=Vec3(1.0, 0.0, 0.5)),
    ):
        run(robot, setpoint, 0.5)
        assert robot.on_ground
        assert 50 < robot.actuators()[0] < 200
        assert robot.kinematics()[:6] == (0.0,) * 6


@pytest.mark.parametrize(
    "setpoint",
    [
        Setpoint(position=Vec3(0, 0, -1)),
        Setpoint(velocity=Vec3(0, 0, -0.3)),
        Setpoint(acceleration=Vec3(0, 0, -0.5)),
    ],
)
def test_any_demand_to_climb_lifts_off(setpoint):
    robot = quadcopter()
    robot.motors_on = True
    run(robot, setpoint, 1.0)
    assert not robot.on_ground
    assert robot.kinematics().down < -0.02


def test_it_leaves_the_ground_only_when_thrust_exceeds_weight():
    robot = quadcopter()
    robot.motors_on = True
    while robot.on_ground:
        run(robot, Setpoint(position=Vec3(0, 0, -3)), robot.dt)
    lift = 8.54858e-6 * sum(w * w for w in robot.actuators()[:4])
    assert lift > 1.2 * GRAVITY


def test_an_airborne_disarm_falls_with_g_and_reports_the_impact():
    robot = airborne(height=5.0)
    height = -robot.kinematics().down
    robot.motors_on = False
    run(robot, Setpoint(), 0.3)
    early = robot.kinematics().v_down
    run(robot, Setpoint(), 0.2)
    assert isclose(robot.kinematics().v_down - early, 0.2 * GRAVITY, rel_tol=1e-3)
    assert robot.actuators()[4:] == (0.0,) * 4
    run(robot, Setpoint(), 2.0)
    assert robot.on_ground
    # the rotors push for a moment while they run down; contact is seen at the end of a step
    free = sqrt(2 * GRAVITY * height)
    assert 0.98 * free < robot.impact_speed < free + GRAVITY * robot.dt


def test_touching_down_stops_and_levels_but_keeps_yaw():
    robot = airborne(height=2.0)
    run(robot, Setpoint(position=Vec3(0, 0, -2), yaw=1.0), 5.0)
    run(robot, Setpoint(velocity=Vec3(1.0, 0.5, 0.0)), 0.4)
    robot.motors_on = False
    k = run(robot, Setpoint(), 2.0)
    assert robot.on_ground
    assert k.down == 0.0
    assert (k.v_north, k.v_east, k.v_down, k.roll_rate, k.pitch_rate, k.yaw_rate) == (0.0,) * 6
    assert (k.qx, k.qy) == (0.0, 0.0)
    assert isclose(k.qz / k.qw, 0.5463, rel_tol=0.05)  # tan(1.0 / 2)


def test_a_slow_descent_lands_and_then_idles():
    robot = airborne(height=1.0)
    run(robot, Setpoint(velocity=Vec3(0, 0, 0.5)), 3.0)
    assert robot.on_ground
    assert isclose(robot.impact_speed, 0.5, rel_tol=0.1)
    assert robot.actuators()[0] < 200


def test_it_flies_again_after_landing():
    robot = airborne(height=1.0)
    run(robot, Setpoint(velocity=Vec3(0, 0, 0.5)), 3.0)
    k = run(robot, Setpoint(position=Vec3(0, 0, -2)), 5.0)
    assert isclose(k.down, -2.0, abs_tol=0.02)


def test_the_ground_is_where_it_started():
    robot = quadcopter(down=-10.0)
    robot.motors_on = True
    run(robot, Setpoint(position=Vec3(0, 0, -12)), 4.0)
    k = run(robot, Setpoint(velocity=Vec3(0, 0, 1.0)), 4.0)
    assert robot.on_ground
    assert k.down == -10.0


def test_actuators_have_a_name_each():
    robot = airborne()
    assert len(robot.actuators()) == len(robot.actuator_names) == 8
    assert all(name.endswith("rad_s") for name in robot.actuator_names)
    speeds, commands = robot.actuators()[:4], robot.actuators()[4:]
    assert speeds == pytest.approx(commands, rel=1e-3)
