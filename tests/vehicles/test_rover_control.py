"""Every setpoint drives as its contract says (eq. 15-16), and paths are followed closely."""

from math import atan2, cos, hypot, isclose, pi, sin, sqrt

import pytest

from mavherd.vehicles.build import make_robot
from mavherd.vehicles.config import Disturbance, VehicleConfig
from mavherd.vehicles.robot import Setpoint, Vec3


def rover(**config):
    robot = make_robot(VehicleConfig(kind="rover", system_id=1, **config))
    robot.motors_on = True
    robot.reset_control()
    return robot


def run(robot, setpoint, seconds):
    """Drive `setpoint` and return the track, one `Kinematics` a step."""
    track = []
    for i in range(round(seconds / robot.dt)):
        if i % robot.control_every == 0:
            robot.control(setpoint)
        robot.advance()
        track.append(robot.kinematics())
    return track


def yaw_of(k):
    return (2 * atan2(k.qz, k.qw) + pi) % (2 * pi) - pi


def speed_of(k):
    return k.v_north * cos(yaw_of(k)) + k.v_east * sin(yaw_of(k))


def test_kinematics_lie_on_the_ground():
    robot = rover(north=1.0, east=2.0, down=-4.0, yaw=0.3)
    k = run(robot, Setpoint(velocity=Vec3(0.5, 0.5, 3.0)), 2.0)[-1]
    assert k.down == -4.0
    assert (k.v_down, k.qx, k.qy, k.roll_rate, k.pitch_rate) == (0.0,) * 5
    assert robot.on_ground


@pytest.mark.parametrize("target", [Vec3(4.0, 1.0), Vec3(-3.0, 2.0), Vec3(0.0, -3.0)])
def test_position_is_reached_and_then_it_stands(target):
    robot = rover()
    end = run(robot, Setpoint(position=target), 12.0)[-1]
    assert hypot(end.north - target.north, end.east - target.east) < 0.06
    assert abs(speed_of(end)) < 0.01
    assert robot.actuators()[2:] == (0.0, 0.0)


def test_speed_and_turn_stay_within_their_limits():
    track = run(rover(), Setpoint(position=Vec3(-9.0, 1.0)), 15.0)
    assert max(abs(speed_of(k)) for k in track) < 1.1
    assert max(abs(k.yaw_rate) for k in track) < 2.0 * 1.15


def test_the_paper_profile_arrives_too():
    end = run(rover(profile="paper"), Setpoint(position=Vec3(4.0, 1.0)), 12.0)[-1]
    assert hypot(end.north - 4.0, end.east - 1.0) < 0.06


def test_a_target_to_the_left_lowers_the_yaw():
    assert yaw_of(run(rover(), Setpoint(position=Vec3(3.0, -3.0)), 1.0)[-1]) < -0.5


def test_left_and_right_are_mirror_images():
    right = run(rover(), Setpoint(position=Vec3(2.0, 2.0)), 4.0)
    left = run(rover(), Setpoint(position=Vec3(2.0, -2.0)), 4.0)
    assert all(
        isclose(a.north, b.north, abs_tol=1e-9) and isclose(a.east, -b.east, abs_tol=1e-9)
        for a, b in zip(right, left, strict=True)
    )


def test_the_path_does_not_depend_on_the_heading():
    turn = 2.0
    plain = run(rover(), Setpoint(position=Vec3(2.0, 1.0)), 3.0)[-1]
    position = Vec3(2 * cos(turn) - sin(turn), 2 * sin(turn) + cos(turn))
    end = run(rover(yaw=turn), Setpoint(position=position), 3.0)[-1]
    assert isclose(end.north, plain.north * cos(turn) - plain.east * sin(turn), abs_tol=1e-9)
    assert isclose(end.east, plain.north * sin(turn) + plain.east * cos(turn), abs_tol=1e-9)


def test_velocity_beside_a_position_adds_its_part_along_the_heading():
    robot = rover()
    target = Setpoint(position=Vec3(0.2, 0.0), velocity=Vec3(-0.4, 5.0))
    robot.control(target)
    left, right = robot.actuators()[2:]
    assert isclose(left, right)
    assert isclose(left * 0.0975, 2.0 * 0.2 - 0.4, abs_tol=1e-12)


def test_yaw_rate_beside_a_position_adds_to_the_turn():
    robot = rover()
    robot.control(Setpoint(position=Vec3(2.0, 0.0), yaw_rate=0.5))
    left, right = robot.actuators()[2:]
    assert isclose((left - right) * 0.0975 / 0.4, 0.5)


def test_yaw_at_a_reached_position_is_taken_up_on_the_spot():
    robot = rover()
    end = run(robot, Setpoint(position=Vec3(0.0, 0.0), yaw=1.5), 4.0)[-1]
    assert isclose(yaw_of(end), 1.5, abs_tol=0.02)
    assert hypot(end.north, end.east) < 0.01


@pytest.mark.parametrize("heading", [0.0, 1.0, -2.5, 3.1])
def test_velocity_alone_turns_to_its_heading_and_drives(heading):
    end = run(rover(), Setpoint(velocity=Vec3(0.6 * cos(heading), 0.6 * sin(heading))), 6.0)[-1]
    assert isclose(yaw_of(end), heading, abs_tol=0.01)
    assert isclose(speed_of(end), 0.6, abs_tol=0.01)


def test_velocity_behind_does_not_drive_before_it_has_turned():
    track = run(rover(), Setpoint(velocity=Vec3(-1.0, 0.01)), 0.5)
    assert all(abs(speed_of(k)) < 0.05 for k in track)


def test_velocity_reaches_two_thirds_within_the_lag_the_filter_assumes():
    robot = rover()
    track = run(robot, Setpoint(velocity=Vec3(0.8, 0.0)), 2.0)
    assert robot.dt * next(i for i, k in enumerate(track) if speed_of(k) > 0.8 * 0.632) < 0.3


def test_velocity_with_yaw_rate_drives_an_arc():
    end = run(rover(), Setpoint(velocity=Vec3(0.5, 0.0), yaw_rate=0.0), 3.0)[-1]
    assert isclose(speed_of(end), 0.5, abs_tol=0.01)
    end = run(rover(), Setpoint(velocity=Vec3(0.5, 0.0), yaw_rate=0.4), 1.0)[-1]
    assert isclose(end.yaw_rate, 0.4, rel_tol=0.05)
    assert end.east > 0  # to the right


def test_velocity_against_the_heading_with_a_yaw_rate_reverses():
    end = run(rover(), Setpoint(velocity=Vec3(-0.5, 0.0), yaw_rate=0.0), 3.0)[-1]
    assert isclose(speed_of(end), -0.5, abs_tol=0.01)
    assert yaw_of(end) == 0.0


def test_velocity_with_yaw_holds_that_yaw():
    end = run(rover(), Setpoint(velocity=Vec3(0.5, 0.0), yaw=0.3), 4.0)[-1]
    assert isclose(yaw_of(end), 0.3, abs_tol=0.01)
    assert isclose(speed_of(end), 0.5 * cos(0.3), abs_tol=0.01)


def test_yaw_alone_turns_on_the_spot():
    end = run(rover(), Setpoint(yaw=-2.0), 4.0)[-1]
    assert isclose(yaw_of(end), -2.0, abs_tol=0.01)
    assert hypot(end.north, end.east) < 1e-6


def test_yaw_rate_alone_turns_right_on_the_spot():
    end = run(rover(), Setpoint(yaw_rate=0.7), 2.0)[-1]
    assert isclose(end.yaw_rate, 0.7, rel_tol=0.02)
    assert hypot(end.north, end.east) < 1e-6


@pytest.mark.parametrize("setpoint", [Setpoint(), Setpoint(acceleration=Vec3(3.0, 3.0, 0.0))])
def test_nothing_it_can_follow_stops_it(setpoint):
    robot = rover()
    run(robot, Setpoint(velocity=Vec3(1.0, 0.2)), 3.0)
    end = run(robot, setpoint, 3.0)[-1]
    assert abs(speed_of(end)) < 1e-3
    assert abs(end.yaw_rate) < 1e-3


def test_the_turn_is_kept_when_the_wheels_cannot_do_both():
    robot = rover(params={"wheel_speed_max": 8.0})
    robot.control(Setpoint(velocity=Vec3(1.0, 0.0), yaw_rate=2.0))
    left, right = robot.actuators()[2:]
    assert isclose(left, 8.0)
    assert isclose((left - right) * 0.0975 / 0.4, 2.0)


def test_full_acceleration_does_not_cost_the_turn():
    robot = rover()
    track = run(robot, Setpoint(velocity=Vec3(1.0, 0.0), yaw_rate=0.8), 0.3)
    assert track[-1].yaw_rate > 0.6


def test_a_stalled_wheel_does_not_wind_up():
    robot = rover(params={"torque_limit": 0.02})
    run(robot, Setpoint(velocity=Vec3(1.0, 0.0)), 20.0)
    end = run(robot, Setpoint(velocity=Vec3(-1.0, 0.0), yaw_rate=0.0), 15.0)[-1]
    assert speed_of(end) < 0


def test_motors_off_coasts_to_a_halt_and_parks():
    robot = rover(disturbance=Disturbance(form="constant", amplitude=0.01))
    run(robot, Setpoint(velocity=Vec3(1.0, 0.0)), 3.0)
    robot.motors_on = False
    begin = robot.kinematics()
    later = run(robot, Setpoint(velocity=Vec3(1.0, 0.0)), 2.1)[-1]
    assert isclose(speed_of(later), speed_of(begin) / 2.718, rel_tol=0.03)  # m / k_v = 2.1 s
    assert robot.actuators()[2:] == (0.0, 0.0)


def test_a_parked_rover_is_not_moved_by_a_light_push():
    robot = rover(disturbance=Disturbance(form="white"))
    robot.motors_on = False
    assert run(robot, Setpoint(), 2.0)[-1] == robot.kinematics()
    assert robot.kinematics()[:6] == (0.0,) * 6


def circle(t):
    a = 0.25 * t
    return 2 * cos(a), 2 * sin(a), -0.5 * sin(a), 0.5 * cos(a)


def rectangle(t):
    s = 0.5 * t
    if s < 4:
        return s, 0.0, 0.5, 0.0
    if s < 7:
        return 4.0, s - 4, 0.0, 0.5
    if s < 11:
        return 11 - s, 3.0, -0.5, 0.0
    return 0.0, 14 - s, 0.0, -0.5


@pytest.mark.parametrize(
    ("path", "seconds", "most"), [(circle, 25.1, 0.05), (rectangle, 28.0, 0.14)]
)
def test_a_path_streamed_at_20_hz_is_followed(path, seconds, most):
    north, east, v_north, v_east = path(0.0)
    robot = rover(north=north, east=east, yaw=atan2(v_east, v_north))
    total, steps = 0.0, round(seconds / robot.dt)
    for i in range(steps):
        if i % 25 == 0:
            north, east, v_north, v_east = path(i * robot.dt)
            target = Setpoint(position=Vec3(north, east), velocity=Vec3(v_north, v_east))
        if i % robot.control_every == 0:
            robot.control(target)
        robot.advance()
        k = robot.kinematics()
        north, east, _, _ = path((i + 1) * robot.dt)
        total += (k.north - north) ** 2 + (k.east - east) ** 2
    assert sqrt(total / steps) < most


def test_actuators_have_a_name_each():
    robot = rover()
    run(robot, Setpoint(velocity=Vec3(0.5, 0.0)), 3.0)
    assert len(robot.actuators()) == len(robot.actuator_names) == 4
    assert robot.actuators()[0] == pytest.approx(0.5 / 0.0975, rel=0.01)
