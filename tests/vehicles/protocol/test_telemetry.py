"""Telemetry says what the physics has, in MAVLink's units, and clients find what they wait for."""

from math import cos, degrees, hypot, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.transport.frames import Origin, wrap_angle, yaw_of
from mavherd.transport.mavlink import mav
from mavherd.vehicles.config import SIMULATED_EPOCH_US

ORIGIN = Origin()


def ask(desk, name):
    message_id = getattr(mav, f"MAVLINK_MSG_ID_{name}")
    (_, message) = desk.ask(mav.MAV_CMD_REQUEST_MESSAGE, message_id)
    return message


def moving(desk, kind="quadcopter"):
    vehicle = desk(kind, north=40.0, east=-30.0, down=-2.0, yaw=0.4, system_id=7)
    assert vehicle.command(mav.MAV_CMD_DO_SET_MODE, 1, vehicle.guided) == 0
    vehicle.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    if kind == "quadcopter":
        vehicle.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 3)
        vehicle.run(7)
    for _ in range(20):
        vehicle.send(vehicle.target(0xDC7, vx=1.0, vy=1.5, vz=-0.3))
        vehicle.run(0.1)
    return vehicle


def test_system_time_is_the_epoch_plus_simulated_time(quad):
    for seconds in (0.5, 2.0):
        quad.run(seconds)
        m = ask(quad, "SYSTEM_TIME")
        assert m.time_unix_usec == SIMULATED_EPOCH_US + quad.vehicle.now_us
        assert m.time_boot_ms == round(quad.now * 1000)
        assert ask(quad, "GPS_RAW_INT").time_usec == m.time_unix_usec


def test_the_epoch_can_be_the_wall_clocks(desk):
    vehicle = desk(epoch_us=1_800_000_000_000_000)
    vehicle.run(1)
    assert ask(vehicle, "SYSTEM_TIME").time_unix_usec == 1_800_000_001_000_000


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_local_position_is_the_physics(desk, kind):
    vehicle = moving(desk, kind)
    m, k = ask(vehicle, "LOCAL_POSITION_NED"), vehicle.where
    assert (m.x, m.y, m.z, m.vx, m.vy, m.vz) == pytest.approx(k[:6], abs=1e-4)
    assert hypot(m.vx, m.vy) > 0.8


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_global_position_agrees_with_local_position(desk, kind):
    vehicle = moving(desk, kind)
    local, world = ask(vehicle, "LOCAL_POSITION_NED"), ask(vehicle, "GLOBAL_POSITION_INT")
    north, east = ORIGIN.from_geodetic(world.lat * 1e-7, world.lon * 1e-7)
    assert (north, east) == pytest.approx((local.x, local.y), abs=0.02)
    assert world.alt == pytest.approx((ORIGIN.alt_m - local.z) * 1e3, abs=1)
    assert world.relative_alt == pytest.approx((-2.0 - local.z) * 1e3, abs=1)
    speeds = world.vx, world.vy, world.vz
    assert speeds == pytest.approx((local.vx * 100, local.vy * 100, local.vz * 100), abs=0.6)
    yaw = degrees(yaw_of(vehicle.where[6:10])) % 360
    assert world.hdg == pytest.approx(yaw * 100, abs=1)


def test_gps_agrees_with_global_position(desk):
    vehicle = moving(desk)
    gps, world = ask(vehicle, "GPS_RAW_INT"), ask(vehicle, "GLOBAL_POSITION_INT")
    assert (gps.lat, gps.lon, gps.alt) == (world.lat, world.lon, world.alt)
    assert gps.fix_type == mav.GPS_FIX_TYPE_3D_FIX
    assert gps.vel == pytest.approx(hypot(world.vx, world.vy), abs=1)
    course = gps.cog / 100 * pi / 180
    assert gps.vel * cos(course) == pytest.approx(world.vx, abs=1)
    assert gps.vel * sin(course) == pytest.approx(world.vy, abs=1)


def test_both_attitudes_agree(desk):
    vehicle = moving(desk)
    a, q = ask(vehicle, "ATTITUDE"), ask(vehicle, "ATTITUDE_QUATERNION")
    cr, sr, cp, sp = cos(a.roll / 2), sin(a.roll / 2), cos(a.pitch / 2), sin(a.pitch / 2)
    assert wrap_angle(a.yaw - yaw_of((q.q1, q.q2, q.q3, q.q4))) == pytest.approx(0, abs=1e-5)
    assert abs(q.q1) == pytest.approx(
        abs(cr * cp * cos(a.yaw / 2) + sr * sp * sin(a.yaw / 2)), abs=1e-5
    )
    assert (a.rollspeed, a.pitchspeed, a.yawspeed) == (q.rollspeed, q.pitchspeed, q.yawspeed)


@given(st.floats(-7, 7))
def test_headings_are_0_to_35999_and_never_360(desk, yaw):
    vehicle = desk("rover", yaw=yaw)
    vehicle.run(0.01)
    hdg = ask(vehicle, "GLOBAL_POSITION_INT").hdg
    assert 0 <= hdg < 36000
    assert wrap_angle(hdg / 100 * pi / 180 - yaw) == pytest.approx(0, abs=1e-3)


def test_home_and_origin_are_where_they_should_be(desk):
    vehicle = desk("rover", north=30.0, east=5.0, down=-1.0, yaw=0.5)
    home, origin = ask(vehicle, "HOME_POSITION"), ask(vehicle, "GPS_GLOBAL_ORIGIN")
    assert (home.x, home.y, home.z) == (30.0, 5.0, -1.0)
    assert ORIGIN.from_geodetic(home.latitude * 1e-7, home.longitude * 1e-7) == pytest.approx(
        (30.0, 5.0), abs=0.02
    )
    assert home.altitude == round((ORIGIN.alt_m + 1) * 1e3)
    lat_lon = origin.latitude * 1e-7, origin.longitude * 1e-7
    assert lat_lon == pytest.approx((ORIGIN.lat_deg, ORIGIN.lon_deg), abs=1e-7)


def test_the_prearm_bit_tells_whether_arming_would_work(quad):
    bit = mav.MAV_SYS_STATUS_PREARM_CHECK
    assert ask(quad, "SYS_STATUS").onboard_control_sensors_health & bit
    quad.command(mav.MAV_CMD_DO_SET_MODE, 1, 6)  # RTL
    assert not ask(quad, "SYS_STATUS").onboard_control_sensors_health & bit
    assert ask(quad, "SYS_STATUS").onboard_control_sensors_enabled & bit


def test_health_is_what_mavsdk_waits_for(quad):
    m = ask(quad, "SYS_STATUS")
    for bit in (1, 2, 4, 0x20):  # gyro, accelerometer, magnetometer, GPS
        assert m.onboard_control_sensors_present & m.onboard_control_sensors_health & bit


def test_the_heartbeat_says_what_it_is(desk):
    for kind, mav_type in (("quadcopter", 2), ("rover", 10)):
        m = ask(desk(kind), "HEARTBEAT")
        assert (m.type, m.autopilot, m.base_mode) == (mav_type, 3, 1)
        assert m.system_status == mav.MAV_STATE_STANDBY


def test_the_version_promises_only_what_is_there(quad):
    m = ask(quad, "AUTOPILOT_VERSION")
    assert m.flight_sw_version >> 16 == 4 << 8 | 6
    for bit in (8192, 8, 128, 256):  # MAVLink 2, COMMAND_INT, local and global targets
        assert m.capabilities & bit
    for bit in (4, 32, 16384, 32768):  # missions, FTP, fences and rally points
        assert not m.capabilities & bit


def test_a_vehicle_that_has_run_for_two_months_still_speaks(quad):
    quad.vehicle.now_us = quad.vehicle.telemetry.now_us = 60 * 86_400 * 1_000_000
    assert quad.run(1)
    for name in ("SYSTEM_TIME", "ATTITUDE", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT"):
        assert ask(quad, name).time_boot_ms == quad.vehicle.now_us // 1000 % 2**32


@pytest.mark.parametrize("lon_deg", [180.0, -180.0, 179.9999])
def test_longitudes_stay_on_the_map_at_the_date_line(desk, lon_deg):
    for east in (-100.0, 100.0):
        vehicle = desk("rover", east=east, origin=Origin(0.0, lon_deg))
        vehicle.run(0.01)
        assert abs(ask(vehicle, "GLOBAL_POSITION_INT").lon) <= 180 * 10**7
        assert abs(ask(vehicle, "GPS_RAW_INT").lon) <= 180 * 10**7
