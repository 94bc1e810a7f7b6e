"""Targets are echoed as they are flown, and distances to them are right."""

from math import cos, pi, sin

import pytest

from mavherd.transport.frames import Origin
from mavherd.transport.mavlink import mav

ORIGIN = Origin()
LOCAL = mav.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED
GLOBAL = mav.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT
ATTITUDE = mav.MAVLINK_MSG_ID_ATTITUDE_TARGET


def refused(on_desk, message_id):
    return on_desk.command(mav.MAV_CMD_REQUEST_MESSAGE, message_id) == mav.MAV_RESULT_FAILED


def test_a_target_is_echoed_with_its_own_mask(quad, ask):
    quad.fly()
    quad.send(quad.target(0x9C0, x=3.0, y=4.0, z=-5.0, vx=0.1, vy=0.2, vz=-0.3, yaw=0.7))
    local, world = ask(quad, "POSITION_TARGET_LOCAL_NED"), ask(quad, "POSITION_TARGET_GLOBAL_INT")
    assert (local.coordinate_frame, local.type_mask) == (1, 0x9C0)
    assert (local.x, local.y, local.z) == (3.0, 4.0, -5.0)
    assert (local.vx, local.vy, local.vz) == pytest.approx((0.1, 0.2, -0.3))
    assert local.yaw == pytest.approx(0.7)
    assert (world.coordinate_frame, world.type_mask) == (0, 0x9C0)
    assert ORIGIN.from_geodetic(world.lat_int * 1e-7, world.lon_int * 1e-7) == pytest.approx(
        (3.0, 4.0), abs=0.02
    )
    assert world.alt == pytest.approx(ORIGIN.alt_m + 5.0)


def test_targets_are_echoed_in_guided_only(quad):
    assert refused(quad, LOCAL)
    quad.fly()
    quad.send(quad.target(0xDF8, x=3.0, z=-5.0))
    assert not refused(quad, LOCAL)
    quad.command(mav.MAV_CMD_NAV_LAND)
    assert refused(quad, LOCAL)
    assert refused(quad, GLOBAL)


def test_an_attitude_target_is_echoed_as_angles(quad, ask):
    quad.fly()
    half = 0.1
    q = [cos(half), sin(half), 0.0, 0.0]
    quad.send(mav.MAVLink_set_attitude_target_message(0, 1, 1, 7, q, 0, 0, 0, 0.5))
    quad.run(0.05)
    assert refused(quad, LOCAL)
    m = ask(quad, "ATTITUDE_TARGET")
    assert m.q == pytest.approx(q, abs=1e-3)
    assert m.type_mask == 7
    assert 0.3 < m.thrust < 0.7
    quad.command(mav.MAV_CMD_NAV_LAND)
    quad.run(0.05)
    assert refused(quad, ATTITUDE)


def test_the_navigation_controller_tells_how_far_it_is(quad, ask):
    quad.fly()
    quad.send(quad.target(0xDF8, x=-30.0, y=-40.0, z=-8.0))
    quad.run(0.02)
    m = ask(quad, "NAV_CONTROLLER_OUTPUT")
    assert m.wp_dist == pytest.approx(50, abs=1)
    assert m.target_bearing == pytest.approx(-127, abs=1)  # atan2(-40, -30)
    assert m.alt_error == pytest.approx(8.0 + quad.where.down, abs=0.01)


def test_nowhere_to_go_is_no_distance(rover, ask):
    m = ask(rover, "NAV_CONTROLLER_OUTPUT")
    assert (m.wp_dist, m.alt_error) == (0, 0.0)


def test_a_far_away_target_is_clipped(rover, ask):
    rover.fly()
    rover.send(rover.target(0xDF8, x=9e5, y=-9e5))
    rover.run(0.02)
    assert ask(rover, "NAV_CONTROLLER_OUTPUT").wp_dist == 65534


def test_a_rovers_forward_speed_is_echoed_along_its_heading(desk, ask):
    rover = desk("rover", yaw=pi / 2)
    rover.fly()
    rover.send(rover.target(0x5C7, frame=8, vx=0.5, yaw_rate=0.0))
    m = ask(rover, "POSITION_TARGET_LOCAL_NED")
    assert (m.vx, m.vy) == pytest.approx((0.0, 0.5), abs=1e-6)
