"""What cannot be had is said at once, with vehicle, reason and cure; a pilot always wins."""

import pytest

from mavherd.gcs.script import FleetError, LinkLost, Refused, TakenOver, TimedOut
from mavherd.scenarios.schema import Fence
from mavherd.transport.mavlink import mav

RTL, LAND = 6, 9  # custom modes of ArduCopter


def guided(fleet, up=2):
    quad = fleet["quad1"]
    quad.arm()
    quad.takeoff(up=up)
    return quad


def set_mode(desk, mode):
    desk.pilot("quad1", mav.MAV_CMD_DO_SET_MODE, 1, mode)


@pytest.mark.parametrize(
    ("order", "why"),
    [
        (lambda quad: quad.goto(east=1, north=1), r"not armed \(call arm\(\) first\)"),
        (lambda quad: quad.takeoff(up=2), r"not armed \(call arm\(\) first\)"),
        (lambda quad: quad.velocity(east=1), r"not armed"),
        (lambda quad: quad.hold(), r"not armed"),
        (lambda quad: quad.follow(lambda t: ((0, 0, 2), (0, 0, 0))), r"not armed"),
        (lambda quad: quad.mission([(0, 0, 3)]), r"not armed"),
    ],
)
def test_before_arming_nothing_moves(desk_of, order, why):
    fleet, _ = desk_of("quad1")
    with pytest.raises(Refused, match=f"quad1: is {why}"):
        order(fleet["quad1"])


def test_on_the_ground_nothing_flies(desk_of):
    fleet, _ = desk_of("quad1")
    fleet["quad1"].arm()
    with pytest.raises(Refused, match=r"stands on the ground \(call takeoff\(up=...\) first\)"):
        fleet["quad1"].goto(east=1, north=1)


@pytest.mark.parametrize(
    "order",
    [
        lambda quad: quad.goto(east=11, north=0, up=3),
        lambda quad: quad.goto(east=1, north=0, up=8.5),
        lambda quad: quad.mission([(1, 0, 3), (1, -7, 3)]),
    ],
)
def test_what_lies_outside_the_fence_is_refused(desk_of, order):
    fence = Fence(east=(-10, 10), north=(-6, 6), up=8)
    fleet, _ = desk_of("quad1", fence=fence)
    quad = fleet["quad1"]
    quad.arm()
    with pytest.raises(Refused, match="up 20 is outside the fence"):
        quad.takeoff(up=20)
    quad.takeoff(up=3)
    with pytest.raises(Refused, match=r"is outside the fence \(east -10 to 10, north -6 to 6, up"):
        order(quad)
    quad.velocity(east=2)
    fleet.sleep(15)
    assert 8 < quad.position.east < 10  # braked before it
    quad.goto(east=1, north=1)


def test_takeoff_goes_up(desk_of):
    fleet, _ = desk_of("quad1")
    fleet["quad1"].arm()
    with pytest.raises(Refused, match=r"up=0.3 is no height to take off to, it stands at 0.0"):
        fleet["quad1"].takeoff(up=0.3)


def test_a_rover_does_not_take_off(desk_of):
    fleet, _ = desk_of("rover1")
    fleet["rover1"].arm()
    with pytest.raises(Refused, match="rover1: a rover cannot take off"):
        fleet["rover1"].takeoff(up=2)


def test_a_vehicle_that_will_not_arm_says_why(desk_of):
    fleet, desk = desk_of("quad1")
    quad = fleet["quad1"]
    quad.param["FENCE_ENABLE"] = 1
    quad.param["FENCE_RADIUS"] = 30
    quad.param["FENCE_MARGIN"] = 40
    began = fleet.time
    with pytest.raises(Refused, match=r"quad1: arming refused.*FENCE_MARGIN"):
        quad.arm(timeout=4)
    assert 4 <= fleet.time - began < 8
    desk.core.members["quad1"].station.parameters.write("FENCE_MARGIN", 2, fleet.time)
    quad.arm()  # it is asked anew
    assert quad.armed


def test_waiting_ends_with_where_it_is(desk_of):
    fleet, _ = desk_of("quad1")
    quad = guided(fleet)
    began = fleet.time
    with pytest.raises(TimedOut, match=r"quad1: goto: not done after 2 s .* armed, in GUIDED"):
        quad.goto(east=30, north=0, timeout=2)
    assert fleet.time - began == pytest.approx(2, abs=0.2)
    with pytest.raises(TimedOut, match="within 1 s"):
        fleet.wait(lambda: False, timeout=1)
    with pytest.raises(TimedOut, match="wait for mode LAND"):
        quad.wait_mode("LAND", timeout=1)


@pytest.mark.parametrize("wait", [True, False])
def test_a_pilot_who_changes_the_mode_wins(desk_of, wait):
    fleet, desk = desk_of("quad1")
    quad = guided(fleet, up=4)
    desk.at[fleet.time + 1] = lambda: set_mode(desk, LAND)
    quad.goto(east=20, north=0, wait=False)
    fleet.sleep(0 if wait else 3)
    with pytest.raises(TakenOver, match=r"quad1: left GUIDED for LAND at .*arm\(\) takes it back"):
        quad.wait_arrival()
    assert quad.mode == "LAND"
    fleet.sleep(1)
    assert quad.mode == "LAND"  # nobody has argued
    with pytest.raises(TakenOver, match=r"is in LAND, not under command \(arm\(\) takes it back"):
        quad.goto(east=1, north=1)


def test_a_pilot_who_stops_a_takeoff_wins(desk_of):
    fleet, desk = desk_of("quad1")
    quad = fleet["quad1"]
    quad.arm()
    desk.at[fleet.time + 2] = lambda: set_mode(desk, RTL)
    with pytest.raises(TakenOver, match=r"left GUIDED for RTL at .*arm\(\) takes it back"):
        quad.takeoff(up=5)
    assert quad.mode == "RTL"


def test_arm_takes_it_back(desk_of):
    fleet, desk = desk_of("quad1")
    quad = guided(fleet, up=4)
    set_mode(desk, RTL)
    with pytest.raises(TakenOver):
        quad.goto(east=3, north=0)
    quad.arm()
    assert quad.mode == "GUIDED"
    quad.goto(east=2, north=0)


def test_a_pilot_who_stops_a_landing_wins(desk_of):
    fleet, desk = desk_of("quad1")
    quad = guided(fleet, up=4)
    desk.at[fleet.time + 2] = lambda: set_mode(desk, RTL)
    with pytest.raises(TakenOver, match="left LAND for RTL"):
        quad.land()
    assert quad.mode == "RTL"


def test_a_pilot_who_stops_a_mission_wins(desk_of):
    fleet, desk = desk_of("quad1")
    quad = guided(fleet, up=4)
    desk.at[fleet.time + 4] = lambda: set_mode(desk, RTL)
    with pytest.raises(TakenOver, match="left AUTO for RTL in its mission"):
        quad.mission([(20, 0, 4), (40, 0, 4)])
    assert quad.mode == "RTL"


def test_a_vehicle_that_disarms_itself_is_told(desk_of):
    fleet, desk = desk_of("rover1")
    rover = fleet["rover1"]
    rover.arm()
    disarm = mav.MAV_CMD_COMPONENT_ARM_DISARM
    desk.at[fleet.time + 1] = lambda: desk.pilot("rover1", disarm, 0, 21196)
    with pytest.raises(TakenOver, match="rover1: disarmed itself"):
        rover.goto(east=9, north=0)


def test_one_that_disarmed_itself_between_two_orders_says_so_at_the_next(desk_of):
    fleet, _ = desk_of("quad1")
    quad = fleet["quad1"]
    quad.arm()
    fleet.sleep(12)  # longer than it stands armed without taking off
    with pytest.raises(TakenOver, match=r"quad1: disarmed itself at .*arm\(\) takes it back"):
        quad.takeoff(up=2)
    quad.arm()
    quad.takeoff(up=2)


def test_a_group_is_armed_when_all_are_at_one_moment(desk_of):
    fleet, desk = desk_of("quad1", "rover1")
    fleet["quad1"].param["DISARM_DELAY"] = 3
    desk.silent.add("rover1")
    desk.at[desk.now + 6] = lambda: desk.silent.remove("rover1")
    with pytest.raises(TakenOver, match="quad1: disarmed itself at "):
        fleet.all.arm()
    fleet.all.arm()
    assert all(vehicle.armed for vehicle in fleet)


def test_a_silent_link_is_lost(desk_of):
    fleet, desk = desk_of("quad1")
    quad = guided(fleet)
    desk.at[fleet.time + 1] = lambda: desk.silent.add("quad1")
    quad.velocity(east=0.5)
    fleet.sleep(2)
    with pytest.raises(LinkLost, match=r"quad1: goto: nothing heard for 1\d s"):
        quad.goto(east=30, north=0, timeout=60)
    desk.silent.clear()
    quad.goto(east=1, north=0)  # and it is back


def test_those_who_fail_leave_the_others_alone(desk_of):
    fleet, _ = desk_of("quad1", "quad2", "rover1")
    fleet.all.arm()
    fleet.all.takeoff(up=2)
    fleet["quad1"].goto(east=30, north=0, wait=False)
    fleet["quad2"].goto(east=3, north=2, wait=False)
    fleet["rover1"].goto(east=50, north=0, wait=False)
    with pytest.raises(TimedOut, match="quad1: arrival") as caught:
        fleet.all.wait_arrival(timeout=6)
    assert fleet["quad2"].arrived
    assert "also: rover1: arrival: not done" in caught.value.__notes__[0]


def test_a_mission_that_is_refused_leaves_it_in_command(desk_of):
    fleet, _ = desk_of("quad1")
    quad = guided(fleet)
    with pytest.raises(Refused, match="quad1: mission of 1001 items: refused"):
        quad.mission([(0.01 * n, 0, 3) for n in range(1000)])
    quad.goto(east=1, north=1)


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        (lambda quad: quad.wait_mode("LOITR"), "no mode is called 'LOITR' .did you mean 'LOITER'"),
        (lambda quad: quad.wait_message("BATTERY"), "no MAVLink message is called 'BATTERY'"),
        (lambda quad: quad.param["WPNAV_SPED"], "no parameter WPNAV_SPED, or does not answer"),
        (lambda quad: quad.param["A" * 17], "cannot be the name of a parameter"),
    ],
)
def test_unknown_names_are_said(desk_of, wrong, why):
    fleet, _ = desk_of("quad1")
    with pytest.raises(FleetError, match=why):
        wrong(fleet["quad1"])


@pytest.mark.parametrize(
    "wrong",
    [
        lambda quad: quad.goto(east=float("nan"), north=0),
        lambda quad: quad.takeoff(up=float("inf")),
        lambda quad: quad.velocity(east=float("nan")),
        lambda quad: quad.mission([]),
        lambda quad: quad.mission([(0, 0)]),
        lambda quad: quad.mission([(0, float("nan"), 3)]),
        lambda quad: quad.goto(east="4", north="north"),
    ],
)
def test_numbers_that_are_none_never_reach_a_vehicle(desk_of, wrong):
    fleet, _ = desk_of("quad1")
    quad = guided(fleet)
    with pytest.raises(ValueError, match=r"expected|convert"):
        wrong(quad)
    assert quad.arrived  # it still has the order before
