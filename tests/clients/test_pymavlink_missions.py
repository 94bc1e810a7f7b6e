"""Missions, fences and rally points travel by MAVLink's protocol, as ArduPilot 4.6 speaks it."""

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

MISSION, FENCE, RALLY = range(3)
HOME = (473_977_000, 85_456_000)
TAKEOFF, WAYPOINT, RTL = (
    mav.MAV_CMD_NAV_TAKEOFF,
    mav.MAV_CMD_NAV_WAYPOINT,
    mav.MAV_CMD_NAV_RETURN_TO_LAUNCH,
)
RELATIVE = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT
OK = mav.MAV_MISSION_ACCEPTED
SQUARE = [(1000, 1000), (1000, -1000), (-1000, -1000), (-1000, 1000)]


@pytest.fixture(scope="module")
def copter(start):
    return start("quadcopter", speed=3)


@pytest.fixture(params=["tcp", "udp"])
def station(copter, connect, request):
    station = connect(copter, request.param)
    yield station
    station.send(mav.MAVLink_mission_clear_all_message(1, 1, mav.MAV_MISSION_TYPE_ALL))
    acknowledgement(station, mav.MAV_MISSION_TYPE_ALL)


def item(seq, command=WAYPOINT, x=0, y=0, z=5.0, frame=RELATIVE, kind=MISSION, p1=0.0, current=0):
    """Return an item; x and y are 1e-7 degrees from home."""
    return mav.MAVLink_mission_item_int_message(
        1, 1, seq, frame, command, current, 1, p1, 0, 0, 0, HOME[0] + x, HOME[1] + y, z, kind
    )


def as_float(m):
    """Return the older form of an item."""
    return mav.MAVLink_mission_item_message(
        1, 1, m.seq, m.frame, m.command, m.current, m.autocontinue, m.param1, m.param2, m.param3,
        m.param4, m.x / 1e7, m.y / 1e7, m.z, m.mission_type,
    )  # fmt: skip


def acknowledgement(station, kind=MISSION):
    ack = station.wait("MISSION_ACK", where=lambda m: m.mission_type == kind)
    assert (ack.target_system, ack.target_component) == (station.system, station.component)
    return ack.type


def upload(station, items, kind=MISSION, form=lambda m: m):
    """Upload a list and return the MAV_MISSION_RESULT.

    What is asked for again is on its way: a second copy of the last item would find no upload.
    """
    station.send(mav.MAVLink_mission_count_message(1, 1, len(items), kind))
    sent = set()
    while True:
        m = station.wait("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK")
        if m.get_type() == "MISSION_ACK":
            assert m.mission_type == kind
            return m.type
        assert m.mission_type == kind
        if m.seq not in sent:
            sent.add(m.seq)
            station.send(form(items[m.seq]))


def count(station, kind=MISSION):
    station.send(mav.MAVLink_mission_request_list_message(1, 1, kind))
    return station.wait("MISSION_COUNT", where=lambda m: m.mission_type == kind).count


def download(station, kind=MISSION, form="int"):
    """Return the items of a list, in one of the two forms."""
    ask, answer = {
        "int": (mav.MAVLink_mission_request_int_message, "MISSION_ITEM_INT"),
        "float": (mav.MAVLink_mission_request_message, "MISSION_ITEM"),
    }[form]
    items = []
    for seq in range(count(station, kind)):
        station.send(ask(1, 1, seq, kind))
        items.append(station.wait(answer, where=lambda m, seq=seq: m.seq == seq))
    station.send(mav.MAVLink_mission_ack_message(1, 1, OK, kind))
    return items


FLIGHT = [
    item(0, frame=mav.MAV_FRAME_GLOBAL, z=0.0, x=50_000),  # home; what is sent here is ignored
    item(1, TAKEOFF),
    item(2, x=1000, z=6.5),
    item(3, x=1000, y=-1000, p1=2.0),
    item(4, RTL, -HOME[0], -HOME[1], z=0.0),  # nowhere: it has no place
]


def fields(m):
    scale = 1 if m.get_type().endswith("_INT") else 1e7
    return m.command, m.frame, m.param1, round(m.x * scale, -2), round(m.y * scale, -2), m.z


@pytest.mark.parametrize("sent", ["int", "float"])
@pytest.mark.parametrize("got", ["int", "float"])
def test_a_mission_comes_back_as_it_went(station, sent, got):
    assert upload(station, FLIGHT, form=as_float if sent == "float" else lambda m: m) == OK
    back = download(station, form=got)
    tolerance = [
        (b, a) for b, a in zip(map(fields, back[1:]), map(fields, FLIGHT[1:]), strict=True)
    ]
    for theirs, ours in tolerance:
        assert theirs == pytest.approx(ours, abs=120)  # single precision keeps about a metre
        assert theirs[:3] == ours[:3]
        assert theirs[5] == ours[5]


def test_it_asks_with_mission_request_as_ardupilot_does(station):
    station.send(mav.MAVLink_mission_count_message(1, 1, 2, MISSION))
    assert station.wait("MISSION_REQUEST", "MISSION_REQUEST_INT").get_type() == "MISSION_REQUEST"
    station.send(item(0))
    station.wait("MISSION_REQUEST", where=lambda m: m.seq == 1)
    station.send(item(1))
    assert acknowledgement(station) == OK


def test_item_0_is_home_whatever_is_sent(station):
    assert upload(station, FLIGHT) == OK
    home = download(station)[0]
    assert (home.command, home.frame) == (WAYPOINT, mav.MAV_FRAME_GLOBAL)
    assert (home.x, home.y) == pytest.approx(HOME, abs=20)
    assert home.z == pytest.approx(488, abs=1)


def test_an_empty_mission_still_has_home(station):
    station.send(mav.MAVLink_mission_clear_all_message(1, 1, MISSION))
    assert acknowledgement(station) == OK
    assert count(station) == 1
    station.send(mav.MAVLink_mission_request_int_message(1, 1, 0, MISSION))
    assert station.wait("MISSION_ITEM_INT").seq == 0


def test_fence_and_rally_are_lists_of_their_own(station):
    inclusion = mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
    fence = [
        item(i, inclusion, *at, frame=mav.MAV_FRAME_GLOBAL, z=0.0, kind=FENCE, p1=4.0)
        for i, at in enumerate(SQUARE)
    ]
    rally = [item(0, mav.MAV_CMD_NAV_RALLY_POINT, 500, 500, kind=RALLY, z=20.0)]
    assert upload(station, FLIGHT) == OK
    assert upload(station, fence, FENCE) == OK
    assert upload(station, rally, RALLY) == OK
    assert [count(station, kind) for kind in (MISSION, FENCE, RALLY)] == [5, 4, 1]
    assert [fields(m) for m in download(station, FENCE)] == [fields(m) for m in fence]
    assert [fields(m) for m in download(station, RALLY)] == [fields(m) for m in rally]
    station.send(mav.MAVLink_mission_clear_all_message(1, 1, FENCE))
    assert acknowledgement(station, FENCE) == OK
    assert [count(station, kind) for kind in (MISSION, FENCE, RALLY)] == [5, 0, 1]


@pytest.mark.parametrize(
    ("wrong", "result"),
    [
        (item(1, 31_000), mav.MAV_MISSION_UNSUPPORTED),
        (item(1, frame=mav.MAV_FRAME_BODY_NED), mav.MAV_MISSION_UNSUPPORTED_FRAME),
        (item(1, x=600_000_000), mav.MAV_MISSION_INVALID_PARAM5_X),
        (item(1, y=1_900_000_000), mav.MAV_MISSION_INVALID_PARAM6_Y),
    ],
)
def test_a_wrong_item_is_refused_by_its_code_and_the_old_list_stays(station, wrong, result):
    assert upload(station, FLIGHT) == OK
    assert upload(station, [item(0), wrong, item(2)]) == result
    assert count(station) == len(FLIGHT)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_what_is_not_a_number_does_no_harm(station, value):
    upload(station, [item(0), item(1, z=value), item(2, p1=value)])
    assert upload(station, FLIGHT) == OK


def test_the_wrong_sequence_number_is_refused_and_the_upload_goes_on(station):
    station.send(mav.MAVLink_mission_count_message(1, 1, 2, MISSION))
    station.wait("MISSION_REQUEST", where=lambda m: m.seq == 0)
    station.send(item(1))
    assert acknowledgement(station) == mav.MAV_MISSION_INVALID_SEQUENCE
    station.send(item(0))
    station.wait("MISSION_REQUEST", where=lambda m: m.seq == 1)
    station.send(item(1))
    assert acknowledgement(station) == OK


def test_too_many_items_have_no_room(station):
    station.send(mav.MAVLink_mission_count_message(1, 1, 65_535, MISSION))
    assert acknowledgement(station) == mav.MAV_MISSION_NO_SPACE


def test_an_unknown_list_is_unsupported(station):
    station.send(mav.MAVLink_mission_request_list_message(1, 1, 7))
    assert acknowledgement(station, 7) == mav.MAV_MISSION_UNSUPPORTED


def test_an_item_beyond_the_end_is_refused(station):
    upload(station, FLIGHT)
    station.send(mav.MAVLink_mission_request_int_message(1, 1, 99, MISSION))
    assert acknowledgement(station) != OK


def test_another_station_is_denied_during_an_upload(copter, connect):
    one, other = connect(copter, "tcp"), connect(copter, "udp", system=250)
    one.send(mav.MAVLink_mission_count_message(1, 1, 2, MISSION))
    one.wait("MISSION_REQUEST")
    other.send(mav.MAVLink_mission_count_message(1, 1, 1, MISSION))
    assert acknowledgement(other) == mav.MAV_MISSION_DENIED
    one.send(item(0))
    one.wait("MISSION_REQUEST", where=lambda m: m.seq == 1)
    one.send(item(1))
    assert acknowledgement(one) == OK


def test_a_missing_item_is_asked_for_again_and_an_abandoned_upload_ends(station):
    assert upload(station, FLIGHT) == OK
    station.send(mav.MAVLink_mission_count_message(1, 1, 3, MISSION))
    station.wait("MISSION_REQUEST", where=lambda m: m.seq == 0)
    station.wait("MISSION_REQUEST", where=lambda m: m.seq == 0)
    assert acknowledgement(station) == mav.MAV_MISSION_OPERATION_CANCELLED
    assert count(station) == len(FLIGHT)


def test_part_of_a_list_is_replaced(station):
    assert upload(station, FLIGHT) == OK
    station.send(mav.MAVLink_mission_write_partial_list_message(1, 1, 2, 3, MISSION))
    for seq in (2, 3):
        station.wait("MISSION_REQUEST", where=lambda m, seq=seq: m.seq == seq)
        station.send(item(seq, x=-2000, z=9.0))
    assert acknowledgement(station) == OK
    assert [m.z for m in download(station)][1:] == [5.0, 9.0, 9.0, 0.0]


def test_the_current_item_is_set_by_message_and_by_command(station):
    assert upload(station, FLIGHT) == OK
    station.send(mav.MAVLink_mission_set_current_message(1, 1, 3))
    station.wait("MISSION_CURRENT", where=lambda m: m.seq == 3)
    assert station.ask(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 2) == 0
    station.wait("MISSION_CURRENT", where=lambda m: m.seq == 2)
    assert station.ask(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 77) != 0


def test_a_mission_is_flown_and_told(station):
    route = [item(0), item(1, TAKEOFF, z=4.0), item(2, x=600, z=4.0), item(3, mav.MAV_CMD_NAV_LAND)]
    assert upload(station, route) == OK
    assert station.ask(mav.MAV_CMD_DO_SET_MODE, 1, 4) == 0
    assert station.ask(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 0
    station.forget()
    assert station.ask(mav.MAV_CMD_MISSION_START) == 0
    station.wait(
        "HEARTBEAT",
        where=lambda m: not m.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED,
        patience=60,
    )
    assert [m.seq for m in station.named("MISSION_ITEM_REACHED")] == [1, 2, 3]
    current = [m.seq for m in station.named("MISSION_CURRENT")]
    assert current == sorted(current)
    assert {1, 2, 3} <= set(current)
    assert max(m.relative_alt for m in station.named("GLOBAL_POSITION_INT")) > 3500
    farthest = max(m.lat for m in station.named("GLOBAL_POSITION_INT"))
    assert farthest == pytest.approx(HOME[0] + 600, abs=200)
