"""Lists go up and down as mavlink.io and ArduPilot 4.6 say; what is refused is refused in words."""

from math import inf, nan

import pytest

from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.missions.items import Item, MissionType

ACCEPTED, ERROR, UNSUPPORTED_FRAME, UNSUPPORTED, NO_SPACE = range(5)
PARAM1, LATITUDE, LONGITUDE, ALTITUDE, INVALID_SEQUENCE, DENIED, CANCELLED = (
    6,
    10,
    11,
    12,
    13,
    14,
    15,
)
MISSION, FENCE, RALLY = (int(kind) for kind in MissionType)
LAT, LON = 473_977_000, 85_456_000
HOME = Item(16, 0, x=1, y=1)
WAYPOINTS = tuple(Item(16, 3, x=LAT + 1000 * i, y=LON, z=10.0 + i) for i in range(4))
CORNERS = tuple(Item(5001, 3, param1=3, x=LAT + 1000 * i, y=LON + i * i) for i in range(3))
POINT = Item(5100, 3, x=LAT, y=LON, z=20.0)

UNASKED = ("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK", "STATUSTEXT")


class Ground:
    """A ground station on a link of its own."""

    def __init__(self, desk, system=255, component=190, link=None):
        self.desk = desk
        self.vehicle = desk.vehicle
        self.link = link or self.vehicle.converse(spoken=True)
        self.codec = Codec(system, component)
        self.me = system, component

    def send(self, *messages):
        """Return what is answered at once."""
        return self.codec.decode(self.vehicle.handle(self.codec.encode(messages), self.link))

    def ask(self, message):
        """Return the one answer."""
        (answer,) = self.send(message)
        if hasattr(answer, "target_system"):
            assert (answer.target_system, answer.target_component) == self.me
        return answer

    def run(self, seconds):
        """Let time pass; return what comes unasked of the mission protocol, and texts."""
        out = []
        for _ in range(round(seconds * 100)):
            self.vehicle.step()
            news = self.vehicle.take_broadcasts()
            out += self.codec.decode(self.vehicle.report(self.link, news))
        return [m for m in out if m.get_type() in UNASKED]

    def count(self, count, kind=MISSION):
        return self.ask(mav.MAVLink_mission_count_message(1, 1, count, kind))

    def item(self, seq, item, kind=MISSION, form="int", current=0):
        """Send one item, in one form or the other; return the answer."""
        return self.ask(as_message(seq, item, kind, form, current))

    def upload(self, items, kind=MISSION, form="int"):
        """Upload a whole list; return the result in the last ACK."""
        answer = self.count(len(items), kind)
        while answer.get_type().startswith("MISSION_REQUEST"):
            assert answer.mission_type == kind
            answer = self.item(answer.seq, items[answer.seq], kind, form)
        assert answer.get_type() == "MISSION_ACK"
        assert answer.mission_type == kind
        return answer.type

    def download(self, kind=MISSION, form="int"):
        """Return the messages of a whole list."""
        count = self.ask(mav.MAVLink_mission_request_list_message(1, 1, kind))
        assert (count.get_type(), count.mission_type) == ("MISSION_COUNT", kind)
        name = "mission_request_int" if form == "int" else "mission_request"
        make = getattr(mav, f"MAVLink_{name}_message")
        return [self.ask(make(1, 1, i, kind)) for i in range(count.count)]

    def clear(self, kind):
        return self.ask(mav.MAVLink_mission_clear_all_message(1, 1, kind)).type


def as_message(seq, item, kind=MISSION, form="int", current=0):
    head = (1, 1, seq, item.frame, item.command, current, item.autocontinue, *item[2:6])
    if form == "int":
        return mav.MAVLink_mission_item_int_message(*head, item.x, item.y, item.z, kind)
    return mav.MAVLink_mission_item_message(*head, item.x * 1e-7, item.y * 1e-7, item.z, kind)


@pytest.fixture
def ground(quad):
    return Ground(quad)


@pytest.fixture
def px4(desk):
    return Ground(desk("quadcopter", autopilot="px4"))


def stored(ground, kind=MISSION):
    return ground.vehicle.missions.lists[MissionType(kind)].items


# Up


@pytest.mark.parametrize("form", ["int", "float"])
def test_an_upload_in_either_form_is_stored(ground, form):
    assert ground.upload((HOME, *WAYPOINTS), form=form) == ACCEPTED
    for item, meant in zip(stored(ground), WAYPOINTS, strict=True):
        assert item[:6] == meant[:6]
        assert abs(item.x - meant.x) < (2 if form == "int" else 40)  # a float is good for 0.4 m
        assert item.z == meant.z


def test_ardupilot_asks_with_mission_request_and_px4_with_the_int_form(ground, px4):
    assert ground.count(2).get_type() == "MISSION_REQUEST"
    assert px4.count(2).get_type() == "MISSION_REQUEST_INT"


def test_items_are_asked_for_in_order_and_one_at_a_time(ground):
    answers = [ground.count(3)]
    answers += [ground.item(i, item) for i, item in enumerate((HOME, *WAYPOINTS[:2]))]
    assert [(m.get_type(), getattr(m, "seq", None)) for m in answers] == [
        ("MISSION_REQUEST", 0),
        ("MISSION_REQUEST", 1),
        ("MISSION_REQUEST", 2),
        ("MISSION_ACK", None),
    ]


def test_int_frames_are_stored_as_plain_ones(ground):
    frames = {5: 0, 6: 3, 11: 10}
    items = tuple(WAYPOINTS[0]._replace(frame=frame) for frame in frames)
    assert ground.upload((HOME, *items)) == ACCEPTED
    assert [m.frame for m in ground.download()] == [0, *frames.values()]


def test_px4_answers_with_int_frames(px4):
    assert px4.upload(WAYPOINTS) == ACCEPTED
    assert {m.frame for m in px4.download()} == {6}


def test_px4_lists_hold_no_home(px4):
    assert px4.download() == []
    assert px4.upload(WAYPOINTS) == ACCEPTED
    assert [m.x for m in px4.download()] == [item.x for item in WAYPOINTS]


def test_fence_and_rally_are_lists_of_their_own(ground):
    assert ground.upload((HOME, *WAYPOINTS)) == ACCEPTED
    assert ground.upload(CORNERS, FENCE) == ACCEPTED
    assert ground.upload((POINT,), RALLY) == ACCEPTED
    assert [len(ground.download(kind)) for kind in (MISSION, FENCE, RALLY)] == [5, 3, 1]
    assert [m.command for m in ground.download(FENCE)] == [5001] * 3
    assert ground.vehicle.parameters["FENCE_TOTAL"] == 3


@pytest.mark.parametrize(
    ("item", "kind", "result"),
    [
        (Item(92), MISSION, UNSUPPORTED),
        (Item(40000), MISSION, UNSUPPORTED),
        (POINT, MISSION, UNSUPPORTED),
        (WAYPOINTS[0], FENCE, UNSUPPORTED),
        (WAYPOINTS[0]._replace(frame=1), MISSION, UNSUPPORTED_FRAME),
        (WAYPOINTS[0]._replace(x=910_000_000), MISSION, LATITUDE),
        (WAYPOINTS[0]._replace(y=-1_810_000_000), MISSION, LONGITUDE),
        (WAYPOINTS[0]._replace(z=nan), MISSION, ALTITUDE),
        (WAYPOINTS[0]._replace(param1=inf), MISSION, PARAM1),
        (CORNERS[0]._replace(param1=2), FENCE, PARAM1),
    ],
)
def test_a_bad_item_ends_the_upload_and_the_old_list_stays(ground, item, kind, result):
    old = {MISSION: (HOME, *WAYPOINTS), FENCE: CORNERS}[kind]
    assert ground.upload(old, kind) == ACCEPTED
    before = stored(ground, kind)
    new = (HOME, item, item) if kind == MISSION else (item, item)
    assert ground.upload(new, kind) == result
    assert stored(ground, kind) == before
    assert ground.item(2, WAYPOINTS[0], kind).type == ERROR  # nobody is uploading


@pytest.mark.parametrize(
    ("x", "y", "result"), [(nan, 8, LATITUDE), (47, inf, LONGITUDE), (1e30, 8, LATITUDE)]
)
def test_float_places_that_are_none_are_refused(ground, x, y, result):
    ground.count(2)
    ground.item(0, HOME)
    message = mav.MAVLink_mission_item_message(1, 1, 1, 3, 16, 0, 1, 0, 0, 0, 0, x, y, 10, 0)
    assert ground.ask(message).type == result


def test_a_wrong_number_is_refused_and_the_upload_goes_on(ground):
    ground.count(3)
    assert ground.item(1, WAYPOINTS[0]).type == INVALID_SEQUENCE
    assert ground.item(0, HOME).seq == 1
    assert ground.item(2, WAYPOINTS[1]).type == INVALID_SEQUENCE
    assert ground.item(1, WAYPOINTS[0]).seq == 2
    assert ground.item(2, WAYPOINTS[1]).type == ACCEPTED


def test_an_item_that_comes_twice_does_no_harm(ground):
    ground.count(3)
    ground.item(0, HOME)
    assert ground.item(1, WAYPOINTS[0]).seq == 2
    assert ground.send(as_message(1, WAYPOINTS[0])) == []
    assert ground.item(1, WAYPOINTS[1]).type == INVALID_SEQUENCE  # not the same one
    assert ground.item(2, WAYPOINTS[1]).type == ACCEPTED


@pytest.mark.parametrize("count", [725, 20_000, 65_535])
def test_too_many_items_are_refused_at_once(ground, count, texts):
    ack = ground.count(count)
    assert ack.type == NO_SPACE
    assert texts(ground.run(0.05)) == ["Only 724 items are supported"]
    assert ground.count(2).get_type() == "MISSION_REQUEST"


def test_the_longest_list_fits(ground):
    assert ground.upload((HOME, *(WAYPOINTS[0],) * 723)) == ACCEPTED
    assert len(stored(ground)) == 723


@pytest.mark.parametrize("kind", [3, 77, 254])
def test_unknown_lists_are_unsupported(ground, kind):
    assert ground.count(1, kind).type == UNSUPPORTED
    assert ground.ask(mav.MAVLink_mission_request_list_message(1, 1, kind)).type == UNSUPPORTED
    assert ground.ask(mav.MAVLink_mission_request_int_message(1, 1, 0, kind)).type == UNSUPPORTED
    assert ground.clear(kind) == UNSUPPORTED


def test_only_clearing_means_all_lists(ground):
    assert ground.count(1, 255).type == UNSUPPORTED
    assert ground.ask(mav.MAVLink_mission_request_list_message(1, 1, 255)).type == UNSUPPORTED


def test_another_station_is_denied_during_an_upload(ground):
    other, same_ids = Ground(ground.desk, 245), Ground(ground.desk)
    ground.count(2)
    for stranger in (other, same_ids):
        assert stranger.count(2).type == DENIED
        assert stranger.count(1, RALLY).type == DENIED
        assert stranger.item(0, HOME).type == DENIED
    assert ground.item(0, HOME).seq == 1
    assert ground.item(1, WAYPOINTS[0]).type == ACCEPTED
    assert other.upload((HOME, *WAYPOINTS)) == ACCEPTED


def test_two_stations_on_one_link_are_told_apart(ground):
    other = Ground(ground.desk, 254, link=ground.link)
    ground.count(2)
    assert other.count(2).type == DENIED


def test_an_upload_may_be_begun_anew_by_its_sender(ground):
    ground.count(5)
    ground.item(0, HOME)
    assert ground.count(2).seq == 0
    ground.item(0, HOME)
    assert ground.item(1, WAYPOINTS[0]).type == ACCEPTED
    assert len(stored(ground)) == 1


def test_a_list_cannot_be_read_while_it_comes_up(ground):
    ground.count(2)
    for message in (
        mav.MAVLink_mission_request_list_message(1, 1, MISSION),
        mav.MAVLink_mission_request_int_message(1, 1, 0, MISSION),
    ):
        assert ground.ask(message).type == DENIED
    assert len(ground.download(FENCE)) == 0


def test_a_missing_item_is_asked_for_again_every_second(ground):
    ground.count(3)
    ground.run(0.9)
    ground.item(0, HOME)
    assert ground.run(0.95) == []
    assert [(m.get_type(), m.seq) for m in ground.run(2.0)] == [("MISSION_REQUEST", 1)] * 2


def test_a_silent_upload_is_cancelled_after_eight_seconds(ground, texts):
    assert ground.upload((HOME, *WAYPOINTS)) == ACCEPTED
    before = stored(ground)
    ground.run(0.1)
    ground.count(3)
    ground.item(0, HOME)
    assert "MISSION_ACK" not in [m.get_type() for m in ground.run(7.9)]
    messages = ground.run(0.3)
    (ack,) = (m for m in messages if m.get_type() == "MISSION_ACK")
    assert (ack.type, ack.target_system, ack.mission_type) == (CANCELLED, 255, MISSION)
    assert texts(messages) == ["Mission upload timeout"]
    assert ground.run(3) == []
    assert stored(ground) == before


def test_an_upload_whose_link_has_died_blocks_nobody_for_long(ground):
    Ground(ground.desk, 245).count(2)
    assert ground.count(2).type == DENIED
    ground.run(8.1)  # nobody asks the other link any more
    assert ground.upload((HOME, *WAYPOINTS)) == ACCEPTED


def test_an_uploader_may_call_it_off(ground):
    ground.count(2)
    assert Ground(ground.desk, 245).send(mav.MAVLink_mission_ack_message(1, 1, CANCELLED, 0)) == []
    assert ground.item(0, HOME).seq == 1
    assert ground.send(mav.MAVLink_mission_ack_message(1, 1, CANCELLED, 0)) == []
    assert ground.item(1, WAYPOINTS[0]).type == ERROR
    assert ground.run(3) == []


def test_an_item_that_nobody_asked_for_is_an_error(ground):
    assert ground.item(0, HOME).type == ERROR
    ground.count(3)
    assert ground.item(0, POINT, RALLY).type == ERROR
    assert ground.item(0, HOME).seq == 1


@pytest.mark.parametrize("items", [(), (HOME,)])
def test_an_empty_list_clears_the_mission(ground, items):
    ground.upload((HOME, *WAYPOINTS))
    assert ground.upload(items) == ACCEPTED
    assert stored(ground) == ()


def test_a_broken_polygon_is_an_error_and_changes_nothing(ground, texts):
    assert ground.upload(CORNERS, FENCE) == ACCEPTED
    ground.run(0.1)
    assert ground.upload(CORNERS[:2], FENCE) == ERROR
    assert any("corners" in text for text in texts(ground.run(0.1)))
    assert stored(ground, FENCE) == CORNERS


def test_what_has_been_received_is_said(ground, texts):
    ground.upload((HOME, *WAYPOINTS))
    ground.upload(CORNERS, FENCE)
    ground.upload((POINT,), RALLY)
    said = texts(ground.run(0.1))
    assert said == ["Flight plan received", "Fence received", "Rally points received"]


# Partial lists


def partial(ground, first, last, kind=MISSION):
    return ground.ask(mav.MAVLink_mission_write_partial_list_message(1, 1, first, last, kind))


def test_a_part_of_a_list_can_be_replaced(ground):
    ground.upload((HOME, *WAYPOINTS))
    new = tuple(item._replace(z=99.0) for item in WAYPOINTS)
    assert partial(ground, 2, 3).seq == 2
    assert ground.item(2, new[0]).seq == 3
    assert ground.item(3, new[1]).type == ACCEPTED
    assert stored(ground) == (WAYPOINTS[0], *new[:2], WAYPOINTS[3])


def test_a_part_may_begin_at_home_and_append(ground):
    ground.upload((HOME, *WAYPOINTS[:1]))
    assert partial(ground, 0, 2).seq == 0
    for seq, item in enumerate((HOME, WAYPOINTS[2], WAYPOINTS[3])):
        answer = ground.item(seq, item)
    assert answer.type == ACCEPTED
    assert stored(ground) == WAYPOINTS[2:]


@pytest.mark.parametrize(
    ("first", "last"), [(-1, 2), (3, 2), (2, 6), (6, 6), (32767, 32767), (-5, -1)]
)
def test_parts_that_cannot_be_are_errors(ground, first, last):
    ground.upload((HOME, *WAYPOINTS))
    assert partial(ground, first, last).type == ERROR
    assert stored(ground) == WAYPOINTS


def test_a_part_must_not_make_a_list_too_long(ground):
    ground.upload((HOME, *(WAYPOINTS[0],) * 723))
    assert partial(ground, 724, 724).type == ERROR
    assert partial(ground, 723, 723).seq == 723


def test_a_part_of_a_polygon_must_leave_it_whole(ground):
    ground.upload(CORNERS, FENCE)
    partial(ground, 1, 1, FENCE)
    assert ground.item(1, CORNERS[1]._replace(param1=4), FENCE).type == ERROR
    assert stored(ground, FENCE) == CORNERS


def test_reading_parts_is_unsupported(ground):
    assert (
        ground.ask(mav.MAVLink_mission_request_partial_list_message(1, 1, 0, 1)).type == UNSUPPORTED
    )


# Down


def test_what_went_up_comes_down_in_both_forms(ground):
    odd = Item(178, 3, param1=1.0, param2=4.5, param3=-1.0, param4=nan)
    ground.upload((HOME, *WAYPOINTS, odd))
    for form, scale in (("int", 1), ("float", 1e-7)):
        messages = ground.download(form=form)
        name = "MISSION_ITEM_INT" if form == "int" else "MISSION_ITEM"
        assert {m.get_type() for m in messages} == {name}
        assert [m.seq for m in messages] == list(range(6))
        for m, item in zip(messages[1:5], WAYPOINTS, strict=True):
            assert (m.command, m.frame, m.z, m.autocontinue) == (16, 3, item.z, 1)
            assert m.x == pytest.approx(item.x * scale, abs=2e-6)
        assert messages[5].param2 == 4.5


def test_item_0_is_home_wherever_it_is_now(ground):
    (home,) = ground.download()
    assert (home.command, home.frame, home.seq) == (16, 0, 0)
    assert (home.x, home.y, home.z) == (LAT, LON, 488.0)
    ground.upload((HOME, *WAYPOINTS))  # the home that is sent does not count
    assert ground.download()[0].x == LAT
    lat_lon = (47.4, 8.55)
    ground.desk.command(mav.MAV_CMD_DO_SET_HOME, 0, 0, 0, 0, *lat_lon, 500)
    moved = ground.download()[0]
    assert (moved.x, moved.y) == pytest.approx([round(v * 1e7) for v in lat_lon], abs=40)
    assert moved.z == pytest.approx(500)


def test_beyond_the_end_there_is_nothing(ground):
    ground.upload((HOME, *WAYPOINTS))
    for seq in (5, 6, 65535):
        for make in (mav.MAVLink_mission_request_message, mav.MAVLink_mission_request_int_message):
            assert ground.ask(make(1, 1, seq, MISSION)).type == INVALID_SEQUENCE


def test_the_current_item_is_marked(ground):
    ground.upload((HOME, *WAYPOINTS))
    assert [m.current for m in ground.download()] == [0] * 5
    ground.send(mav.MAVLink_mission_set_current_message(1, 1, 3))
    assert [m.current for m in ground.download()] == [0, 0, 0, 1, 0]


# Clearing, the current item, guided items


@pytest.mark.parametrize(
    ("kind", "left"),
    [(MISSION, [1, 3, 1]), (FENCE, [5, 0, 1]), (RALLY, [5, 3, 0]), (255, [1, 0, 0])],
)
def test_lists_are_cleared_by_type_or_all(ground, kind, left):
    ground.upload((HOME, *WAYPOINTS))
    ground.upload(CORNERS, FENCE)
    ground.upload((POINT,), RALLY)
    assert ground.clear(kind) == ACCEPTED
    assert [len(ground.download(k)) for k in (MISSION, FENCE, RALLY)] == left


def test_nothing_is_cleared_during_an_upload(ground):
    ground.upload((HOME, *WAYPOINTS))
    ground.count(2)
    assert ground.clear(MISSION) == ERROR
    assert stored(ground) == WAYPOINTS


def test_setting_the_current_item_is_answered_with_mission_current_to_all(ground):
    other = Ground(ground.desk, 245)
    ground.upload((HOME, *WAYPOINTS))
    ground.run(0.1)
    assert ground.send(mav.MAVLink_mission_set_current_message(1, 1, 2)) == []
    ground.vehicle.step()
    news = ground.vehicle.take_broadcasts()
    for station in (ground, other):
        messages = station.codec.decode(ground.vehicle.report(station.link, news))
        assert 2 in [m.seq for m in messages if m.get_type() == "MISSION_CURRENT"]


def test_an_item_that_is_not_there_cannot_be_current(ground, texts):
    ground.upload((HOME, *WAYPOINTS))
    ground.run(0.1)
    ground.send(mav.MAVLink_mission_set_current_message(1, 1, 5))
    assert texts(ground.run(0.1)) == ["Mission: no such item"]
    assert ground.vehicle.missions.progress.shown is None


@pytest.mark.parametrize("form", ["int", "float"])
def test_an_item_with_current_2_is_a_target_in_guided(ground, form):
    desk = ground.desk
    desk.fly(5)
    goal = Item(16, 3, x=LAT + 900, y=LON + 600, z=8.0)  # 10 m north, 4.5 m east
    assert ground.item(0, goal, form=form, current=2).type == ACCEPTED
    ground.run(30)
    assert desk.where[:3] == pytest.approx((10.0, 4.5, -8.0), abs=0.8)
    assert ground.item(0, Item(16, 3, z=4.0), form=form, current=3).type == ACCEPTED
    ground.run(10)
    assert desk.where[:3] == pytest.approx((10.0, 4.5, -4.0), abs=0.8)
    assert stored(ground) == ()


def test_guided_items_are_refused_outside_guided_and_when_they_are_no_place(ground):
    goal = Item(16, 3, x=LAT + 900, y=LON, z=8.0)
    assert ground.item(0, goal, current=2).type == ERROR
    ground.desk.fly(5)
    assert ground.item(0, goal._replace(frame=8), current=2).type == UNSUPPORTED_FRAME
    assert ground.item(0, goal._replace(x=950_000_000), current=2).type == LATITUDE
    assert ground.item(0, goal._replace(x=0, y=0), current=2).type == ERROR
    assert ground.item(0, goal._replace(z=nan), current=3).type == ALTITUDE


# Hostile and old peers


def test_a_flood_of_uploads_leaves_one(ground):
    for i in range(300):
        ground.send(mav.MAVLink_mission_count_message(1, 1, i % 700 + 1, i % 3))
    assert ground.vehicle.missions.upload is not None
    assert len(ground.vehicle.missions.upload.items) == 0
    ground.run(9)
    assert ground.vehicle.missions.upload is None


def test_a_station_that_speaks_mavlink_1_means_the_mission(ground):
    def v1(message):
        ground.codec.version = 1
        data = ground.codec.encode([message])
        return ground.codec.decode(ground.vehicle.handle(data, ground.link))[0]

    items = (HOME, WAYPOINTS[0])
    answer = v1(mav.MAVLink_mission_count_message(1, 1, 2))
    while answer.get_type() == "MISSION_REQUEST":
        answer = v1(as_message(answer.seq, items[answer.seq], form="float"))
    assert (answer.get_type(), answer.type) == ("MISSION_ACK", ACCEPTED)
    assert len(stored(ground)) == 1


def test_what_is_meant_for_others_is_not_answered(ground):
    assert ground.send(mav.MAVLink_mission_count_message(9, 1, 2, 0)) == []
    assert ground.send(mav.MAVLink_mission_request_list_message(9, 1, 0)) == []
    assert ground.ask(mav.MAVLink_mission_request_list_message(0, 0, 0)).count == 1


# While the mission is flown


@pytest.fixture
def flying(ground):
    """Return a ground station whose copter flies the second of four waypoints in AUTO."""
    desk = ground.desk
    far = tuple(item._replace(x=LAT + 9000 * i) for i, item in enumerate(WAYPOINTS))  # 100 m apart
    assert ground.upload((HOME, *far)) == ACCEPTED
    desk.fly(5)
    assert desk.command(mav.MAV_CMD_DO_SET_MODE, 1, 3) == 0
    while ground.vehicle.missions.progress.current != 1:
        ground.run(0.5)
    return ground


def test_a_mission_that_is_flown_cannot_be_cleared(flying):
    assert flying.clear(MISSION) == ERROR
    assert flying.clear(255) == ERROR
    assert flying.clear(RALLY) == ACCEPTED
    assert len(stored(flying)) == 4
    assert flying.desk.command(mav.MAV_CMD_DO_SET_MODE, 1, 4) == 0
    assert flying.clear(MISSION) == ACCEPTED


def test_an_upload_leaves_the_place_in_a_mission_that_is_flown(flying):
    assert flying.upload((HOME, *stored(flying)[:3])) == ACCEPTED
    assert flying.vehicle.missions.progress.current == 1


@pytest.mark.parametrize("items", [(), (HOME, *WAYPOINTS[:1])])
def test_a_shorter_upload_does_not_stop_what_is_flown(flying, items):
    assert flying.upload(items) == ACCEPTED
    before = flying.desk.where.north
    flying.run(3)
    assert flying.desk.where.north > before + 2


def test_a_new_mission_for_one_that_is_paused_begins_at_its_beginning(flying):
    flying.desk.command(mav.MAV_CMD_DO_SET_MODE, 1, 4)
    assert flying.upload((HOME, *WAYPOINTS)) == ACCEPTED
    assert flying.vehicle.missions.progress.shown is None


def test_a_part_written_into_a_paused_mission_keeps_the_place(flying):
    flying.desk.command(mav.MAV_CMD_DO_SET_MODE, 1, 4)
    partial(flying, 4, 4)
    assert flying.item(4, WAYPOINTS[0]).type == ACCEPTED
    assert flying.vehicle.missions.progress.shown == 1


def test_a_rover_takes_no_takeoff(desk):
    ground = Ground(desk("rover"))
    assert ground.upload((HOME, Item(22, 3, z=10.0))) == UNSUPPORTED
    assert ground.upload((HOME, *WAYPOINTS)) == ACCEPTED
