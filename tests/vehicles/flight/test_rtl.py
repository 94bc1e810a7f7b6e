"""RTL: a copter climbs, flies home, waits and lands; a rover drives home and stops."""

from math import hypot, inf

import pytest

from mavherd.vehicles.missions.items import Item, MissionType

ACCEPTED = 0
RTL = 20
POSITION = 0xDF8


def off(desk, north, east):
    return hypot(desk.where.north - north, desk.where.east - east)


def away(desk, north=6.0, east=-4.0, height=3.0, **config):
    """A copter that hovers away from home."""
    quad = desk("quadcopter", **config)
    quad.fly(height)
    quad.send(quad.target(POSITION, x=north, y=east, z=-height))
    quad.run(15)
    assert off(quad, north, east) < 0.3
    return quad


def returned(quad):
    """Return home; the track as (time, distance from home, height)."""
    assert quad.command(RTL) == ACCEPTED
    track, start = [], quad.now
    while quad.autopilot.armed and quad.now - start < 180:
        quad.run(0.1)
        track.append((quad.now - start, off(quad, 0, 0), -quad.where.down))
    return track


def test_a_return_climbs_flies_home_waits_lands_and_disarms(desk):
    quad = away(desk)
    track = returned(quad)
    assert not quad.autopilot.armed
    assert quad.where[:3] == pytest.approx((0, 0, 0), abs=0.3)
    assert quad.autopilot.mode.name == "RTL", "as ArduPilot shows it to the end"
    assert max(height for _, _, height in track) == pytest.approx(15, abs=0.5)  # RTL_ALT
    assert min(h for _, distance, h in track if 0.5 < distance < 5) > 14, "climb first"
    above_home = [t for t, distance, height in track if distance < 0.5 and height > 14.5]
    assert above_home[-1] - above_home[0] > 5, "RTL_LOIT_TIME"


def test_a_return_from_above_does_not_come_down_first(desk):
    quad = away(desk, 5, 0, height=20)
    track = returned(quad)
    assert min(height for _, distance, height in track if distance > 0.5) > 19


@pytest.mark.parametrize(
    ("params", "top"),
    [
        ({"RTL_ALT": 800}, 8),
        ({"RTL_ALT": 0}, 3),
        ({"RTL_ALT": 0, "RTL_CLIMB_MIN": 400}, 7),
    ],
)
def test_the_height_of_a_return_obeys_its_parameters(desk, params, top):
    quad = away(desk, params=params)
    track = returned(quad)
    assert max(height for _, _, height in track) == pytest.approx(top, abs=0.5)


def test_a_return_with_a_final_height_stays_there(desk):
    quad = away(desk, params={"RTL_ALT": 800, "RTL_ALT_FINAL": 500, "RTL_LOIT_TIME": 1000})
    quad.command(RTL)
    quad.run(40)
    assert quad.where[:3] == pytest.approx((0, 0, -5), abs=0.3)
    assert quad.autopilot.armed


def test_a_return_keeps_its_speed(desk):
    quad = away(desk, 12, 0, params={"RTL_SPEED": 80, "RTL_ALT": 0})
    quad.command(RTL)
    fastest = 0.0
    for _ in range(100):
        quad.run(0.1)
        fastest = max(fastest, abs(quad.where.v_north))
    assert fastest == pytest.approx(0.8, abs=0.12)


def test_a_return_on_the_ground_stays_there(quad):
    quad.mode("GUIDED")
    quad.arm()
    quad.command(RTL)
    quad.run(11)
    assert quad.where[:3] == (0, 0, 0)
    assert not quad.autopilot.armed


def test_a_return_can_be_called_off(desk):
    quad = away(desk)
    quad.command(RTL)
    quad.run(4)
    quad.mode("GUIDED")
    quad.send(quad.target(POSITION, x=8, z=-6))
    quad.run(15)
    assert quad.where[:3] == pytest.approx((8, 0, -6), abs=0.2)


def test_a_rover_returns_home_and_stops(rover, texts):
    rover.fly()
    rover.send(rover.target(POSITION, x=4, y=3))
    rover.run(20)
    assert off(rover, 4, 3) < 0.3
    assert rover.command(RTL) == ACCEPTED
    nearest, said = inf, []
    for _ in range(100):
        said += texts(rover.run(0.25))
        nearest = min(nearest, off(rover, 0, 0))
    assert nearest < 0.3
    assert off(rover, 0, 0) < 0.3
    assert rover.autopilot.armed
    assert rover.speed < 0.01
    assert rover.autopilot.mode.name == "RTL", "as ArduRover shows it to the end"
    assert said == ["Reached destination"]


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_px4_returns_too(desk, kind):
    vehicle = desk(kind, autopilot="px4")
    place = vehicle.target(POSITION, x=4, z=-3)
    vehicle.stream(place, 0.5)
    vehicle.mode("OFFBOARD")
    vehicle.arm()
    vehicle.stream(place, 12)
    assert off(vehicle, 4, 0) < 0.3
    assert vehicle.command(RTL) == ACCEPTED
    vehicle.run(90)
    assert off(vehicle, 0, 0) < 0.3
    assert vehicle.speed < 0.01


def rally(desk, *places):
    """Have these places (north, east) as the vehicle's rally points."""
    items = []
    for north, east in places:
        lat_deg, lon_deg = desk.autopilot.origin.to_geodetic(north, east)
        items.append(Item(5100, 3, x=round(lat_deg * 1e7), y=round(lon_deg * 1e7), z=20))
    desk.vehicle.missions.replace(MissionType.RALLY, items)


@pytest.mark.parametrize(
    ("params", "end"),
    [
        ({}, (10, 0)),
        ({"RALLY_LIMIT_KM": 0.003}, (0, 0)),
        ({"RALLY_INCL_HOME": 0}, (10, 0)),
        ({"RALLY_INCL_HOME": 0, "RALLY_LIMIT_KM": 0.001}, (0, 0)),
    ],
)
def test_a_return_goes_to_the_nearest_rally_point_that_counts(desk, params, end):
    quad = away(desk, 6, 0, params={"RTL_LOIT_TIME": 0, **params})
    rally(quad, (30, 0), (10, 0))
    returned(quad)
    assert quad.where[:2] == pytest.approx(end, abs=0.3)


def test_home_is_a_rally_point_only_where_it_is_said(desk):
    for params, end in (({}, (0, 0)), ({"RALLY_INCL_HOME": 0}, (14, 0))):
        rover = desk("rover", params=params)
        rover.fly()
        rover.send(rover.target(POSITION, x=5.0))
        rover.run(10)
        rally(rover, (14, 0))
        assert rover.command(RTL) == ACCEPTED
        rover.run(30)
        assert rover.where[:2] == pytest.approx(end, abs=0.3)
