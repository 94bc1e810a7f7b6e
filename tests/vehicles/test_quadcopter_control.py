"""Every setpoint flies as its contract says, and the step responses meet their targets."""

from math import atan2, cos, hypot, isclose, pi, sin, sqrt

import pytest

from mavherd.vehicles.build import make_robot
from mavherd.vehicles.config import Disturbance, VehicleConfig
from mavherd.vehicles.robot import Setpoint, Vec3


def quadcopter(**config):
    robot = make_robot(VehicleConfig(kind="quadcopter", system_id=1, **config))
    robot.motors_on = True
    robot.reset_control()
    return robot


def run(robot, setpoint, seconds):
    """Fly `setpoint` and return the track, one `Kinematics` a step."""
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
    run(robot, Setpoint(position=Vec3(0, 0, -10)), 10.0)
    return robot


def yaw_of(k):
    return atan2(2 * (k.qw * k.qz + k.qx * k.qy), 1 - 2 * (k.qy**2 + k.qz**2))


def cos_tilt(k):
    return 1 - 2 * (k.qx**2 + k.qy**2)


def rise_time(values, final, dt):
    reach = [next(i for i, v in enumerate(values) if v >= share * final) for share in (0.1, 0.9)]
    return (reach[1] - reach[0]) * dt


def settling_time(values, final, dt):
    return dt * max(i for i, v in enumerate(values) if abs(v - final) > 0.02 * final)


STEP = Setpoint(position=Vec3(2.0, 1.0, -3.0), yaw=0.5)


def test_a_step_from_the_ground_meets_the_targets():
    robot = quadcopter()
    track = run(robot, STEP, 8.0)
    x, up = [k.north for k in track], [-k.down for k in track]
    assert isclose(rise_time(x, 2.0, robot.dt), 1.2, rel_tol=0.15)
    assert max(x) < 2.0 * 1.02
    assert settling_time(x, 2.0, robot.dt) < 2.5
    assert max(up) < 3.0 * 1.08
    assert settling_time(up, 3.0, robot.dt) < 2.5
    end = track[-1]
    assert (end.north, end.east, end.down) == pytest.approx((2.0, 1.0, -3.0), abs=0.01)
    assert isclose(yaw_of(end), 0.5, abs_tol=0.01)


def test_it_holds_its_place_in_a_random_force():
    robot = quadcopter(disturbance=Disturbance(form="held", amplitude=0.4, hold_s=0.1))
    track = run(robot, STEP, 24.0)[round(4.0 / robot.dt) :]
    assert 0.001 < sqrt(sum((k.north - 2.0) ** 2 for k in track) / len(track)) < 0.04


def test_the_paper_profile_flies_the_step_with_its_known_overshoot_in_height():
    robot = quadcopter(profile="paper")
    track = run(robot, STEP, 12.0)
    assert robot.control_every == 1
    assert max(k.north for k in track) < 2.0 * 1.03
    assert 1.25 < max(-k.down for k in track) / 3.0 < 1.45
    end = track[-1]
    assert (end.north, end.east, end.down) == pytest.approx((2.0, 1.0, -3.0), abs=0.02)


def test_the_response_does_not_depend_on_the_heading():
    plain = run(quadcopter(), Setpoint(position=Vec3(2.0, 0.0, -3.0)), 3.0)
    turned = run(quadcopter(yaw=-2.2), Setpoint(position=Vec3(2.0, 0.0, -3.0)), 3.0)
    # rolling and pitching have the same inertia here; only Euler angles tell them apart
    assert (
        max(hypot(a.north - b.north, a.east - b.east) for a, b in zip(plain, turned, strict=True))
        < 0.02
    )


def test_left_and_right_are_mirror_images():
    right = run(quadcopter(), Setpoint(position=Vec3(0.0, 2.0, -3.0)), 3.0)
    left = run(quadcopter(), Setpoint(position=Vec3(0.0, -2.0, -3.0)), 3.0)
    assert all(
        isclose(a.east, -b.east, abs_tol=1e-6) and isclose(a.down, b.down, abs_tol=1e-6)
        for a, b in zip(right, left, strict=True)
    )


def test_a_long_way_is_flown_within_the_speed_and_tilt_limits(hovering):
    track = run(hovering, Setpoint(position=Vec3(9.0, 12.0, -10.0)), 14.0)
    speeds = [hypot(k.v_north, k.v_east) for k in track]
    assert isclose(max(speeds), 1.5, rel_tol=0.06)
    assert min(cos_tilt(k) for k in track) > 0.85  # cos(30 deg) = 0.866
    assert all(abs(k.down + 10) < 0.1 for k in track)
    assert (track[-1].north, track[-1].east) == pytest.approx((9.0, 12.0), abs=0.02)


def test_climbs_and_descents_keep_their_speed_limits():
    robot = quadcopter()
    up = run(robot, Setpoint(position=Vec3(0, 0, -10)), 8.0)
    assert isclose(min(k.v_down for k in up), -2.5, rel_tol=0.03)
    assert min(k.down for k in up) > -10.3
    down = run(robot, Setpoint(position=Vec3(0, 0, -2)), 9.0)
    assert isclose(max(k.v_down for k in down), 1.5, rel_tol=0.03)
    assert isclose(down[-1].down, -2.0, abs_tol=0.02)


def test_velocity_feed_forward_follows_a_moving_target_without_lag(hovering):
    dt = hovering.dt
    errors = []
    for i in range(round(8.0 / dt)):
        target = Vec3(0.5 * i * dt, 0.0, -10.0 - 0.3 * i * dt)
        run(hovering, Setpoint(position=target, velocity=Vec3(0.5, 0.0, -0.3)), dt)
        k = hovering.kinematics()
        errors.append(hypot(k.north - target.north, k.down - target.down))
    assert max(errors[round(5.0 / dt) :]) < 0.01


def test_acceleration_feed_forward_adds_to_the_position_loop(hovering):
    held = Setpoint(position=Vec3(0, 0, -10), acceleration=Vec3(0.4, 0.0, 0.0))
    end = run(hovering, held, 8.0)[-1]
    assert isclose(end.north, 0.4 / 4.0, rel_tol=0.02)  # balanced by Kp e
    assert isclose(end.down, -10.0, abs_tol=0.01)


def test_velocity_alone_is_tracked_with_a_short_lag(hovering):
    track = run(hovering, Setpoint(velocity=Vec3(1.0, -0.5, 0.0)), 5.0)
    lag = hovering.dt * next(i for i, k in enumerate(track) if k.v_north > 1 - 1 / 2.718)
    assert 0.3 < lag < 0.5
    assert (track[-1].v_north, track[-1].v_east) == pytest.approx((1.0, -0.5), abs=0.01)
    assert max(k.v_north for k in track) < 1.1
    assert all(abs(k.down + 10) < 0.05 for k in track)


@pytest.mark.parametrize("v_down", [-1.0, -0.2, 0.7])
def test_vertical_velocity_is_tracked_without_steady_error(hovering, v_down):
    end = run(hovering, Setpoint(velocity=Vec3(0.0, 0.0, v_down)), 5.0)[-1]
    assert isclose(end.v_down, v_down, abs_tol=0.01)
    assert hypot(end.north, end.east) < 0.01


def test_a_constant_force_does_not_sink_a_tracked_velocity():
    robot = quadcopter(disturbance=Disturbance(form="constant", amplitude=2.0), seed=3)
    run(robot, Setpoint(position=Vec3(0, 0, -10)), 8.0)
    end = run(robot, Setpoint(velocity=Vec3(0.0, 0.0, -0.5)), 4.0)[-1]
    assert isclose(end.v_down, -0.5, abs_tol=0.02)


def test_the_height_reference_cannot_run_away_from_a_vehicle_that_cannot_follow():
    robot = quadcopter(params={"max_rotor_speed": 590.0})  # it can just lift itself
    run(robot, Setpoint(velocity=Vec3(0.0, 0.0, -2.5)), 4.0)
    rising = run(robot, Setpoint(velocity=Vec3(0.0, 0.0, 0.0)), 3.0)
    assert rising[-1].down - rising[0].down > -1.5


def test_velocity_requests_are_limited_to_v_max(hovering):
    end = run(hovering, Setpoint(velocity=Vec3(30.0, 40.0, -9.0)), 5.0)[-1]
    assert isclose(hypot(end.v_north, end.v_east), 1.5, rel_tol=0.02)
    assert isclose(end.v_east / end.v_north, 4 / 3, rel_tol=0.02)
    assert isclose(end.v_down, -2.5, rel_tol=0.02)


@pytest.mark.parametrize("up", [0.0, 2.0, -1.0])
def test_acceleration_alone_is_flown_as_given_while_climbing_or_not(hovering, up):
    setpoint = Setpoint(acceleration=Vec3(0.8, -0.4, -up))
    track = run(hovering, setpoint, 0.8)
    a, b = track[round(0.4 / hovering.dt)], track[-1]
    time = hovering.dt * (len(track) - 1 - round(0.4 / hovering.dt))
    got = (
        (b.v_north - a.v_north) / time,
        (b.v_east - a.v_east) / time,
        (b.v_down - a.v_down) / time,
    )
    assert got == pytest.approx((0.8, -0.4, -up), rel=0.06, abs=0.02)


def test_acceleration_alone_is_limited_in_tilt_and_speed(hovering):
    track = run(hovering, Setpoint(acceleration=Vec3(50.0, 0.0, 0.0)), 5.0)
    assert min(cos_tilt(k) for k in track) > 0.83
    assert isclose(track[-1].v_north, 1.5, rel_tol=0.03)
    assert all(abs(k.v_down) < 0.3 for k in track)


def test_nothing_given_brakes_and_stays_without_flying_back(hovering):
    run(hovering, Setpoint(velocity=Vec3(1.5, 0.0, -1.0)), 4.0)
    begin = hovering.kinematics()
    track = run(hovering, Setpoint(), 5.0)
    end = track[-1]
    assert 0.5 < end.north - begin.north < 1.5
    assert max(k.north for k in track) - end.north < 0.03
    assert abs(min(k.down for k in track) - end.down) < 0.05
    assert hypot(end.v_north, end.v_east, end.v_down) < 0.01


def test_a_new_hold_begins_where_the_vehicle_is_then(hovering):
    run(hovering, Setpoint(), 1.0)
    run(hovering, Setpoint(velocity=Vec3(1.0, 0.0, 0.0)), 4.0)
    assert run(hovering, Setpoint(), 4.0)[-1].north > 3.5


def test_yaw_not_given_holds_the_last_target(hovering):
    run(hovering, Setpoint(position=Vec3(0, 0, -10), yaw=1.2), 5.0)
    end = run(hovering, Setpoint(velocity=Vec3(1.0, 1.0, 0.0)), 5.0)[-1]
    assert isclose(yaw_of(end), 1.2, abs_tol=0.01)


def test_yaw_alone_turns_and_holds_the_place(hovering):
    track = run(hovering, Setpoint(yaw=-2.0), 6.0)
    assert isclose(yaw_of(track[-1]), -2.0, abs_tol=0.02)
    assert max(hypot(k.north, k.east) for k in track) < 0.02


def test_yaw_takes_the_short_way_round(hovering):
    run(hovering, Setpoint(yaw=3.0), 6.0)
    track = run(hovering, Setpoint(yaw=-3.0), 4.0)
    assert all(abs(yaw_of(k)) > 2.9 for k in track)
    assert isclose(yaw_of(track[-1]), -3.0, abs_tol=0.02)


def test_yaw_rate_turns_right_at_that_rate_and_stops_where_it_is(hovering):
    track = run(hovering, Setpoint(yaw_rate=0.5), 3.0)
    assert isclose(track[-1].yaw_rate, 0.5, rel_tol=0.02)
    turned = yaw_of(track[-1])
    assert isclose(turned, 0.5 * 3.0, rel_tol=0.05)
    assert isclose(yaw_of(run(hovering, Setpoint(), 3.0)[-1]), turned, abs_tol=0.1)


def test_yaw_rate_is_limited(hovering):
    assert max(k.yaw_rate for k in run(hovering, Setpoint(yaw_rate=50.0), 3.0)) < 2.2


def test_yaw_and_its_rate_follow_a_turning_target_without_lag(hovering):
    dt, rate = hovering.dt, 0.4
    for i in range(round(6.0 / dt)):
        target = (rate * i * dt + pi) % (2 * pi) - pi
        run(hovering, Setpoint(yaw=target, yaw_rate=rate), dt)
    assert isclose(yaw_of(hovering.kinematics()), target, abs_tol=0.03)


def test_reset_forgets_the_hold_and_the_yaw_target(hovering):
    run(hovering, Setpoint(yaw=1.0), 0.1)
    hovering.reset_control()
    assert abs(yaw_of(run(hovering, Setpoint(), 3.0)[-1])) < 0.2


def test_the_same_flight_is_the_same_to_the_last_bit():
    config = {"disturbance": Disturbance(form="white"), "seed": 5}
    assert run(quadcopter(**config), STEP, 2.0) == run(quadcopter(**config), STEP, 2.0)


def test_position_that_moves_in_20_hz_steps_is_followed_round_a_circle(hovering):
    radius, speed, dt = 2.0, 0.5, hovering.dt
    run(hovering, Setpoint(position=Vec3(radius, 0, -10)), 6.0)
    total = 0.0
    steps = round(2 * pi * radius / speed / dt)
    for i in range(steps):
        if i % 25 == 0:
            a = speed / radius * i * dt
            target = Setpoint(
                position=Vec3(radius * cos(a), radius * sin(a), -10.0),
                velocity=Vec3(-speed * sin(a), speed * cos(a), 0.0),
            )
        if i % hovering.control_every == 0:
            hovering.control(target)
        hovering.advance()
        k, a = hovering.kinematics(), speed / radius * (i + 1) * dt
        total += (k.north - radius * cos(a)) ** 2 + (k.east - radius * sin(a)) ** 2
    assert sqrt(total / steps) < 0.05 * 1.25
