"""With profile `ardupilot` our vehicles move about as ArduPilot's did (mavlink.md B1)."""

from math import atan2, cos, hypot, sin

import pytest

from mavherd.vehicles.build import make_robot
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.robot import Setpoint, Vec3

UP = 9.5


def robot(kind, **config):
    robot = make_robot(VehicleConfig(kind=kind, system_id=1, profile="ardupilot", **config))
    robot.motors_on = True
    robot.reset_control()
    return robot


def run(robot, setpoint, seconds):
    """Follow a setpoint, or a function of time, and return the track, one a step."""
    track = []
    for i in range(round(seconds / robot.dt)):
        if i % robot.control_every == 0:
            robot.control(setpoint(i * robot.dt) if callable(setpoint) else setpoint)
        robot.advance()
        track.append(robot.kinematics())
    return track


def first(track, holds, dt=0.002):
    """Return when something first held, s."""
    return dt * next(i for i, k in enumerate(track) if holds(k))


@pytest.fixture
def quad():
    quad = robot("quadcopter")
    run(quad, Setpoint(position=Vec3(0, 0, -UP)), 14.0)
    return quad


@pytest.fixture
def rover():
    return robot("rover")


def test_a_takeoff_takes_about_nine_seconds():
    track = run(robot("quadcopter"), Setpoint(position=Vec3(0, 0, -UP)), 14.0)
    assert first(track, lambda k: k.down < 0) > 1.5  # the rotors spool up
    assert 7.5 < first(track, lambda k: k.down < -UP + 0.2) < 9.5
    assert min(k.v_down for k in track) == pytest.approx(-2.5, abs=0.05)
    assert min(k.down for k in track) > -UP - 0.1
    assert track[-1].down == pytest.approx(-UP, abs=0.02)


@pytest.mark.parametrize("way", [2.0, 5.0, 20.0, 100.0])
def test_a_position_is_reached_without_running_past_it(quad, way):
    track = run(quad, Setpoint(position=Vec3(way, 0, -UP)), 8.0 + way / 8)
    assert max(k.north for k in track) < way + 0.1
    assert track[-1].north == pytest.approx(way, abs=0.03)
    assert all(abs(k.down + UP) < 0.05 for k in track)


def test_twenty_metres_are_flown_at_over_five_metres_a_second(quad):
    track = run(quad, Setpoint(position=Vec3(20, 0, -UP)), 8.0)
    assert 4.9 < max(k.v_north for k in track) < 7.0
    assert first(track, lambda k: k.north > 19.5) == pytest.approx(6.0, abs=0.8)


def test_the_speed_limit_is_that_of_wpnav_speed(quad):
    track = run(quad, Setpoint(position=Vec3(120, 0, -UP)), 9.0)
    assert max(k.v_north for k in track) == pytest.approx(10.0, abs=0.1)


def test_three_metres_a_second_are_reached_held_and_stopped(quad):
    track = run(quad, Setpoint(velocity=Vec3(3, 0, 0)), 5.0)
    assert first(track, lambda k: k.v_north > 2.8) == pytest.approx(1.7, abs=0.4)
    assert max(k.v_north for k in track) < 3.1
    assert track[-1].v_north == pytest.approx(3.0, abs=0.02)
    assert all(abs(k.down + UP) < 0.05 for k in track)
    stop = run(quad, Setpoint(velocity=Vec3()), 4.0)
    assert first(stop, lambda k: k.v_north < 0.1) == pytest.approx(1.7, abs=0.4)


@pytest.mark.parametrize("speed", [1.5, 3.0, 5.0, 10.0])
def test_a_hold_stops_without_swinging_back(quad, speed):
    run(quad, Setpoint(velocity=Vec3(speed, 0, 0)), 2.0 + speed / 2)
    begin = quad.kinematics()
    track = run(quad, Setpoint(), 8.0)
    assert min(k.v_north for k in track) > -0.05
    assert max(k.north for k in track) - track[-1].north < 0.03
    assert abs(track[-1].down - begin.down) < 0.05
    if speed == 5.0:
        assert first(track, lambda k: k.v_north < 0.2) == pytest.approx(1.7, abs=0.3)


@pytest.mark.parametrize("v_down", [-2.5, 1.5])
def test_a_hold_stops_a_climb_or_descent_without_swinging_back(quad, v_down):
    run(quad, Setpoint(velocity=Vec3(0, 0, v_down)), 4.0)
    track = run(quad, Setpoint(), 5.0)
    end = track[-1].down
    assert max((k.down - end) * (1 if v_down > 0 else -1) for k in track) < 0.05


def test_a_circle_of_position_and_velocity_is_tracked(quad):
    def circle(t):
        a = 0.5 * (round(t * 500) // 50 / 10)  # at 10 Hz
        place = Vec3(5 * cos(a), 5 * sin(a), -UP)
        return Setpoint(position=place, velocity=Vec3(-2.5 * sin(a), 2.5 * cos(a), 0))

    run(quad, Setpoint(position=Vec3(5, 0, -UP)), 6.0)
    track = run(quad, circle, 25.0)
    late = [
        hypot(k.north - 5 * cos(0.001 * i), k.east - 5 * sin(0.001 * i))
        for i, k in enumerate(track, 1)
    ][5000:]
    assert max(late) < 0.45  # the target itself jumps by 0.25 m


def test_velocity_with_a_yaw_rate(quad):
    end = run(quad, Setpoint(velocity=Vec3(2, 0, 0), yaw_rate=0.4), 5.0)[-1]
    assert end.yaw_rate == pytest.approx(0.4, abs=0.02)
    assert end.v_north == pytest.approx(2.0, abs=0.1)


def test_it_lands_softly(quad):
    def down(t):
        return Setpoint(velocity=Vec3(0, 0, 0.5))

    track = run(quad, down, 21.0)
    assert quad.on_ground
    assert quad.impact_speed == pytest.approx(0.5, abs=0.02)
    assert track[-1].down == 0


def test_the_default_profile_brakes_too_when_its_speed_limit_is_raised():
    quad = make_robot(VehicleConfig(kind="quadcopter", system_id=1, params={"v_max": 8.0}))
    quad.motors_on = True
    run(quad, Setpoint(position=Vec3(0, 0, -UP)), 9.0)
    track = run(quad, Setpoint(position=Vec3(30, 0, -UP)), 14.0)
    assert max(k.v_north for k in track) > 6
    assert max(k.north for k in track) < 30.3


# Rover


@pytest.mark.parametrize("way", [5.0, 15.0])
def test_a_rover_drives_at_cruise_speed_and_stops_at_its_target(rover, way):
    track = run(rover, Setpoint(position=Vec3(way, 0, 0)), 14.0)
    assert max(k.v_north for k in track) == pytest.approx(2.0, abs=0.1)
    assert max(k.north for k in track) < way + 0.2
    assert track[-1].north == pytest.approx(way, abs=0.1)
    if way == 15.0:
        assert 7.5 < first(track, lambda k: k.north > 14.5) < 10


def test_a_target_behind_a_rover_is_reached(rover):
    end = run(rover, Setpoint(position=Vec3(-15, 1, 0)), 16.0)[-1]
    assert hypot(end.north + 15, end.east - 1) < 0.1


def test_a_rover_turns_to_a_velocity_holds_it_and_stops(rover):
    track = run(rover, Setpoint(velocity=Vec3(0, 1.5, 0)), 6.0)
    assert track[-1].v_east == pytest.approx(1.5, abs=0.01)
    assert abs(track[-1].v_north) < 0.01
    stop = run(rover, Setpoint(), 4.0)
    assert first(stop, lambda k: k.v_east < 0.05) == pytest.approx(1.5, abs=0.3)  # about 1 m/s^2
    assert stop[-1].v_east == pytest.approx(0, abs=0.01)
    assert min(k.v_east for k in stop) > -0.1


def test_a_rover_speeds_up_within_its_acceleration_limit(rover):
    track = run(rover, Setpoint(velocity=Vec3(2, 0, 0)), 3.0)
    assert first(track, lambda k: k.v_north > 1.8) > 1.7


def test_a_rover_reverses(rover):
    end = run(rover, Setpoint(velocity=Vec3(-1, 0, 0), yaw_rate=0.0), 4.0)[-1]
    assert end.v_north == pytest.approx(-1, abs=0.01)
    assert atan2(end.qz, end.qw) == 0


def test_a_rover_turns_on_the_spot(rover):
    end = run(rover, Setpoint(yaw_rate=0.5), 3.0)[-1]
    assert end.yaw_rate == pytest.approx(0.5, abs=0.01)
    assert hypot(end.north, end.east) < 1e-6
