"""The store keeps three lists apart and takes plans whole or not at all."""

import pytest

from mavherd.vehicles.missions.items import Item, MissionType
from mavherd.vehicles.missions.plan import MissionError, Place, Plan
from mavherd.vehicles.missions.shapes import (
    FenceCircle,
    FencePolygon,
    fence_shapes,
    rally_points,
)
from mavherd.vehicles.missions.store import LIMITS, MissionStore

HERE = {"x": 473_977_000, "y": 85_456_000, "z": 10.0}
WAYPOINT, CORNER = Item(16, **HERE), Item(5001, param1=3, **HERE)
JUMP = Item(177, param1=1, param2=2)


def test_lists_are_replaced_whole_and_say_so():
    store = MissionStore("quadcopter")
    store.replace(MissionType.FENCE, [CORNER] * 3)
    assert len(store.fence) == 3
    assert len(store.mission) == len(store.rally) == 0
    before = store.fence.revision
    store.replace(MissionType.FENCE, ())
    assert store.fence.revision > before


def test_a_list_has_a_limit():
    store = MissionStore("rover")
    with pytest.raises(ValueError, match="at most"):
        store.mission.replace([WAYPOINT] * (LIMITS[MissionType.MISSION] + 1))


def test_a_plan_fills_all_lists():
    store = MissionStore("quadcopter")
    store.load(Plan((WAYPOINT, JUMP), (CORNER,) * 3, (Item(5100, **HERE),)))
    assert [len(x) for x in store.lists.values()] == [2, 3, 1]
    assert store.mission.items[1].param1 == 1


def test_jumps_of_a_plan_are_counted_as_the_ground_counts():
    store = MissionStore("quadcopter", home_is_item_0=False)
    store.load(Plan((WAYPOINT, JUMP)))
    assert store.mission.items[1].param1 == 0


@pytest.mark.parametrize(
    ("kind", "plan", "words"),
    [
        ("rover", Plan((WAYPOINT, Item(22, **HERE))), ["mission item 2", "22", "rover"]),
        ("quadcopter", Plan((WAYPOINT._replace(frame=8),)), ["mission item 1", "frame"]),
        ("quadcopter", Plan((), (CORNER,) * 2), ["fence", "3 corners"]),
        ("quadcopter", Plan((), (), (Item(5100, **HERE),) * 101), ["rally", "at most 100"]),
    ],
)
def test_a_plan_that_is_refused_changes_nothing(kind, plan, words):
    store = MissionStore(kind)
    store.load(Plan((WAYPOINT,)))
    with pytest.raises(MissionError) as error:
        store.load(plan, "survey.plan")
    for word in ["survey.plan", *words]:
        assert word in str(error.value)
    assert store.mission.items == (WAYPOINT,)


def test_the_current_item_is_set_by_the_grounds_number():
    with_home, without = MissionStore("rover"), MissionStore("rover", home_is_item_0=False)
    for store in (with_home, without):
        assert not store.set_current(0)  # no mission
        store.load(Plan((WAYPOINT,) * 3))
    assert with_home.set_current(3)
    assert with_home.progress.shown == 2
    assert with_home.set_current(0)  # home: the beginning
    assert with_home.progress.shown == 0
    assert not with_home.set_current(4)
    assert without.set_current(2)
    assert without.progress.shown == 2
    assert not without.set_current(3)
    assert not without.set_current(-1)


def test_a_reset_forgets_the_jumps():
    store = MissionStore("rover")
    store.load(Plan((WAYPOINT, JUMP)))
    store.progress.jumps[1] = 2
    store.set_current(1)
    assert store.progress.jumps
    store.set_current(1, reset=True)
    assert not store.progress.jumps


def test_fence_and_rally_lists_become_shapes():
    a, b, c = (CORNER._replace(x=x) for x in (1, 2, 3))
    hole = [i._replace(command=5002) for i in (c, b, a)]
    ring = Item(5003, param1=25.0, x=10_000_000, y=20_000_000)
    back = Item(5000, x=10_000_000, y=-20_000_000, z=30.0)
    shapes = fence_shapes([a, b, c, ring, *hole, back])
    assert shapes.circles == (FenceCircle(True, 1.0, 2.0, 25.0),)
    assert shapes.return_point == Place(1.0, -2.0, 30.0)
    outer, inner = shapes.polygons
    assert outer == FencePolygon(True, tuple((i.lat_deg, i.lon_deg) for i in (a, b, c)))
    assert not inner.inclusion
    assert rally_points([back]) == (Place(1.0, -2.0, 30.0),)
