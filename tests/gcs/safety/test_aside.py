"""A copter is not landed on somebody: it goes where nobody is."""

from math import dist

import pytest

from mavherd.gcs.safety.aside import COPTER_ROOM, ROVER_ROOM, below, place_aside
from mavherd.scenarios.schema import Fence
from mavherd.transport.wire import Phase, VehicleState

ROVERS = ("rover1", "rover2")


def team(**places):
    level = (1.0, 0.0, 0.0, 0.0)
    return {
        name: VehicleState(name, i, 0, 0.0, place, (0.0, 0.0, 0.0), level, 4, True, Phase.ACTIVE)
        for i, (name, place) in enumerate(places.items())
    }


@pytest.mark.parametrize(
    ("places", "who"),
    [
        ({"rover1": (0.85, 0, 0)}, "rover1"),
        ({"rover1": (0.95, 0, 0)}, ""),
        ({"quad2": (0.55, 0, 2)}, "quad2"),
        ({"quad2": (0.65, 0, 2)}, ""),
        ({"quad2": (0.1, 0, 4)}, ""),  # above: it waits for us
        ({"quad2": (5, 0, 0), "rover1": (0, 0.2, 0)}, "rover1"),
    ],
)
def test_who_is_below_is_in_the_way(places, who):
    everybody = team(quad1=(0, 0, 3), **places)
    assert below(everybody["quad1"], everybody, ROVERS) == who


def test_the_place_aside_is_near_at_the_same_height_and_clear_of_everybody():
    everybody = team(quad1=(0, 0, 3), rover1=(0.2, 0, 0), rover2=(-1.5, 0, 0), quad2=(0, 1.5, 5))
    place = place_aside(everybody["quad1"], everybody, ROVERS, None)
    assert place[2] == 3
    assert dist(place[:2], (0, 0)) < 2
    for name, room in (("rover1", ROVER_ROOM), ("rover2", ROVER_ROOM), ("quad2", COPTER_ROOM)):
        assert dist(place[:2], everybody[name].position[:2]) > room


def test_the_place_aside_is_inside_the_fence():
    everybody = team(quad1=(0, 0, 3), rover1=(-0.2, 0, 0))
    fence = Fence(east=(-5, 0.4), north=(-0.5, 5), up=10)
    east, north, _ = place_aside(everybody["quad1"], everybody, ROVERS, fence)
    assert fence.holds((east, north, 0))
    narrow = Fence(east=(-0.4, 0.4), north=(-0.4, 0.4), up=10)
    assert place_aside(everybody["quad1"], everybody, ROVERS, narrow) is None
