"""A mission is the script's own: its next order ends it. AUTO that a pilot has chosen is his."""

from math import dist, hypot

import pytest

from mavherd.gcs.script import Refused, TakenOver, TimedOut
from mavherd.transport.mavlink import mav
from mavherd.vehicles.flight.modes import Mode

ALL = pytest.mark.parametrize("autopilot", ["ardupilot", "px4", "generic"])
AUTO, LOITER = 3, 5  # custom modes of ArduCopter
FAR = [(40, 0, 3), (80, 0, 3)]


def on_a_mission(desk_of, name="quad1", autopilot="ardupilot", timeout=5.0):
    fleet, desk = desk_of(name, autopilot=autopilot)
    vehicle = fleet[name]
    vehicle.arm()
    if name == "quad1":
        vehicle.takeoff(up=3)
    with pytest.raises(TimedOut):
        vehicle.mission(FAR, timeout=timeout)
    return fleet, desk, vehicle


def set_mode(desk, mode):
    desk.pilot("quad1", mav.MAV_CMD_DO_SET_MODE, 1, mode)


def targets(desk):
    return [t for t, m in desk.sent["quad1"] if "POSITION_TARGET" in m.get_type()]


@ALL
@pytest.mark.parametrize("name", ["quad1", "rover1"])
def test_hold_ends_a_mission_that_takes_too_long(desk_of, autopilot, name):
    fleet, _, vehicle = on_a_mission(desk_of, name, autopilot)
    assert vehicle.mode in ("AUTO", "MISSION")
    assert hypot(*vehicle.state.velocity) > 0.4
    vehicle.hold()
    fleet.sleep(6)
    vehicle.wait_arrival()
    assert vehicle.mode in ("GUIDED", "OFFBOARD")
    assert hypot(*vehicle.state.velocity) < 0.05
    assert not [e for e in fleet.events if "ailsafe" in e.text]
    vehicle.goto(east=1, north=1)


@ALL
def test_other_orders_end_it_as_well(desk_of, autopilot):
    fleet, _, quad = on_a_mission(desk_of, autopilot=autopilot)
    quad.goto(east=2, north=1, up=3)
    assert dist(quad.position, (2, 1, 3)) < 0.2
    with pytest.raises(TimedOut):
        quad.mission(FAR, timeout=3)
    quad.follow(lambda t: ((2, 0.3 * t, 3), (0, 0.3, 0)))
    fleet.sleep(12)
    assert quad.state.velocity == pytest.approx((0, 0.3, 0), abs=0.1)
    with pytest.raises(TimedOut):
        quad.mission(FAR, timeout=3)
    quad.mission([(2, 2, 3)])  # another one
    assert dist(quad.position, (2, 2, 3)) < 0.2


@ALL
def test_orders_in_quick_succession_end_it_as_well(desk_of, autopilot):
    fleet, _, quad = on_a_mission(desk_of, autopilot=autopilot)
    for _ in range(60):
        quad.velocity(north=0.5)
        fleet.sleep(0.1)
    assert quad.state.velocity == pytest.approx((0, 0.5, 0), abs=0.1)


@ALL
@pytest.mark.parametrize("name", ["quad1", "rover1"])
def test_land_ends_it(desk_of, autopilot, name):
    _, _, vehicle = on_a_mission(desk_of, name, autopilot)
    vehicle.land()
    assert not vehicle.armed
    assert vehicle.position.east < 20


@pytest.mark.parametrize("timeout", [0.05 * n for n in range(1, 31)])
def test_a_mission_that_is_just_about_to_begin_is_ended_too(desk_of, timeout):
    fleet, _, quad = on_a_mission(desk_of, timeout=timeout)
    quad.hold()
    fleet.sleep(5)
    assert quad.arrived
    assert quad.mode == "GUIDED"
    assert hypot(*quad.state.velocity) < 0.05


def test_a_mission_is_ended_though_a_yes_gets_lost(desk_of):
    fleet, desk, quad = on_a_mission(desk_of)
    desk.silent.add("quad1")
    desk.at[fleet.time + 1.2] = desk.silent.clear
    quad.hold()
    fleet.sleep(6)
    assert quad.arrived
    assert quad.mode == "GUIDED"


def test_a_pilot_who_ends_the_mission_keeps_the_vehicle(desk_of):
    fleet, desk, quad = on_a_mission(desk_of)
    set_mode(desk, LOITER)
    fleet.sleep(4)
    for mode in (LOITER, AUTO):  # it is his mission now
        set_mode(desk, mode)
        fleet.sleep(2)
        with pytest.raises(TakenOver, match="not under command"):
            quad.hold()
    assert quad.mode == "AUTO"


def test_a_pilot_who_takes_over_while_it_is_recalled_keeps_it(desk_of):
    fleet, desk, quad = on_a_mission(desk_of, autopilot="px4")
    desk.at[fleet.time + 0.5] = lambda: set_mode(desk, 3)  # PX4: position control
    with pytest.raises(TakenOver, match=r"left MISSION for .*arm\(\) takes it back"):
        quad.goto(east=0, north=0)
    assert quad.mode not in ("OFFBOARD", "MISSION")


def test_a_mission_that_a_pilot_starts_is_his(desk_of):
    fleet, desk, quad = on_a_mission(desk_of)
    quad.goto(east=4, north=0)
    set_mode(desk, AUTO)
    fleet.sleep(2)
    with pytest.raises(TakenOver, match="is in AUTO, not under command"):
        quad.hold()
    assert quad.mode == "AUTO"


def test_so_is_one_after_the_script_has_armed_anew(desk_of):
    fleet, desk, quad = on_a_mission(desk_of)
    quad.arm()
    set_mode(desk, AUTO)
    fleet.sleep(2)
    with pytest.raises((Refused, TakenOver), match="is in AUTO, not under command"):
        quad.hold()


def test_a_mission_that_px4_does_not_like_leaves_it_to_the_script(desk_of):
    fleet, desk = desk_of("quad1", autopilot="px4")
    quad = fleet["quad1"]
    quad.arm()
    quad.takeoff(up=3)
    station = desk.core.members["quad1"].station
    asked = station.set_mode
    station.set_mode = lambda mode, now: asked(Mode.HOLD if mode is Mode.AUTO else mode, now)
    with pytest.raises(TimedOut):
        quad.mission(FAR, timeout=6)
    assert quad.mode == "HOLD"
    quad.goto(east=1, north=1)


def test_after_a_mission_that_was_broken_off_the_next_begins_at_its_beginning(desk_of):
    _, desk, quad = on_a_mission(desk_of)
    quad.hold()
    quad.mission([(2, 1, 3), (2, 2, 3)])
    quad.mission([(2, 1, 3), (2, 2, 3)])
    kinds = [m.get_type() for _, m in desk.sent["quad1"]]
    of_interest = [k for k in kinds if k in ("MISSION_COUNT", "MISSION_CLEAR_ALL")]
    assert of_interest == ["MISSION_COUNT", "MISSION_CLEAR_ALL", "MISSION_COUNT", "MISSION_COUNT"]
