"""Missions go up in either way of asking, and their progress counts as the list was given."""

from math import isnan

import pytest

from mavherd.gcs.station import RETRY_S, TRIES, MissionItem, plan
from mavherd.transport.frames import Origin
from mavherd.transport.mavlink import mav
from mavherd.vehicles.flight.modes import Mode

POINTS = [(0.0, 0.0, 3.0), (4.0, 0.0, 3.0), (4.0, 4.0, 4.0)]
FLEET = Origin()
NAV_WAYPOINT, NAV_TAKEOFF = 16, 22
RADIUS = 2.1  # m, in which a waypoint counts as reached, and a little


def answer(pair, question):
    pair.until(lambda: question.done, 2 * RETRY_S * (TRIES + 2))
    return question


def on_board(pair):
    return pair.vehicle.missions.mission.items


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_what_goes_up_is_what_the_vehicle_has(make_pair, autopilot):
    pair = make_pair("quadcopter", autopilot, external=True)
    pair.run(1)
    question = answer(
        pair, pair.station.missions.upload(plan(POINTS, "quadcopter", FLEET), pair.now)
    )
    assert (question.accepted, question.value, question.error) == (True, 4, "")
    items = on_board(pair)
    assert [i.command for i in items] == [NAV_TAKEOFF, NAV_WAYPOINT, NAV_WAYPOINT, NAV_WAYPOINT]
    assert [i.z for i in items] == [3, 3, 3, 4]
    for item, (east, north, _) in zip(items, [POINTS[0], *POINTS], strict=True):
        place = FLEET.from_geodetic(item.x * 1e-7, item.y * 1e-7)
        assert place == pytest.approx((north, east), abs=0.02)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_mission_is_flown_and_its_progress_told(make_pair, autopilot):
    pair = make_pair("quadcopter", autopilot, external=True)
    pair.until(lambda: pair.status.position_at > 0)
    station, missions = pair.station, pair.station.missions
    answer(pair, missions.upload(plan(POINTS, "quadcopter", FLEET), pair.now))
    armable = Mode.AUTO if autopilot == "px4" else Mode.GUIDED
    station.set_mode(armable, pair.now)
    pair.run(0.2)
    station.arm(pair.now)
    pair.run(0.2)
    station.set_mode(Mode.AUTO, pair.now)
    pair.run(0.2)
    station.command(mav.MAV_CMD_MISSION_START, (), "start", pair.now)
    pair.until(lambda: missions.reached == 3, 60)
    north, east, down = pair.status.position
    assert (east, north, -down) == pytest.approx(POINTS[-1], abs=RADIUS)
    pair.until(lambda: missions.complete, 5)
    assert missions.count == 4


def test_a_cleared_mission_is_gone(make_pair):
    pair = make_pair()
    pair.run(1)
    answer(pair, pair.station.missions.upload(plan(POINTS, "quadcopter", FLEET), pair.now))
    assert len(on_board(pair)) == 4
    assert answer(pair, pair.station.missions.clear(pair.now)).accepted
    assert not on_board(pair)


def test_a_refused_item_is_an_error_in_words(make_pair):
    pair = make_pair()
    pair.run(1)
    unknown = MissionItem(31999, *FLEET.to_geodetic(0, 0), 3.0)
    question = answer(pair, pair.station.missions.upload([unknown], pair.now))
    assert question.error == "q: mission of 1 items: refused (UNSUPPORTED)"


def test_a_rover_does_not_take_off_and_has_no_height():
    items = plan(POINTS, "rover", FLEET)
    assert [(i.command, i.up) for i in items] == [(NAV_WAYPOINT, 0.0)] * 3


def test_heights_count_from_home():
    takeoff, first = plan([(0.0, 0.0, 3.0)], "quadcopter", FLEET, ground=1.0)
    assert takeoff.up == first.up == 2.0
    assert isnan(takeoff.params[3])
    assert (takeoff.lat_deg, takeoff.lon_deg) == (first.lat_deg, first.lon_deg)  # PX4 goes there


def test_a_silent_vehicle_ends_an_upload(make_pair):
    pair = make_pair()
    pair.run(1)
    pair.deaf = True
    question = answer(pair, pair.station.missions.upload((), pair.now))
    assert question.error == f"q: mission of 0 items: no answer after {TRIES} tries"


def test_a_lost_list_is_offered_again(make_pair):
    pair = make_pair()
    pair.run(1)
    pair.deaf = True
    question = pair.station.missions.upload(plan(POINTS, "quadcopter", FLEET), pair.now)
    pair.run(1.2)
    pair.deaf = False
    assert answer(pair, question).accepted


def test_what_another_station_uploads_is_not_our_business(make_pair):
    pair = make_pair()
    pair.run(1)
    pair.deaf = True
    question = pair.station.missions.upload(plan(POINTS, "quadcopter", FLEET), pair.now)
    pair.run(0.1)
    pair.hear(mav.MAVLink_mission_ack_message(255, 190, mav.MAV_MISSION_ACCEPTED))
    pair.hear(mav.MAVLink_mission_request_message(255, 190, 0))
    assert not question.done
    pair.deaf = False
    assert answer(pair, question).accepted
