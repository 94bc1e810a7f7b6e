"""A pilot's angles, rates, thrust and climb rate are flown as `AttitudeSetpoint` says."""

from math import asin, atan2, hypot, isclose, pi, sqrt

import pytest

from mavherd.vehicles.build import make_robot
from mavherd.vehicles.config import Disturbance, VehicleConfig
from mavherd.vehicles.physics import GRAVITY
from mavherd.vehicles.robot import AttitudeSetpoint, Setpoint, Vec3

LEVEL = AttitudeSetpoint(0.0, 0.0, climb_rate=0.0)
ON_THE_GROUND = AttitudeSetpoint(0.0, 0.0)


def quadcopter(**config):
    robot = make_robot(VehicleConfig(kind="quadcopter", system_id=1, **config))
    robot.motors_on = True
    robot.reset_control()
    return robot


def run(robot, setpoint, seconds):
    track = []
    for i in range(round(seconds / robot.dt)):
        if i % robot.control_every == 0:
            robot.control(setpoint)
        robot.advance()
        track.append(robot.kinematics())
    return track


@pytest.fixture
def hovering():
    robot = quadcopter()
    run(robot, Setpoint(position=Vec3(0, 0, -20)), 14.0)
    return robot


def angles(k):
    return (
        atan2(2 * (k.qw * k.qx + k.qy * k.qz), 1 - 2 * (k.qx**2 + k.qy**2)),
        asin(2 * (k.qw * k.qy - k.qz * k.qx)),
        atan2(2 * (k.qw * k.qz + k.qx * k.qy), 1 - 2 * (k.qy**2 + k.qz**2)),
    )


@pytest.mark.parametrize(("roll", "pitch"), [(0.2, 0.0), (0.0, -0.3), (-0.15, 0.25)])
def test_angles_are_taken_up_and_the_height_is_kept(hovering, roll, pitch):
    track = run(hovering, AttitudeSetpoint(roll, pitch, climb_rate=0.0), 1.5)
    assert angles(track[-1])[:2] == pytest.approx((roll, pitch), abs=0.005)
    assert all(abs(k.down + 20) < 0.1 for k in track)


def test_a_lean_to_the_right_accelerates_to_the_right_and_a_low_nose_forward(hovering):
    right = run(hovering, AttitudeSetpoint(0.1, 0.0), 1.0)[-1]
    assert right.v_east > 0.5
    assert abs(right.v_north) < 0.02
    forward = run(hovering, AttitudeSetpoint(0.0, -0.1), 1.0)[-1]
    assert forward.v_north > 0.5


def test_angles_beyond_the_tilt_limit_keep_their_direction(hovering):
    roll, pitch, _ = angles(run(hovering, AttitudeSetpoint(0.9, -1.2), 1.0)[-1])
    limit = pi / 6
    assert hypot(roll, pitch) == pytest.approx(limit, abs=0.01)
    assert pitch / roll == pytest.approx(-1.2 / 0.9, rel=0.03)


def test_the_yaw_is_taken_up_held_or_turned(hovering):
    assert angles(run(hovering, LEVEL._replace(yaw=1.0), 5.0)[-1])[2] == pytest.approx(
        1.0, abs=0.02
    )
    assert angles(run(hovering, LEVEL, 3.0)[-1])[2] == pytest.approx(1.0, abs=0.02)
    turned = run(hovering, LEVEL._replace(yaw_rate=0.5), 2.0)[-1]
    assert angles(turned)[2] == pytest.approx(2.0, abs=0.1)
    assert turned.yaw_rate == pytest.approx(0.5, rel=0.05)


@pytest.mark.parametrize("climb", [1.0, -0.7])
@pytest.mark.parametrize("profile", ["default", "ardupilot"])
def test_a_climb_rate_is_flown_and_then_the_height_kept(climb, profile):
    robot = quadcopter(profile=profile)
    run(robot, Setpoint(position=Vec3(0, 0, -20)), 18.0)
    end = run(robot, LEVEL._replace(climb_rate=climb), 4.0)[-1]
    assert end.v_down == pytest.approx(-climb, abs=0.02)
    track = run(robot, LEVEL, 4.0)
    assert abs(track[-1].v_down) < 0.02
    assert abs(track[-1].down - track[len(track) // 2].down) < 0.05


def test_climb_rates_keep_the_speed_limits(hovering):
    assert run(hovering, LEVEL._replace(climb_rate=9.0), 4.0)[-1].v_down == pytest.approx(
        -2.5, abs=0.03
    )
    assert run(hovering, LEVEL._replace(climb_rate=-9.0), 4.0)[-1].v_down == pytest.approx(
        1.5, abs=0.03
    )


def test_a_climb_rate_is_kept_against_a_constant_force():
    robot = quadcopter(disturbance=Disturbance(form="constant", amplitude=2.0), seed=3)
    run(robot, Setpoint(position=Vec3(0, 0, -10)), 8.0)
    end = run(robot, LEVEL._replace(climb_rate=0.5), 4.0)[-1]
    assert end.v_down == pytest.approx(-0.5, abs=0.05)


def test_thrust_is_a_share_of_full_thrust(hovering):
    hover = hovering.limits.hover_thrust
    assert 0.45 < hover < 0.55
    start = hovering.kinematics().v_down
    level = run(hovering, AttitudeSetpoint(0.0, 0.0, thrust=hover), 1.0)[-1]
    assert abs(level.v_down - start) < 0.02
    up = run(hovering, AttitudeSetpoint(0.0, 0.0, thrust=1.2 * hover), 1.0)[-1]
    assert level.v_down - up.v_down == pytest.approx(0.2 * GRAVITY, rel=0.05)
    fall = run(hovering, AttitudeSetpoint(0.0, 0.0, thrust=0.0), 0.5)[-1]
    assert fall.v_down - up.v_down == pytest.approx(0.5 * GRAVITY, rel=0.1)


def test_on_the_ground_thrust_turns_all_rotors_alike_until_it_carries_the_weight():
    robot = quadcopter()
    hover = robot.limits.hover_thrust
    speeds = []
    for thrust in (0.0, 0.3 * hover, 0.9 * hover):
        run(robot, AttitudeSetpoint(0.3, 0.0, yaw_rate=1.0, thrust=thrust), 1.0)
        assert robot.on_ground
        assert len(set(robot.actuators()[4:])) == 1
        speeds.append(robot.actuators()[0])
    assert speeds == sorted(speeds)
    assert isclose(speeds[0], 0.12 * 838.0, rel_tol=0.01)  # idle
    assert isclose(speeds[1], 838.0 * sqrt(0.3 * hover), rel_tol=0.01)
    run(robot, AttitudeSetpoint(0.0, 0.0, thrust=1.1 * hover), 1.0)
    assert not robot.on_ground


@pytest.mark.parametrize("setpoint", [ON_THE_GROUND, LEVEL, LEVEL._replace(climb_rate=-1.0)])
def test_without_a_climb_it_stays_on_the_ground_and_idles(setpoint):
    robot = quadcopter()
    run(robot, setpoint, 1.0)
    assert robot.on_ground
    assert robot.actuators()[0] < 200
    run(robot, LEVEL._replace(climb_rate=0.5), 1.0)
    assert not robot.on_ground


def test_body_rates_alone_are_flown(hovering):
    spin = AttitudeSetpoint(roll_rate=0.0, pitch_rate=0.0, yaw_rate=0.4, climb_rate=0.0)
    assert run(hovering, spin, 2.0)[-1].yaw_rate == pytest.approx(0.4, rel=0.1)
    still = spin._replace(yaw_rate=0.0)
    run(hovering, still, 2.0)
    roll = run(hovering, still._replace(roll_rate=0.3), 0.5)[-1]
    assert roll.roll_rate == pytest.approx(0.3, rel=0.1)
    assert angles(roll)[0] == pytest.approx(0.15, rel=0.3)


def test_rates_beside_an_attitude_are_feed_forward(hovering):
    plain = run(hovering, AttitudeSetpoint(0.0, 0.0), 0.1)[-1]
    assert abs(plain.roll_rate) < 1e-3
    pushed = run(hovering, AttitudeSetpoint(0.0, 0.0, roll_rate=0.5), 0.1)[-1]
    assert pushed.roll_rate > 0.1


def test_it_comes_upright_again_after_a_roll_over(hovering):
    flip = AttitudeSetpoint(roll_rate=6.0, pitch_rate=0.0, yaw_rate=0.0, thrust=0.5)
    run(hovering, flip, 0.5)
    assert abs(angles(hovering.kinematics())[0]) > 2
    end = run(hovering, LEVEL, 3.0)[-1]
    assert angles(end)[:2] == pytest.approx((0.0, 0.0), abs=0.01)
    assert not hovering.on_ground


def test_a_hold_after_sticks_brakes_and_stays(hovering):
    run(hovering, AttitudeSetpoint(0.0, -0.3, climb_rate=0.0), 1.5)
    fast = hovering.kinematics()
    assert fast.v_north > 3.5
    track = run(hovering, Setpoint(), 8.0)
    assert hypot(track[-1].v_north, track[-1].v_east) < 0.02
    assert max(k.north for k in track) - track[-1].north < 0.1
