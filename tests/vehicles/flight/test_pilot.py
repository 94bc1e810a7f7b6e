"""A pilot flies STABILIZE, ALT_HOLD and LOITER, and drives MANUAL; without one, all stays calm."""

from math import asin, atan2, hypot, pi

import pytest

from mavherd.transport.mavlink import mav

STABILIZE, ALT_HOLD, LOITER, MANUAL = 0, 2, 5, 0
THROTTLED = (STABILIZE, ALT_HOLD, LOITER)


def arm(desk, mode):
    assert desk.command(mav.MAV_CMD_DO_SET_MODE, 1, mode) == mav.MAV_RESULT_ACCEPTED
    assert desk.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mav.MAV_RESULT_ACCEPTED


def fly(desk, mode, height=10.0):
    """Take off in GUIDED, then let the pilot's mode take over."""
    desk.fly(height)
    assert desk.command(mav.MAV_CMD_DO_SET_MODE, 1, mode) == mav.MAV_RESULT_ACCEPTED
    return desk


def hold(desk, seconds, x=0, y=0, z=500, r=0):
    """Hold the sticks there, ten messages a second; return where the vehicle was each time."""
    track = []
    for _ in range(round(seconds * 10)):
        target = desk.vehicle.config.system_id
        desk.send(mav.MAVLink_manual_control_message(target, x, y, z, r, 0))
        desk.run(0.1)
        track.append(desk.where)
    return track


def angles(k):
    return (
        atan2(2 * (k.qw * k.qx + k.qy * k.qz), 1 - 2 * (k.qx**2 + k.qy**2)),
        asin(2 * (k.qw * k.qy - k.qz * k.qx)),
        atan2(2 * (k.qw * k.qz + k.qx * k.qy), 1 - 2 * (k.qy**2 + k.qz**2)),
    )


def speed(k):
    return hypot(k.v_north, k.v_east)


# On the ground


@pytest.mark.parametrize("mode", THROTTLED)
def test_armed_with_nobody_at_the_sticks_it_idles(quad, mode):
    arm(quad, mode)
    quad.run(5)
    assert not quad.autopilot.in_air
    assert 50 < quad.vehicle.robot.actuators()[0] < 200


@pytest.mark.parametrize("mode", THROTTLED)
def test_a_low_throttle_idles_and_is_disarmed_in_time(quad, mode):
    arm(quad, mode)
    hold(quad, 5, z=0)
    assert not quad.autopilot.in_air
    assert quad.autopilot.armed
    hold(quad, 6, z=0)
    assert not quad.autopilot.armed


@pytest.mark.parametrize("mode", [ALT_HOLD, LOITER])
def test_a_centred_throttle_does_not_take_off(quad, mode):
    arm(quad, mode)
    hold(quad, 3)
    assert not quad.autopilot.in_air


@pytest.mark.parametrize("mode", THROTTLED)
def test_raising_the_throttle_takes_off(quad, mode):
    arm(quad, mode)
    hold(quad, 0.5, z=0)
    hold(quad, 2, z=750)
    assert quad.autopilot.in_air
    assert quad.where.down < -0.5
    assert speed(quad.where) < 0.05


# STABILIZE


def test_half_throttle_hovers_also_while_leaning(quad):
    fly(quad, STABILIZE)
    for k in hold(quad, 2):
        assert abs(k.down + 10) < 0.2
    leaning = hold(quad, 2, y=500)
    assert angles(leaning[-1])[0] > 0.2
    assert abs(leaning[-1].v_down - leaning[4].v_down) < 0.1


def test_throttle_is_thrust(quad):
    fly(quad, STABILIZE)
    up = hold(quad, 1, z=600)
    lift = 4 * 8.54858e-6 * 838.0**2 / 1.2
    expected = (lift - 9.80665) * 0.2  # a fifth of the way from hovering to full
    assert up[-1].v_down - up[-6].v_down == pytest.approx(-0.5 * expected, rel=0.05)
    fall = hold(quad, 1, z=0)
    assert fall[-1].v_down - fall[-6].v_down == pytest.approx(0.5 * 9.80665, rel=0.05)


@pytest.mark.parametrize("mode", [STABILIZE, ALT_HOLD])
def test_sticks_are_angles(quad, mode):
    fly(quad, mode, 20.0)
    roll, pitch, _ = angles(hold(quad, 1, y=1000)[-1])
    assert (roll, pitch) == pytest.approx((pi / 6, 0.0), abs=0.01)
    end = hold(quad, 1, x=500)[-1]
    assert angles(end)[1] == pytest.approx(-pi / 6 * 0.474, abs=0.01)  # forward: nose down
    assert end.v_north > 0.5


@pytest.mark.parametrize("mode", THROTTLED)
def test_the_yaw_stick_turns_and_stops(quad, mode):
    fly(quad, mode)
    assert hold(quad, 1.5, r=300)[-1].yaw_rate == pytest.approx(0.26 * 3.534, rel=0.15)
    turned = angles(quad.where)[2]
    assert turned > 0.8
    end = hold(quad, 4)[-1]
    assert abs(end.yaw_rate) < 0.01
    assert abs(angles(end)[2] - turned) < 0.3


# ALT_HOLD


def test_the_throttle_is_a_climb_rate_beyond_its_dead_zone(quad):
    fly(quad, ALT_HOLD)
    assert abs(hold(quad, 2, z=590)[-1].down + 10) < 0.05
    assert hold(quad, 3, z=800)[-1].v_down == pytest.approx(-0.5 * 2.5, abs=0.03)
    assert abs(hold(quad, 2)[-1].v_down) < 0.03
    assert hold(quad, 3, z=300)[-1].v_down == pytest.approx(0.25 * 2.5, abs=0.03)


def test_pilot_speeds_are_settings(quad):
    fly(quad, LOITER, 20.0)
    settings = quad.autopilot.settings
    settings.pilot_speed_up, settings.pilot_speed_down = 4.0, 0.5
    assert hold(quad, 4, z=1000)[-1].v_down == pytest.approx(-4, abs=0.05)
    assert hold(quad, 6, z=0)[-1].v_down == pytest.approx(0.5, abs=0.05)


def test_the_pilots_vertical_acceleration_is_a_setting(quad):
    fly(quad, ALT_HOLD)
    quad.autopilot.settings.pilot_accel_z = 0.5
    assert hold(quad, 2, z=1000)[-1].v_down == pytest.approx(-1.0, abs=0.1)


def test_a_pilot_lands_and_the_motors_stop(quad):
    fly(quad, ALT_HOLD, 3.0)
    hold(quad, 5, z=200)
    assert not quad.autopilot.in_air
    assert quad.autopilot.armed
    hold(quad, 11, z=200)
    assert not quad.autopilot.armed


# LOITER


def test_sticks_are_velocities_along_the_heading(quad):
    fly(quad, LOITER)
    hold(quad, 1, r=500)
    yaw = angles(hold(quad, 2)[-1])[2]
    assert yaw > 0.5
    forward = hold(quad, 4, x=1000)[-1]
    assert speed(forward) == pytest.approx(1.5, abs=0.05)
    assert atan2(forward.v_east, forward.v_north) == pytest.approx(yaw, abs=0.05)
    right = hold(quad, 4, y=500)[-1]
    assert speed(right) == pytest.approx(0.474 * 1.5, abs=0.05)
    across = (atan2(right.v_east, right.v_north) - yaw) % (2 * pi)
    assert across == pytest.approx(pi / 2, abs=0.05)


def test_let_go_it_stays_where_it_is(quad):
    fly(quad, LOITER)
    hold(quad, 4, x=1000)
    track = hold(quad, 6)
    assert speed(track[-1]) < 0.02
    assert hypot(track[-1].north - track[25].north, track[-1].east - track[25].east) < 0.05
    assert abs(track[-1].down + 10) < 0.1


def test_climbing_in_loiter_does_not_move_it(quad):
    fly(quad, LOITER)
    end = hold(quad, 4, z=1000)[-1]
    assert end.v_down == pytest.approx(-2.5, abs=0.1)
    assert hypot(end.north, end.east) < 0.1


def test_a_takeoff_command_works_in_loiter(quad):
    arm(quad, LOITER)
    height = (0, 0, 0, 0, 0, 0, 4.0)
    assert quad.command(mav.MAV_CMD_NAV_TAKEOFF, *height) == mav.MAV_RESULT_ACCEPTED
    quad.run(7)
    assert quad.where.down == pytest.approx(-4, abs=0.25)


# Without a pilot


@pytest.mark.parametrize("mode", THROTTLED)
def test_in_the_air_with_nobody_at_the_sticks_it_stays_level_and_up(quad, mode):
    fly(quad, mode)
    quad.run(5)
    assert abs(quad.where.down + 10) < 0.1
    assert speed(quad.where) < 0.1
    assert angles(quad.where)[:2] == pytest.approx((0, 0), abs=0.02)


@pytest.mark.parametrize("mode", THROTTLED)
def test_a_pilot_who_falls_silent_leaves_it_level_and_up(quad, mode):
    fly(quad, mode, 20.0)
    hold(quad, 2, y=600, z=700)
    quad.run(6)
    down = quad.where.down
    quad.run(3)
    assert abs(quad.where.down - down) < 0.1
    assert angles(quad.where)[:2] == pytest.approx((0, 0), abs=0.02)
    if mode == LOITER:
        assert speed(quad.where) < 0.02


def test_another_station_cannot_take_the_sticks(quad):
    fly(quad, STABILIZE)
    quad.autopilot.settings.gcs_system_id = 254
    hold(quad, 2, y=1000, z=1000)
    assert abs(quad.where.down + 10) < 0.1
    assert abs(angles(quad.where)[0]) < 0.01


# MANUAL


def test_a_rover_is_driven_by_hand(rover):
    arm(rover, MANUAL)
    rover.run(2)
    assert speed(rover.where) == 0
    assert hold(rover, 4, z=1000)[-1].v_north == pytest.approx(1.0, abs=0.02)
    assert hold(rover, 4, z=-525)[-1].v_north == pytest.approx(-0.5, abs=0.02)
    right = hold(rover, 2, y=525, z=0)[-1]
    assert right.yaw_rate == pytest.approx(1.0, abs=0.02)
    assert abs(right.v_north) < 0.02
    assert hold(rover, 2, y=-525, z=0)[-1].yaw_rate == pytest.approx(-1.0, abs=0.02)


def test_a_rover_that_backs_steers_as_a_car_does(rover):
    arm(rover, MANUAL)
    assert hold(rover, 2, y=525, z=-525)[-1].yaw_rate == pytest.approx(-1.0, abs=0.02)


def test_a_rovers_full_throttle_is_its_cruise_speed(rover):
    arm(rover, MANUAL)
    rover.autopilot.settings.cruise_speed = 0.6
    assert hold(rover, 4, z=1000)[-1].v_north == pytest.approx(0.6, abs=0.02)


def test_a_rover_without_its_pilot_stops(rover):
    arm(rover, MANUAL)
    hold(rover, 4, y=200, z=800)
    rover.run(6)
    assert speed(rover.where) < 0.01
    assert abs(rover.where.yaw_rate) < 0.01
