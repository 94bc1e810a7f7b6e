"""NED and ENU, attitudes and geodesy agree, whichever way one goes."""

from math import atan2, cos, degrees, hypot, isclose, pi, radians, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.transport.frames import (
    Origin,
    quaternion_from_euler,
    quaternion_to_enu,
    swap_ned_enu,
    swap_yaw,
    wrap_angle,
    yaw_of,
)
from mavherd.transport.mavlink import mav

ANGLE = st.floats(-pi, pi)
METRES = st.floats(-5000, 5000)
ZURICH = Origin()


def rotate(q, v):
    """Turn `v` by the attitude `q` (w x y z): v + 2 w (u x v) + 2 u x (u x v)."""
    w, *u = q
    uv = cross(u, v)
    uuv = cross(u, uv)
    return tuple(a + 2 * (w * b + c) for a, b, c in zip(v, uv, uuv, strict=True))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def close(a, b, tolerance=1e-9):
    return all(isclose(x, y, rel_tol=0, abs_tol=tolerance) for x, y in zip(a, b, strict=True))


def same_angle(a, b):
    return abs(wrap_angle(a - b)) < 1e-9


def test_north_east_and_down_become_what_they_are():
    assert swap_ned_enu((1.0, 0.0, 0.0)) == (0.0, 1.0, -0.0)  # north is y
    assert swap_ned_enu((0.0, 1.0, 0.0)) == (1.0, 0.0, -0.0)  # east is x
    assert swap_ned_enu((0.0, 0.0, 1.0)) == (0.0, 0.0, -1.0)


@given(st.tuples(METRES, METRES, METRES), ANGLE)
def test_the_swap_is_its_own_inverse(v, yaw):
    assert swap_ned_enu(swap_ned_enu(v)) == v
    assert same_angle(swap_yaw(swap_yaw(yaw)), yaw)


def test_compass_directions():
    assert swap_yaw(0) == pi / 2  # north
    assert swap_yaw(pi / 2) == 0  # east
    assert same_angle(swap_yaw(pi), -pi / 2)  # south
    assert same_angle(swap_yaw(-pi / 2), -pi)  # west


@given(ANGLE, st.floats(0.001, pi / 2))
def test_a_left_turn_raises_the_heading_and_lowers_the_yaw(heading, turn):
    yaw, yaw_after = swap_yaw(heading), swap_yaw(heading + turn)
    assert isclose(wrap_angle(yaw_after - yaw), -turn, abs_tol=1e-9)


def test_a_rover_told_to_turn_left_lowers_its_mavlink_yaw(rover):
    rover.fly()
    left_in_enu = 0.5  # rad/s, counter-clockwise
    rover.send(rover.target(0x5FF, yaw_rate=-left_in_enu))
    before = swap_yaw(yaw_of(rover.where[6:10]))
    (*_, attitude) = (m for m in rover.run(1.0) if m.get_type() == "ATTITUDE")
    assert attitude.yaw < -0.2
    assert attitude.yawspeed < -0.2
    assert swap_yaw(attitude.yaw) > before + 0.2


@given(ANGLE)
def test_wrapped_angles_are_the_same_direction_within_one_turn(angle):
    for turns in (-3, 0, 5):
        wrapped = wrap_angle(angle + turns * 2 * pi)
        assert -pi <= wrapped < pi
        assert close((cos(wrapped), sin(wrapped)), (cos(angle), sin(angle)))


@given(ANGLE, st.floats(-1.5, 1.5), ANGLE)
def test_an_attitude_points_the_same_way_in_both_frames(roll, pitch, yaw):
    ned = quaternion_from_euler(roll, pitch, yaw)
    enu = quaternion_to_enu(ned)
    assert isclose(sum(c * c for c in enu), 1.0)
    for forward_left_up in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
        x, y, z = forward_left_up
        seen_in_ned = rotate(ned, (x, -y, -z))
        assert close(rotate(enu, forward_left_up), swap_ned_enu(seen_in_ned))


@given(ANGLE, st.floats(-1.5, 1.5), ANGLE)
def test_the_yaw_of_an_attitude_is_the_one_it_was_made_with(roll, pitch, yaw):
    q = quaternion_from_euler(roll, pitch, yaw)
    assert same_angle(yaw_of(q), yaw)
    nose = rotate(q, (1.0, 0.0, 0.0))
    assert same_angle(atan2(nose[1], nose[0]), yaw)


def test_euler_angles_have_their_signs():
    right_wing = rotate(quaternion_from_euler(0.1, 0.0, 0.0), (0.0, 1.0, 0.0))
    assert right_wing[2] > 0  # rolled right: the right wing is lower
    nose = rotate(quaternion_from_euler(0.0, 0.1, 0.0), (1.0, 0.0, 0.0))
    assert nose[2] < 0  # pitched up


@given(st.floats(-89, 89), st.floats(-180, 180), METRES, METRES)
def test_a_place_goes_to_the_map_and_back(lat, lon, north, east):
    origin = Origin(lat, lon)
    assert close(origin.from_geodetic(*origin.to_geodetic(north, east)), (north, east), 1e-4)


@given(st.floats(-89, 89), st.floats(-180, 180), METRES, METRES)
def test_every_place_has_a_longitude_that_maps_know(lat, lon, north, east):
    assert abs(Origin(lat, lon).to_geodetic(north, east)[1]) <= 180


def test_a_fleet_at_the_date_line_is_not_torn_apart():
    origin = Origin(0.0, 179.9999)
    lat, lon = origin.to_geodetic(0.0, 100.0)
    assert lon < -179
    assert close(origin.from_geodetic(lat, lon), (0.0, 100.0), 1e-4)


def test_a_degree_has_its_known_length():
    # WGS-84: a degree of latitude is 110.574 km at the equator and 111.132 km at 45 degrees,
    # a degree of longitude 111.320 km and 78.847 km.
    for lat, per_lat, per_lon in ((0.0, 110_574, 111_320), (45.0, 111_132, 78_847)):
        origin = Origin(lat, 10.0)
        north, _ = origin.from_geodetic(lat + 1, 10.0)
        _, east = origin.from_geodetic(lat, 11.0)
        assert isclose(north, per_lat, rel_tol=2e-5)
        assert isclose(east, per_lon, rel_tol=2e-5)


def test_metres_agree_with_a_sphere_to_the_flattening_of_the_earth():
    lat, lon = ZURICH.to_geodetic(300.0, -400.0)
    dy = radians(lat - ZURICH.lat_deg) * 6_371_000
    dx = radians(lon - ZURICH.lon_deg) * 6_371_000 * cos(radians(ZURICH.lat_deg))
    assert isclose(hypot(dx, dy), 500.0, rel_tol=4e-3)
    assert dy > 0 > dx


@pytest.mark.parametrize(
    "bad",
    [(90.0, 0.0, 0.0), (0.0, 181.0, 0.0), (0.0, 0.0, 1e5), (float("nan"), 0.0, 0.0)],
)
def test_an_origin_off_the_map_is_refused(bad):
    with pytest.raises(ValueError, match=r"origin|altitude"):
        Origin(*bad)


def test_the_global_and_the_local_position_are_the_same_place(desk):
    there = desk("rover", north=120.0, east=-80.0, down=-2.0, yaw=radians(30))
    there.run(0.01)
    ask = mav.MAV_CMD_REQUEST_MESSAGE
    (_, local) = there.ask(ask, mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED)
    (_, world) = there.ask(ask, mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT)
    north, east = ZURICH.from_geodetic(world.lat * 1e-7, world.lon * 1e-7)
    assert close((north, east), (local.x, local.y), 0.02)
    assert world.alt == round((ZURICH.alt_m - local.z) * 1e3)
    assert world.hdg == round(degrees(radians(30)) * 100)
