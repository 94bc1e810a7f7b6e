"""Mission files are read as ground stations write them; what is wrong is named with its place."""

import contextlib
import copy
import json
from math import isnan, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.vehicles.missions.files import read, write_wpl
from mavherd.vehicles.missions.items import Item
from mavherd.vehicles.missions.plan import MissionError, Place, Plan
from mavherd.vehicles.missions.plan_json import parse_plan
from mavherd.vehicles.missions.store import MissionStore
from mavherd.vehicles.missions.waypoints import format_wpl, parse_wpl

WPL = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t47.3977000\t8.5456000\t488.000000\t1
1\t0\t3\t22\t0.0\t0.0\t0.0\t0.0\t0.0\t0.0\t10.0\t1

2 0 3 16 2 0 0 nan 47.398 8.546 12.5 1  # blanks and notes do no harm
3\t0\t2\t178\t1\t4.5\t-1\t0\t0\t0\t0\t1
4\t0\t0\t177\t2\t3\t0\t0\t0\t0\t0\t1
"""


def simple(command, params, jump_id=1, **more):
    return {
        "type": "SimpleItem", "command": command, "frame": 3, "autoContinue": True,
        "doJumpId": jump_id, "params": params, **more,
    }  # fmt: skip


def plan_file():
    """Return a plan as QGroundControl 4.4 writes it, with a survey, a fence and rally points."""
    camera = simple(206, [25, 0, 1, 0, 0, 0, 0], 4, frame=2)
    return {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "QGroundControl",
        "mission": {
            "version": 2,
            "firmwareType": 3,
            "vehicleType": 2,
            "cruiseSpeed": 15,
            "hoverSpeed": 5,
            "plannedHomePosition": [47.3977, 8.5456, 488],
            "items": [
                simple(22, [15, 0, 0, None, 47.3977, 8.5456, 20], 1, Altitude=20, AltitudeMode=1),
                simple(16, [0, 0, 0, None, 47.398, 8.546, 20], 2),
                {
                    "type": "ComplexItem",
                    "complexItemType": "survey",
                    "version": 5,
                    "TransectStyleComplexItem": {
                        "Items": [simple(16, [0, 0, 0, None, 47.3985, 8.546, 20], 3), camera]
                    },
                },
                simple(177, [2, 1, 0, 0, 0, 0, 0], 9, frame=2),
                simple(20, [0, 0, 0, 0, 0, 0, 0], 10, frame=2, autoContinue=False),
            ],
        },
        "geoFence": {
            "version": 2,
            "polygons": [
                {"inclusion": True, "polygon": [[47.4, 8.5], [47.4, 8.6], [47.3, 8.5]]},
                {"inclusion": False, "polygon": [[1, 1], [1, 2], [2, 2], [2, 1]]},
            ],
            "circles": [{"inclusion": False, "circle": {"center": [47.39, 8.54], "radius": 12.5}}],
            "breachReturn": [47.3977, 8.5456, 30],
        },
        "rallyPoints": {"version": 2, "points": [[47.3977, 8.5456, 25]]},
    }


def parse(data):
    return parse_plan(json.dumps(data), "some.plan")


def test_a_wpl_file_holds_home_and_items():
    plan = parse_wpl(WPL, "some.waypoints")
    assert plan.home == Place(47.3977, 8.5456, 488.0)
    takeoff, waypoint, speed, jump = plan.mission
    assert takeoff == Item(22, 3, z=10.0)
    assert waypoint[:5] == (16, 3, 2.0, 0.0, 0.0)
    assert isnan(waypoint.param4)
    assert (waypoint.x, waypoint.y, waypoint.z) == (473_980_000, 85_460_000, 12.5)
    assert (speed.command, speed.frame, speed.param2) == (178, 2, 4.5)
    assert jump.param1 == 2


def test_a_fence_file_without_home_is_read_whole():
    rows = [f"{i}\t0\t3\t5001\t3\t0\t0\t0\t{47 + i}\t8.5\t0\t1" for i in range(3)]
    plan = parse_wpl("\n".join(["QGC WPL 110", *rows, "3 0 3 5100 0 0 0 0 47 8 30 1"]), "f")
    assert [i.x for i in plan.fence] == [470_000_000, 480_000_000, 490_000_000]
    assert len(plan.rally) == 1
    assert plan.mission == ()
    assert plan.home is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["QGC WPL 110"]),
        ("hello\n", ["QGC WPL 110", ".plan"]),
        ("QGC WPL 120\n", ["QGC WPL 110"]),
        ("QGC WPL 110\n1 0 3 16\n", [":2", "4 columns", "12"]),
        ("QGC WPL 110\n\n1 0 3 16 0 0 0 0 47 east 5 1\n", [":3", "y", "'east'"]),
        ("QGC WPL 110\n1 0 3 16 0 0 0 0 473977000 8 5 1\n", [":2", "x", "degrees"]),
        ("QGC WPL 110\n1 0 3 16 0 0 0 0 nan 8 5 1\n", [":2", "x"]),
        ("QGC WPL 110\n1 0 3 16 inf 0 0 0 47 8 5 1\n", [":2", "param1"]),
        ("QGC WPL 110\n1 0 3 1e99 0 0 0 0 47 8 5 1\n", [":2", "command"]),
        ("QGC WPL 110\n1 0 300 16 0 0 0 0 47 8 5 1\n", [":2", "frame"]),
        ("QGC WPL 110\n1.5 0 3 16 0 0 0 0 47 8 5 1\n", [":2", "seq"]),
    ],
)
def test_a_bad_wpl_file_is_refused_with_its_line(text, words):
    with pytest.raises(MissionError) as error:
        parse_wpl(text, "some.waypoints")
    for word in ["some.waypoints", *words]:
        assert word in str(error.value)


def test_a_plan_file_holds_everything():
    plan = parse(plan_file())
    assert plan.home == Place(47.3977, 8.5456, 488.0)
    assert [i.command for i in plan.mission] == [22, 16, 16, 206, 177, 20]
    assert isnan(plan.mission[0].param4)
    assert plan.mission[0].z == 20
    assert plan.mission[4].param1 == 2  # doJumpId 2 is item 2
    assert [i.autocontinue for i in plan.mission] == [1, 1, 1, 1, 1, 0]
    assert [(i.command, i.param1) for i in plan.fence] == [
        *[(5001, 3.0)] * 3,
        *[(5002, 4.0)] * 4,
        (5004, 12.5),
        (5000, 0.0),
    ]
    assert [(i.command, i.z) for i in plan.rally] == [(5100, 25.0)]
    MissionStore("quadcopter").load(plan)


def test_jump_ids_need_not_be_item_numbers():
    data = plan_file()
    data["mission"]["items"][3]["params"][0] = 10  # the id of RTL, item 6
    assert parse(data).mission[4].param1 == 6


def test_a_plan_without_fence_and_rally_is_one():
    data = plan_file()
    del data["geoFence"], data["rallyPoints"]
    plan = parse(data)
    assert plan.fence == plan.rally == ()


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (["mission", "items", 1, "params", 4], 95e9, ["items[1].params[4]", "out of range"]),
        (["mission", "items", 1, "params"], [1, 2], ["items[1].params", "7"]),
        (["mission", "items", 1, "params", 0], "two", ["items[1].params[0]", "'two'"]),
        (["mission", "items", 1, "params", 0], True, ["items[1].params[0]", "not a number"]),
        (["mission", "items", 1, "params", 0], 1e300, ["items[1].params[0]", "range"]),
        (["mission", "items", 1, "command"], 16.5, ["items[1].command", "whole"]),
        (["mission", "items", 1, "type"], "Mystery", ["items[1]", "'Mystery'"]),
        (["mission", "items", 3, "params", 0], 77, ["items[3]", "77"]),
        (["mission", "items"], {}, ["mission.items", "not a list"]),
        (["mission", "items", 2], {"type": "ComplexItem", "complexItemType": "StructureScan"},
         ["items[2]", "StructureScan"]),
        (["mission"], 5, ["mission", "items"]),
        (["fileType"], "Mission", ["no plan"]),
        (["geoFence", "polygons", 0, "polygon"], [[1, 1], [2, 2]], ["polygons[0]", "three"]),
        (["geoFence", "circles", 0, "circle", "radius"], -1, ["circles[0].circle.radius"]),
        (["geoFence", "circles", 0, "circle", "center"], [91, 0], ["center[0]", "range"]),
        (["rallyPoints", "points", 0], [1], ["points[0]", "latitude"]),
    ],
)  # fmt: skip
def test_a_bad_plan_file_is_refused_with_its_key(path, value, words):
    data = copy.deepcopy(plan_file())
    at = data
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = value
    with pytest.raises(MissionError) as error:
        parse(data)
    for word in ["some.plan", *words]:
        assert word in str(error.value)


@given(st.text(max_size=200))
def test_any_text_is_a_plan_or_a_mission_error(text):
    for parser, head in ((parse_plan, ""), (parse_wpl, "QGC WPL 110\n")):
        with contextlib.suppress(MissionError):
            parser(head + text, "f")


def test_files_are_told_apart_by_what_is_in_them(tmp_path):
    (tmp_path / "a.txt").write_text(WPL)
    (tmp_path / "b.txt").write_text("﻿\n" + json.dumps(plan_file()), encoding="utf-8")
    assert len(read(tmp_path / "a.txt").mission) == 4
    assert len(read(tmp_path / "b.txt").mission) == 6


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    (tmp_path / "binary.plan").write_bytes(b"\xff\xfe\x00")
    for name in ("missing.plan", "binary.plan", "."):
        with pytest.raises(MissionError) as error:
            read(tmp_path / name)
        assert str(tmp_path) in str(error.value)


def test_what_is_written_is_read_again(tmp_path):
    plan = parse(plan_file())
    write_wpl(tmp_path / "out.waypoints", plan)
    again = read(tmp_path / "out.waypoints")
    assert again.home == plan.home
    assert repr(again.mission) == repr(plan.mission)
    assert again.fence == plan.fence
    assert again.rally == plan.rally


wire_float = st.floats(width=32, allow_infinity=False, min_value=-(2.0**100), max_value=2.0**100)


@given(
    st.lists(
        st.builds(
            Item,
            st.sampled_from([16, 18, 22, 178, 206]),
            st.sampled_from([0, 3, 10]),
            *(st.one_of(st.just(nan), wire_float) for _ in range(4)),
            st.integers(-900_000_000, 900_000_000),
            st.integers(-1_800_000_000, 1_800_000_000),
            wire_float,
            st.sampled_from([0, 1]),
        ),
        max_size=5,
    )
)
def test_writing_loses_nothing_that_the_wire_holds(items):
    again = parse_wpl(format_wpl(Plan(tuple(items))), "f").mission
    for one, other in zip(items, again, strict=True):
        assert (one.x, one.y, one.command, one.frame) == (
            other.x,
            other.y,
            other.command,
            other.frame,
        )
        for a, b in zip(one, other, strict=True):
            assert a == pytest.approx(b, rel=1e-8, abs=1e-30, nan_ok=True)
