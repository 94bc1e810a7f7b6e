"""Items are taken or refused with the MAV_MISSION_RESULT that ArduPilot would give."""

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.transport.mavlink import mav
from mavherd.vehicles.missions.checks import REASONS, check, check_list
from mavherd.vehicles.missions.items import Item, MissionType
from mavherd.vehicles.missions.supported import REFUSED, SUPPORTED, Effect, Phase

ACCEPTED, UNSUPPORTED_FRAME, UNSUPPORTED = 0, 2, 3
PARAM1, PARAM2, PARAM3, PARAM4, LATITUDE, LONGITUDE, ALTITUDE = 6, 7, 8, 9, 10, 11, 12
HERE = {"x": 473_977_000, "y": 85_456_000, "z": 10.0}
WAYPOINT = Item(16, **HERE)
MISSION, FENCE, RALLY = MissionType


def result(item, kind="quadcopter", mission_type=MISSION):
    return check(item, kind, mission_type)


@pytest.mark.parametrize("command", [16, 17, 18, 19, 20, 21, 22, 82, 93, 112, 114, 115, 177, 179])
def test_the_usual_items_are_taken(command):
    assert result(Item(command, **HERE)) == ACCEPTED


@pytest.mark.parametrize("command", [0, 92, 183, 999, 31999, 65535, 5001, 5100])
def test_unknown_commands_and_those_of_other_lists_are_unsupported(command):
    assert result(Item(command, **HERE)) == UNSUPPORTED


@pytest.mark.parametrize("command", [21, 22, 82, 84, 85, 115])
def test_a_rover_takes_nothing_that_flies(command):
    assert result(Item(command, **HERE), "rover") == UNSUPPORTED
    assert result(WAYPOINT, "rover") == ACCEPTED


@pytest.mark.parametrize("frame", [0, 2, 3, 10])
def test_global_frames_are_taken(frame):
    assert result(WAYPOINT._replace(frame=frame)) == ACCEPTED


@pytest.mark.parametrize("frame", [1, 4, 7, 8, 9, 21, 255])
def test_other_frames_are_refused_where_there_is_a_place(frame):
    assert result(WAYPOINT._replace(frame=frame)) == UNSUPPORTED_FRAME
    assert result(Item(178, frame, param1=1, param2=3)) == ACCEPTED


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"x": 900_000_001}, LATITUDE),
        ({"x": -900_000_001}, LATITUDE),
        ({"y": 1_800_000_001}, LONGITUDE),
        ({"y": -1_800_000_001}, LONGITUDE),
        ({"z": 83_001.0}, ALTITUDE),
        ({"z": nan}, ALTITUDE),
        ({"z": -inf}, ALTITUDE),
        ({"x": 900_000_000, "y": -1_800_000_000}, ACCEPTED),
    ],
)
def test_places_must_be_on_earth(fields, expected):
    assert result(WAYPOINT._replace(**fields)) == expected


@pytest.mark.parametrize("value", [inf, -inf])
def test_infinities_are_refused_in_every_parameter(value):
    for number in (1, 2, 3, 4):
        item = WAYPOINT._replace(**{f"param{number}": value})
        assert result(item) == PARAM1 + number - 1
    assert result(Item(178, param1=1, param2=3, z=value)) == ALTITUDE


def test_nan_is_refused_only_where_it_would_mean_something():
    assert result(WAYPOINT._replace(param1=nan)) == PARAM1
    assert result(WAYPOINT._replace(param2=nan)) == PARAM2
    assert result(WAYPOINT._replace(param3=nan, param4=nan)) == ACCEPTED
    assert result(Item(178, param1=1, param2=nan)) == PARAM2
    assert result(Item(178, param1=1, param2=5, param3=nan, param4=nan, z=nan)) == ACCEPTED


@pytest.mark.parametrize(
    ("item", "expected"),
    [
        (Item(178, param1=4, param2=3), PARAM1),
        (Item(178, param1=1, param2=-3), PARAM2),
        (Item(178, param1=1, param2=-2), ACCEPTED),
        (Item(18, param1=1, param3=1e9, **HERE), PARAM3),
        (Item(18, param1=1, param3=-25, **HERE), ACCEPTED),
        (Item(93, param1=-1), PARAM1),
        (Item(115, param1=90, param4=2), PARAM4),
    ],
)
def test_values_that_mean_nothing_are_refused(item, expected):
    assert result(item) == expected


@pytest.mark.parametrize("corners", [0, 1, 2, -4, 3.5, 256, nan])
def test_a_polygon_has_at_least_three_corners_and_a_whole_number(corners):
    assert result(Item(5001, param1=corners, **HERE), mission_type=FENCE) == PARAM1


def test_a_fence_circle_has_a_radius():
    assert result(Item(5003, param1=0, **HERE), mission_type=FENCE) == PARAM1
    assert result(Item(5004, param1=20, **HERE), mission_type=FENCE) == ACCEPTED


def test_a_fence_list_holds_whole_polygons():
    corner = Item(5001, param1=3, **HERE)
    hole = Item(5002, param1=3, **HERE)
    circle = Item(5003, param1=9, **HERE)
    assert check_list([corner] * 3 + [circle] + [hole] * 3 + [corner] * 3, FENCE) is None
    assert "at 0" in check_list([corner] * 2, FENCE)
    assert "at 1" in check_list([circle, corner, corner, hole], FENCE)
    assert "at 3" in check_list([corner] * 3 + [corner._replace(param1=4)] * 3, FENCE)
    assert check_list([corner], MISSION) is None


def test_fence_and_rally_items_stay_in_their_lists():
    point = Item(5100, **HERE)
    assert result(point, mission_type=RALLY) == ACCEPTED
    assert result(point, mission_type=FENCE) == UNSUPPORTED
    assert result(WAYPOINT, mission_type=RALLY) == UNSUPPORTED


@given(
    st.builds(
        Item,
        st.one_of(st.sampled_from(sorted(SUPPORTED)), st.integers(0, 65535)),
        st.integers(0, 255),
        *(st.floats(width=32) for _ in range(4)),
        st.integers(-(2**31), 2**31 - 1),
        st.integers(-(2**31), 2**31 - 1),
        st.floats(width=32),
    ),
    st.sampled_from(["quadcopter", "rover"]),
    st.sampled_from(MissionType),
)
def test_any_item_gets_an_answer_that_has_words(item, kind, mission_type):
    outcome = check(item, kind, mission_type)
    assert outcome == ACCEPTED or REASONS[outcome]


def test_the_table_is_about_commands_that_mavlink_has():
    names = {row.command: row.name for row in SUPPORTED.values()}
    assert names[16] == "MAV_CMD_NAV_WAYPOINT"
    assert not set(REFUSED) & set(SUPPORTED)
    assert set(REFUSED) <= set(mav.enums["MAV_CMD"])
    for row in SUPPORTED.values():
        assert row.note
        assert row.kinds
        assert (row.phase is Phase.NAV) == (row.command <= 95)
        assert row.phase is not Phase.NAV or row.effect is Effect.FLOWN
