"""Home is where the vehicle was armed, or where the user has set it; everybody is told at once."""

from math import hypot, nan

import pytest

from mavherd.transport.frames import yaw_of
from mavherd.transport.mavlink import mav

ACCEPTED, DENIED = 0, 2
ARM, SET_HOME, RTL = 400, 179, 20
POSITION, VELOCITY = 0xDF8, 0xDC7
AMSL, ABOVE_HOME = 0, 3


def home(desk):
    (_, message) = desk.ask(mav.MAV_CMD_GET_HOME_POSITION)
    return message


def set_home(desk, north, east, up, frame=AMSL, sent_as="int"):
    """Ask for a home at a place, `up` metres above the sea or above home."""
    lat_deg, lon_deg = desk.autopilot.origin.to_geodetic(north, east)
    if sent_as == "int":
        place = (round(lat_deg * 1e7), round(lon_deg * 1e7), up)
    else:
        place = (lat_deg, lon_deg, up)
    return desk.command(SET_HOME, 0, 0, 0, 0, *place, sent_as=sent_as, frame=frame)


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_home_is_where_it_was_armed(desk, kind):
    vehicle = desk(kind, north=12.0, east=-7.0, down=-3.0, yaw=1.0)
    if kind == "rover":
        vehicle.fly()
        vehicle.stream(vehicle.target(VELOCITY, vx=1.0), 5)
        vehicle.command(ARM, 0)
        vehicle.run(5)
    k = vehicle.where
    vehicle.arm()
    m = home(vehicle)
    assert (m.x, m.y, m.z) == pytest.approx(k[:3], abs=1e-4)
    assert yaw_of(tuple(m.q)) == pytest.approx(yaw_of(k[6:10]), abs=1e-5)


@pytest.mark.parametrize("sent_as", ["long", "int"])
def test_home_goes_to_a_place_and_comes_here(rover, sent_as):
    rover.fly()
    alt = rover.autopilot.origin.alt_m
    assert set_home(rover, 8, -3, alt + 2, sent_as=sent_as) == ACCEPTED
    m = home(rover)
    assert (m.x, m.y, m.z) == pytest.approx((8, -3, -2), abs=2 if sent_as == "long" else 0.02)
    rover.stream(rover.target(VELOCITY, vx=1.0), 3)
    for here in ((1,), (0, 0, 0, 0, 0, 0, 0)):
        assert rover.command(SET_HOME, *here, sent_as=sent_as) == ACCEPTED
        m = home(rover)
        assert (m.x, m.y, m.z) == pytest.approx(rover.where[:3], abs=1e-3)
        rover.stream(rover.target(VELOCITY, vx=1.0), 1)


def test_heights_above_home_count_from_the_old_home(quad):
    assert set_home(quad, 1, 1, 5, frame=ABOVE_HOME) == ACCEPTED
    assert home(quad).z == pytest.approx(-5)
    assert set_home(quad, 1, 1, 5, frame=ABOVE_HOME) == ACCEPTED
    assert home(quad).z == pytest.approx(-10)


@pytest.mark.parametrize("bad", [nan, 91.0, -91.0, 1e30])
def test_no_such_place_is_denied(quad, bad):
    before = quad.autopilot.home
    assert quad.command(SET_HOME, 0, 0, 0, 0, bad, 8.0, 0) == DENIED
    assert quad.command(SET_HOME, 0, 0, 0, 0, 47.0, 8.0, nan) == DENIED
    assert quad.command(SET_HOME, 0, 0, 0, 0, 470000000, 80000000, 0, sent_as="int", frame=1) == 2
    assert quad.autopilot.home == before


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_everybody_hears_of_a_new_home_at_once(desk, kind, of):
    vehicle = desk(kind)
    other = vehicle.vehicle.converse(spoken=True)
    vehicle.run(2.5)
    vehicle.arm()
    assert len(of(vehicle.run(0.01), "HOME_POSITION")) == 1
    vehicle.vehicle.report(other, [])
    set_home(vehicle, 3, 4, 500)
    vehicle.vehicle.step()
    data = vehicle.vehicle.report(other, vehicle.vehicle.take_broadcasts())
    (m,) = of(vehicle.codec.decode(data), "HOME_POSITION")
    assert (m.x, m.y) == pytest.approx((3, 4), abs=0.02)


def test_a_home_that_the_user_has_set_stays_over_arming(rover):
    set_home(rover, 5, 5, rover.autopilot.origin.alt_m)
    rover.fly()
    m = home(rover)
    assert (m.x, m.y) == pytest.approx((5, 5), abs=0.02)
    rover.command(ARM, 0)
    rover.arm()
    assert (home(rover).x, home(rover).y) == pytest.approx((5, 5), abs=0.02)


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_a_return_goes_to_the_home_that_was_set(desk, kind):
    vehicle = desk(kind)
    vehicle.fly()
    set_home(vehicle, 4, -3, vehicle.autopilot.origin.alt_m)
    vehicle.command(RTL)
    vehicle.run(75)
    assert hypot(vehicle.where.north - 4, vehicle.where.east + 3) < 0.3
    assert vehicle.speed < 0.01


def test_the_relative_height_counts_from_home(quad, of):
    quad.fly(3)
    set_home(quad, 0, 0, quad.autopilot.origin.alt_m + 2)
    m = of(quad.run(0.5), "GLOBAL_POSITION_INT")[-1]
    assert m.relative_alt == pytest.approx(1000, abs=200)
    item = mav.MAVLink_mission_request_int_message(1, 1, 0)
    (item,) = quad.send(item)
    assert item.z == pytest.approx(quad.autopilot.origin.alt_m + 2, abs=0.01), "item 0 is home"


def test_home_outlives_modes_but_not_a_reboot(rover):
    set_home(rover, 5, 5, rover.autopilot.origin.alt_m)
    rover.mode("HOLD")
    assert home(rover).x == pytest.approx(5, abs=0.02)
    rover.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1)
    rover.run(0.1)
    assert home(rover).x == pytest.approx(0, abs=0.02)
