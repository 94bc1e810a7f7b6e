"""Telemetry says what the physics has, in MAVLink's units: motion, place and time."""

from math import cos, degrees, hypot, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.transport.frames import Origin, wrap_angle, yaw_of
from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.config import SIMULATED_EPOCH_US
from mavherd.vehicles.protocol.telemetry import name_of

ORIGIN = Origin()


def test_system_time_is_the_epoch_plus_simulated_time(quad, ask):
    for seconds in (0.5, 2.0):
        quad.run(seconds)
        m = ask(quad, "SYSTEM_TIME")
        assert m.time_unix_usec == SIMULATED_EPOCH_US + quad.vehicle.now_us
        assert m.time_boot_ms == round(quad.now * 1000)
        assert ask(quad, "GPS_RAW_INT").time_usec == m.time_unix_usec


def test_the_epoch_can_be_the_wall_clocks(desk, ask):
    vehicle = desk(epoch_us=1_800_000_000_000_000)
    vehicle.run(1)
    assert ask(vehicle, "SYSTEM_TIME").time_unix_usec == 1_800_000_001_000_000


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_local_position_is_the_physics(kind, ask, moving):
    vehicle = moving(kind)
    m, k = ask(vehicle, "LOCAL_POSITION_NED"), vehicle.where
    assert (m.x, m.y, m.z, m.vx, m.vy, m.vz) == pytest.approx(k[:6], abs=1e-4)
    assert hypot(m.vx, m.vy) > 0.8


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_global_position_agrees_with_local_position(kind, ask, moving):
    vehicle = moving(kind)
    local, world = ask(vehicle, "LOCAL_POSITION_NED"), ask(vehicle, "GLOBAL_POSITION_INT")
    north, east = ORIGIN.from_geodetic(world.lat * 1e-7, world.lon * 1e-7)
    assert (north, east) == pytest.approx((local.x, local.y), abs=0.02)
    assert world.alt == pytest.approx((ORIGIN.alt_m - local.z) * 1e3, abs=1)
    assert world.relative_alt == pytest.approx((-2.0 - local.z) * 1e3, abs=1)
    speeds = world.vx, world.vy, world.vz
    assert speeds == pytest.approx((local.vx * 100, local.vy * 100, local.vz * 100), abs=0.6)
    yaw = degrees(yaw_of(vehicle.where[6:10])) % 360
    assert world.hdg == pytest.approx(yaw * 100, abs=1)


def test_gps_agrees_with_global_position(ask, moving):
    vehicle = moving()
    gps, world = ask(vehicle, "GPS_RAW_INT"), ask(vehicle, "GLOBAL_POSITION_INT")
    assert (gps.lat, gps.lon, gps.alt) == (world.lat, world.lon, world.alt)
    assert gps.fix_type == mav.GPS_FIX_TYPE_3D_FIX
    assert gps.vel == pytest.approx(hypot(world.vx, world.vy), abs=1)
    course = gps.cog / 100 * pi / 180
    assert gps.vel * cos(course) == pytest.approx(world.vx, abs=1)
    assert gps.vel * sin(course) == pytest.approx(world.vy, abs=1)


def test_both_attitudes_agree(ask, moving):
    vehicle = moving()
    a, q = ask(vehicle, "ATTITUDE"), ask(vehicle, "ATTITUDE_QUATERNION")
    cr, sr, cp, sp = cos(a.roll / 2), sin(a.roll / 2), cos(a.pitch / 2), sin(a.pitch / 2)
    assert wrap_angle(a.yaw - yaw_of((q.q1, q.q2, q.q3, q.q4))) == pytest.approx(0, abs=1e-5)
    assert abs(q.q1) == pytest.approx(
        abs(cr * cp * cos(a.yaw / 2) + sr * sp * sin(a.yaw / 2)), abs=1e-5
    )
    assert (a.rollspeed, a.pitchspeed, a.yawspeed) == (q.rollspeed, q.pitchspeed, q.yawspeed)


@given(st.floats(-7, 7))
def test_headings_are_0_to_35999_and_never_360(desk, ask, yaw):
    vehicle = desk("rover", yaw=yaw)
    vehicle.run(0.01)
    hdg = ask(vehicle, "GLOBAL_POSITION_INT").hdg
    assert 0 <= hdg < 36000
    assert wrap_angle(hdg / 100 * pi / 180 - yaw) == pytest.approx(0, abs=1e-3)


def test_home_and_origin_are_where_they_should_be(desk, ask):
    vehicle = desk("rover", north=30.0, east=5.0, down=-1.0, yaw=0.5)
    home, origin = ask(vehicle, "HOME_POSITION"), ask(vehicle, "GPS_GLOBAL_ORIGIN")
    assert (home.x, home.y, home.z) == (30.0, 5.0, -1.0)
    assert ORIGIN.from_geodetic(home.latitude * 1e-7, home.longitude * 1e-7) == pytest.approx(
        (30.0, 5.0), abs=0.02
    )
    assert home.altitude == round((ORIGIN.alt_m + 1) * 1e3)
    lat_lon = origin.latitude * 1e-7, origin.longitude * 1e-7
    assert lat_lon == pytest.approx((ORIGIN.lat_deg, ORIGIN.lon_deg), abs=1e-7)


def test_a_vehicle_that_has_run_for_two_months_still_speaks(quad, ask):
    quad.vehicle.now_us = quad.vehicle.telemetry.now_us = 60 * 86_400 * 1_000_000
    assert quad.run(1)
    for name in ("SYSTEM_TIME", "ATTITUDE", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT"):
        assert ask(quad, name).time_boot_ms == quad.vehicle.now_us // 1000 % 2**32


@pytest.mark.parametrize("lon_deg", [180.0, -180.0, 179.9999])
def test_longitudes_stay_on_the_map_at_the_date_line(desk, lon_deg, ask):
    for east in (-100.0, 100.0):
        vehicle = desk("rover", east=east, origin=Origin(0.0, lon_deg))
        vehicle.run(0.01)
        assert abs(ask(vehicle, "GLOBAL_POSITION_INT").lon) <= 180 * 10**7
        assert abs(ask(vehicle, "GPS_RAW_INT").lon) <= 180 * 10**7


STATES = {
    "standing": lambda d: d.run(0.5),
    "flying": lambda d: (d.fly(), d.send(d.target(0xDF8, x=5.0, z=-3.0)), d.run(1)),
    "leaning": lambda d: (
        d.fly(),
        d.send(
            mav.MAVLink_set_attitude_target_message(0, 1, 1, 7, [1.0, 0.0, 0.0, 0.0], 0, 0, 0, 0.5)
        ),
        d.run(0.5),
    ),
}


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
@pytest.mark.parametrize(
    ("stack", "state"),
    [
        *((stack, state) for stack in ("ardupilot", "generic") for state in STATES),
        ("px4", "standing"),
    ],
)
def test_every_message_can_be_made_and_packed_in_every_state(desk, stack, kind, state):
    vehicle = desk(kind, autopilot=stack)
    STATES[state](vehicle)
    telemetry = vehicle.vehicle.telemetry
    missing = {name_of(i) for i in telemetry.ids if not telemetry.request(i)}
    for message_id in telemetry.ids:
        for message in telemetry.request(message_id):
            assert message.get_type() == name_of(message_id)
            assert len(Codec(1).encode([message])) > 12
    targets = {"POSITION_TARGET_LOCAL_NED", "POSITION_TARGET_GLOBAL_INT"}
    without = {
        "standing": {*targets, "ATTITUDE_TARGET"},
        "flying": {"ATTITUDE_TARGET"},
        "leaning": targets,
    }
    assert missing == without[state]


def test_what_is_not_offered_is_not_made(quad):
    telemetry = quad.vehicle.telemetry
    for message_id in (-1, 7, 259, 300, 435, 436, 60_000, 2**40):
        assert not telemetry.offers(message_id)
        assert telemetry.request(message_id) == []
        refused = quad.command(mav.MAV_CMD_REQUEST_MESSAGE, message_id)
        assert refused == mav.MAV_RESULT_FAILED
        refused = quad.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 100_000)
        assert refused == mav.MAV_RESULT_DENIED


def test_odometry_is_the_same_motion_in_body_axes(moving, ask):
    vehicle = moving()
    odometry, k = ask(vehicle, "ODOMETRY"), vehicle.where
    assert (odometry.x, odometry.y, odometry.z) == pytest.approx(k[:3], abs=1e-4)
    body = (odometry.vx, odometry.vy, odometry.vz)
    assert hypot(*body) == pytest.approx(hypot(*k[3:6]), abs=1e-4)
    yaw = yaw_of(k[6:10])  # it is nearly level
    assert body[0] == pytest.approx(k.v_north * cos(yaw) + k.v_east * sin(yaw), abs=0.1)
    assert body[1] == pytest.approx(k.v_east * cos(yaw) - k.v_north * sin(yaw), abs=0.1)
    assert odometry.pose_covariance[0] != odometry.pose_covariance[0]  # NaN: unknown


def test_the_display_agrees_with_the_rest(moving, ask):
    vehicle = moving()
    hud, world = ask(vehicle, "VFR_HUD"), ask(vehicle, "GLOBAL_POSITION_INT")
    assert hud.groundspeed == pytest.approx(hypot(world.vx, world.vy) / 100, abs=0.01)
    assert hud.airspeed == pytest.approx(hypot(world.vx, world.vy, world.vz) / 100, abs=0.01)
    assert hud.climb == pytest.approx(-world.vz / 100, abs=0.01)
    assert hud.alt == pytest.approx(world.alt / 1000, abs=0.01)
    assert hud.heading == pytest.approx(world.hdg / 100, abs=1)
    assert 35 < hud.throttle < 65  # it nearly hovers, and half its thrust is its weight


@pytest.mark.parametrize("yaw", [-0.001, 0.0, 3.14, -3.14, 6.2831])
def test_the_displays_heading_is_0_to_359(desk, ask, yaw):
    assert 0 <= ask(desk("rover", yaw=yaw), "VFR_HUD").heading <= 359


def test_a_rover_in_reverse_has_throttle_too(rover, ask):
    rover.fly()
    for _ in range(20):
        rover.send(rover.target(0x5C7, frame=8, vx=-0.5))
        rover.run(0.1)
    assert rover.where.v_north < -0.4
    assert 10 < ask(rover, "VFR_HUD").throttle <= 100


def test_altitudes_are_above_sea_origin_home_and_ground(desk, ask):
    vehicle = desk(down=-10.0)
    vehicle.command(mav.MAV_CMD_DO_SET_MODE, 1, 4)
    vehicle.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    vehicle.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 3)
    vehicle.run(7)
    m, down = ask(vehicle, "ALTITUDE"), vehicle.where.down
    assert m.altitude_amsl == pytest.approx(ORIGIN.alt_m - down, abs=1e-3)
    assert m.altitude_local == pytest.approx(-down, abs=1e-3)
    for height in (m.altitude_relative, m.altitude_terrain, m.bottom_clearance):
        assert height == pytest.approx(-10.0 - down, abs=1e-3)
        assert height == pytest.approx(3.0, abs=0.3)
    terrain = ask(vehicle, "TERRAIN_REPORT")
    assert terrain.terrain_height == pytest.approx(ORIGIN.alt_m + 10.0)
    assert terrain.current_height == pytest.approx(m.bottom_clearance)
