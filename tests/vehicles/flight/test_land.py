"""LAND comes down where it was ordered, fast and then slowly, and disarms."""

from math import hypot

import pytest

from mavherd.transport.mavlink import mav

ACCEPTED = 0
LAND = 21
POSITION, VELOCITY = 0xDF8, 0xDC7


def test_a_landing_comes_down_where_it_was_ordered(quad):
    quad.fly()
    quad.stream(quad.target(VELOCITY, vx=1.0, vy=1.0), 3)
    k = quad.where
    quad.command(LAND)
    quad.run(15)
    assert not quad.autopilot.armed
    assert hypot(quad.where.north - k.north, quad.where.east - k.east) < 1.0


def test_a_landing_is_fast_above_ten_metres_and_slow_below(quad):
    quad.fly(25)
    quad.command(LAND)
    fast, slow = [], []
    while quad.autopilot.armed and quad.now < 120:
        quad.run(0.1)
        height = -quad.where.down
        if 12 < height < 22:
            fast.append(quad.where.v_down)
        elif 1 < height < 8:
            slow.append(quad.where.v_down)
    limit = quad.vehicle.robot.limits.descent
    assert fast
    assert max(fast) == pytest.approx(limit, abs=0.3)
    assert slow
    assert max(slow) < 0.75
    assert sum(slow) / len(slow) == pytest.approx(0.5, abs=0.1)  # LAND_SPEED


def test_a_landing_obeys_its_parameters(desk):
    quad = desk("quadcopter", params={"LAND_SPEED": 30, "LAND_SPEED_HIGH": 80, "LAND_ALT_LOW": 500})
    quad.fly(12)
    quad.command(LAND)
    quad.run(5)
    assert quad.where.down < -6
    assert quad.where.v_down == pytest.approx(0.8, abs=0.1)
    while quad.where.down < -2:
        quad.run(0.1)
    assert quad.where.v_down == pytest.approx(0.3, abs=0.1)


def test_a_landed_copter_says_so_disarms_and_flies_again(quad, of):
    for _ in range(2):
        quad.fly(2)
        assert quad.command(LAND) == ACCEPTED
        states = [m.landed_state for m in of(quad.run(9), "EXTENDED_SYS_STATE")]
        assert mav.MAV_LANDED_STATE_LANDING in states
        assert states[-1] == mav.MAV_LANDED_STATE_ON_GROUND
        assert not quad.autopilot.armed


def test_a_landing_on_the_ground_stays_there_and_disarms(quad):
    quad.mode("GUIDED")
    quad.arm()
    quad.command(LAND)
    quad.run(11)
    assert quad.where[:3] == (0, 0, 0)
    assert not quad.autopilot.armed


def test_targets_do_not_disturb_a_landing(quad):
    quad.fly(4)
    quad.command(LAND)
    quad.stream(quad.target(POSITION, x=20, z=-10), 11)
    assert not quad.autopilot.armed
    assert hypot(quad.where.north, quad.where.east) < 0.2


def test_a_copter_flown_into_the_ground_stays_there_and_disarms(quad):
    quad.fly(2)
    quad.stream(quad.target(VELOCITY, vz=0.7), 5)
    assert not quad.autopilot.in_air
    quad.run(10.5)
    assert not quad.autopilot.armed


def test_a_landing_that_is_called_off_stays_where_it_is(quad):
    quad.fly(8)
    quad.command(LAND)
    quad.run(4)
    height = -quad.where.down
    assert 2 < height < 7.5
    quad.mode("GUIDED")
    quad.run(5)
    assert quad.speed < 0.05
    assert -quad.where.down == pytest.approx(height, abs=0.6)
