"""A vehicle does what a script says, and the call returns when it is done."""

from math import dist, hypot

import pytest

from mavherd.gcs.script import FleetError
from mavherd.transport.mavlink import mav

ALL = pytest.mark.parametrize("autopilot", ["ardupilot", "px4", "generic"])


def targets(desk, name):
    return [m for _, m in desk.sent[name] if m.get_type() == "SET_POSITION_TARGET_LOCAL_NED"]


@ALL
def test_a_quadcopter_flies_there_and_lands(desk_of, autopilot):
    fleet, _ = desk_of("quad1", autopilot=autopilot)
    quad = fleet["quad1"]
    quad.arm()
    assert quad.armed
    assert quad.mode in ("GUIDED", "OFFBOARD")
    quad.takeoff(up=3)
    assert quad.position.up == pytest.approx(3, abs=0.25)
    quad.goto(east=4, north=4, up=2)
    assert dist(quad.position, (4, 4, 2)) < 0.2
    quad.land()
    assert not quad.armed
    assert quad.position.up == pytest.approx(0, abs=0.05)


@ALL
def test_a_rover_drives_there_and_stops(desk_of, autopilot):
    fleet, _ = desk_of("rover1", autopilot=autopilot)
    rover = fleet["rover1"]
    rover.arm()
    rover.goto(east=3, north=2, up=7)  # it has no height to go to
    assert dist(rover.position, (3, 2, 0)) < 0.2
    rover.land()
    assert not rover.armed
    assert hypot(*rover.state.velocity) < 0.1


@ALL
def test_a_velocity_is_held_until_told_otherwise(desk_of, autopilot):
    fleet, _ = desk_of("quad1", autopilot=autopilot)
    quad = fleet["quad1"]
    quad.arm()
    quad.takeoff(up=2)
    quad.velocity(east=0.6, north=-0.3)
    fleet.sleep(4)
    assert quad.state.velocity == pytest.approx((0.6, -0.3, 0), abs=0.05)
    assert quad.position.up == pytest.approx(2, abs=0.25)
    quad.velocity(up=0.5)
    fleet.sleep(2)
    assert quad.state.velocity == pytest.approx((0, 0, 0.5), abs=0.1)
    quad.hold()
    here = quad.position
    fleet.sleep(4)
    assert dist(quad.position, here) < 0.3
    assert hypot(*quad.state.velocity) < 0.05


def test_a_velocity_that_cannot_be_had_is_not_made_up_for_later(desk_of):
    fleet, _ = desk_of("quad1")
    quad = fleet["quad1"]
    quad.arm()
    quad.takeoff(up=2)
    quad.velocity(east=50)
    fleet.sleep(5)
    quad.velocity(north=0.5)
    fleet.sleep(3)
    assert quad.state.velocity == pytest.approx((0, 0.5, 0), abs=0.05)


def test_a_rover_ignores_a_climb(desk_of):
    fleet, _ = desk_of("rover1")
    rover = fleet["rover1"]
    rover.arm()
    rover.velocity(east=0.3, up=1)
    fleet.sleep(3)
    assert rover.state.velocity == pytest.approx((0.3, 0, 0), abs=0.05)


def test_a_target_that_moves_is_followed(desk_of):
    fleet, _ = desk_of("quad1")
    quad = fleet["quad1"]
    quad.arm()
    quad.takeoff(up=2)
    asked = []

    def path(t):
        asked.append(t)
        return (0.4 * t, 1, 3), (0.4, 0, 0)

    quad.follow(path)
    fleet.sleep(8)
    assert asked[0] == 0
    assert asked[-1] == pytest.approx(8, abs=0.06)
    assert dist(quad.position, (0.4 * asked[-1], 1, 3)) < 0.15


def test_a_path_that_raises_stops_the_vehicle_and_the_script(desk_of):
    fleet, _ = desk_of("quad1")
    quad = fleet["quad1"]
    quad.arm()
    quad.takeoff(up=2)
    quad.follow(lambda t: ((t, 0, 2), (1, 0, 0)) if t < 1 else 1 / 0)
    with pytest.raises(ZeroDivisionError) as caught:
        fleet.sleep(5)
    assert "in the path that quad1 follows" in caught.value.__notes__[0]
    here = quad.position
    fleet.sleep(5)  # only once
    assert dist(quad.position, here) < 0.7
    assert hypot(*quad.state.velocity) < 0.05


def test_without_a_height_it_keeps_its_own(desk_of):
    fleet, _ = desk_of("quad1")
    quad = fleet["quad1"]
    quad.arm()
    quad.takeoff(up=2.5)
    quad.goto(east=2, north=0)
    assert quad.position.up == pytest.approx(2.5, abs=0.25)


def test_takeoff_in_the_air_is_a_climb(desk_of):
    fleet, desk = desk_of("quad1")
    quad = fleet["quad1"]
    quad.arm()
    quad.takeoff(up=2)
    quad.takeoff(up=4)
    assert quad.position.up == pytest.approx(4, abs=0.2)
    asked = [
        m for _, m in desk.sent["quad1"] if getattr(m, "command", 0) == mav.MAV_CMD_NAV_TAKEOFF
    ]
    assert len(asked) == 1


@ALL
def test_it_takes_off_again_after_landing(desk_of, autopilot):
    fleet, _ = desk_of("quad1", autopilot=autopilot)
    quad = fleet["quad1"]
    for up in (2, 3):
        quad.arm()
        quad.takeoff(up=up)
        assert quad.position.up == pytest.approx(up, abs=0.25)
        quad.land()


@ALL
@pytest.mark.parametrize("name", ["quad1", "rover1"])
def test_a_mission_is_flown_by_the_vehicle_itself(desk_of, autopilot, name):
    fleet, desk = desk_of(name, autopilot=autopilot)
    vehicle = fleet[name]
    vehicle.arm()
    if name == "quad1":
        vehicle.takeoff(up=3)
    seen = []
    desk.core.members[name].station.listen(lambda m, now: seen.append(vehicle.mode))
    vehicle.mission([(5, 0, 3), (5, 5, 3), (0, 5, 4)])
    assert {"AUTO", "MISSION"} & set(seen)
    end = (0, 5, 4) if name == "quad1" else (0, 5, 0)
    assert dist(vehicle.position, end) < 0.2
    assert vehicle.mode in ("GUIDED", "OFFBOARD")
    vehicle.goto(east=1, north=5)  # it is in command again


def test_a_long_mission_goes_up_while_px4_wants_setpoints(desk_of):
    fleet, desk = desk_of("quad1", autopilot="px4")
    quad = fleet["quad1"]
    quad.arm()
    quad.takeoff(up=3)
    began = fleet.time
    quad.mission([(0.5 * i, 0, 3) for i in range(30)])
    times = [t for t, m in desk.sent["quad1"] if "POSITION_TARGET" in m.get_type() and t > began]
    items = [t for t, m in desk.sent["quad1"] if m.get_type() == "MISSION_ITEM_INT"]
    assert items[-1] - items[0] > 1  # longer than COM_OF_LOSS_T
    assert not [e for e in fleet.events if "ailsafe" in e.text]
    assert min(times) < items[0] + 0.2


def test_parameters_are_read_and_set(desk_of):
    fleet, _ = desk_of("quad1")
    quad = fleet["quad1"]
    quad.param["WPNAV_SPEED"] = 300
    assert quad.param["WPNAV_SPEED"] == 300


def test_integers_of_px4_are_numbers_too(desk_of):
    fleet, _ = desk_of("quad1", autopilot="px4")
    quad = fleet["quad1"]
    quad.param["COM_DL_LOSS_T"] = 25
    assert quad.param["COM_DL_LOSS_T"] == 25


def test_a_message_is_waited_for_and_asked_for(desk_of):
    fleet, desk = desk_of("quad1")
    quad = fleet["quad1"]
    assert quad.wait_message("HEARTBEAT")["autopilot"] == mav.MAV_AUTOPILOT_ARDUPILOTMEGA
    version = quad.wait_message("AUTOPILOT_VERSION")  # comes to nobody by itself
    assert version["flight_sw_version"] > 0
    asked = [m.param1 for _, m in desk.sent["quad1"] if getattr(m, "command", 0) == 512]
    assert asked == [mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION]


def test_a_group_begins_together(desk_of):
    fleet, _ = desk_of("quad1", "quad2", "rover1")
    fleet.all.arm()
    fleet.all.takeoff(up=2)  # the rover stays
    one_alone = fleet.time
    assert one_alone < 5
    fleet["quad1", "rover1"].velocity(north=0.4)
    fleet.sleep(3)
    assert [v.state.velocity.north > 0.3 for v in fleet] == [True, False, True]
    fleet.all.hold()
    for vehicle in fleet:
        vehicle.goto(east=vehicle.position.east, north=3, wait=False)
        assert not vehicle.arrived
    fleet.all.wait_arrival()
    assert all(vehicle.arrived for vehicle in fleet)
    assert all(abs(vehicle.position.north - 3) < 0.2 for vehicle in fleet)
    fleet.all.land()
    assert not any(vehicle.armed for vehicle in fleet)


def test_the_safety_filter_stays_on(desk_of):
    fleet, _ = desk_of("quad1", "quad2")
    fleet.all.arm()
    fleet.all.takeoff(up=2)
    fleet["quad1"].goto(east=3, north=0, wait=False)  # where the other one stands
    nearest = 9.0
    for _ in range(20):
        fleet.sleep(0.5)
        nearest = min(nearest, dist(*(v.position for v in fleet)))
    assert nearest > 0.4  # contact distance
    assert fleet["quad1"].position.east > 1


def test_law_off_sends_the_place_itself(desk_of):
    fleet, desk = desk_of("quad1", law="off")
    quad = fleet["quad1"]
    quad.arm()
    quad.takeoff(up=2)
    quad.goto(east=2, north=1, up=3)
    last = targets(desk, "quad1")[-1]
    assert (last.x, last.y, last.z) == pytest.approx((1, 2, -3))


def test_vehicles_are_found_by_name_and_system_id(desk_of):
    fleet, _ = desk_of("quad1", "rover1")
    assert len(fleet) == 2
    assert fleet[2] is fleet["rover1"]
    assert [v.name for v in fleet["rover1", 1]] == ["rover1", "quad1"]
    assert [v.name for v in fleet.all] == ["quad1", "rover1"]
    with pytest.raises(FleetError, match=r"no vehicle 'quad2' .*did you mean 'quad1'"):
        fleet["quad2"]
    with pytest.raises(FleetError, match=r"no vehicle 7 .*known: 1, 2"):
        fleet[7]


def test_a_condition_is_waited_for(desk_of):
    fleet, _ = desk_of("quad1")
    fleet.wait(lambda: fleet.time > 1.02)
    assert fleet.time == pytest.approx(1.05)


def test_what_happens_is_told_as_plain_values(desk_of):
    fleet, _ = desk_of("quad1")
    fleet["quad1"].arm()
    assert ("quad1", "text", "Arming motors") in [event[1:] for event in fleet.events]
    state = fleet["quad1"].state
    assert (state.name, state.armed, state.battery, state.mode) == ("quad1", True, 1.0, "GUIDED")
    assert 0 < state.time <= fleet.time
