"""The seed moves the starts a little, the same way every time, and nobody into anybody."""

from dataclasses import replace
from itertools import combinations
from math import hypot, sqrt
from statistics import fmean

import pytest

from mavherd.scenarios.errors import ScenarioError
from mavherd.scenarios.loader import load_scenario
from mavherd.scenarios.paths import reference
from mavherd.scenarios.schema import Hold, Point, RobotSpec, Scenario
from mavherd.scenarios.starts import MARGIN, contact_distance, draw_starts

CROSSING = load_scenario("crossing-targets")


def offsets(scenario: Scenario) -> list[float]:
    pairs = zip(scenario.robots, draw_starts(scenario), strict=True)
    return [
        d
        for nominal, drawn in pairs
        for d in (drawn.start.east - nominal.start.east, drawn.start.north - nominal.start.north)
    ]


def test_one_seed_one_draw_another_seed_another():
    assert draw_starts(CROSSING) == draw_starts(CROSSING)
    assert draw_starts(CROSSING) != draw_starts(replace(CROSSING, seed=2))


def test_a_draw_is_the_same_in_every_process_and_on_every_machine():
    assert offsets(CROSSING)[:2] == pytest.approx([0.1784181111540253, -0.07973860068632976])


def test_offsets_have_the_sigma_that_was_asked_for():
    drawn = [d for seed in range(200) for d in offsets(replace(CROSSING, seed=seed))]
    assert abs(fmean(drawn)) < 0.02
    assert sqrt(fmean(d * d for d in drawn)) == pytest.approx(0.2, rel=0.05)


def test_drawn_bodies_keep_the_margin():
    for seed in range(100):
        for one, other in combinations(draw_starts(replace(CROSSING, seed=seed)), 2):
            gap = hypot(one.start.east - other.start.east, one.start.north - other.start.north)
            assert gap >= contact_distance(one, other) + MARGIN


def test_only_the_start_is_drawn_and_sigma_zero_draws_nothing():
    for nominal, drawn in zip(CROSSING.robots, draw_starts(CROSSING), strict=True):
        assert replace(drawn, start=nominal.start) == nominal
    still = replace(CROSSING, team=replace(CROSSING.team, start_sigma_m=0.0))
    assert draw_starts(still) == still.robots


def test_a_robot_holds_over_its_nominal_place_wherever_it_was_drawn():
    spec = RobotSpec(name="q", kind="quadcopter", system_id=1, start=Point(3, 4), path=Hold())
    (drawn,) = draw_starts(Scenario(name="s", robots=(spec,)))
    assert drawn.start != spec.start
    assert reference(drawn.path, drawn, CROSSING.team, 0.0).position == (3, 4, 2)


def test_without_room_for_offsets_the_draw_says_so():
    rovers = tuple(
        RobotSpec(name=f"r{i}", kind="rover", system_id=i + 1, start=Point(0.8 * i, 0.8 * j))
        for i in range(6)
        for j in range(6)
    )
    with pytest.raises(ScenarioError, match=r"lower team\.start_sigma_m"):
        draw_starts(Scenario(name="crowd", robots=rovers))
