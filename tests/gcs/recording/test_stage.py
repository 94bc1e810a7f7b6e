"""The stage is what the scenario says, at the starts which its seed draws."""

from itertools import pairwise
from math import dist, pi

import pytest

from mavherd.gcs.recording.stage import MANY, WAY_POINTS, StagedRobot, read_stage, stage_of
from mavherd.scenarios.dump import scenario_to_yaml
from mavherd.scenarios.loader import draw_starts, load_scenario
from mavherd.scenarios.schema import (
    Circle,
    Goto,
    Hold,
    Point,
    Rectangle,
    RobotSpec,
    Scenario,
    Team,
    Waypoints,
)


def staged(path, kind="quadcopter") -> StagedRobot:
    spec = RobotSpec(name="a", kind=kind, system_id=1, start=Point(1, 2), path=path)
    (robot,) = stage_of(
        Scenario(name="s", robots=(spec,), team=Team(start_sigma_m=0.0, takeoff_up=2.5))
    ).robots
    return robot


def test_a_folder_tells_the_stage_of_its_run(tmp_path):
    scenario = load_scenario("crossing-targets", seed=7)
    (tmp_path / "scenario.yaml").write_text(scenario_to_yaml(scenario))
    stage = read_stage(tmp_path)
    drawn = draw_starts(scenario)
    assert (stage.title, stage.law, stage.stale_s) == ("crossing-targets", "safe", 1.0)
    assert [robot.start[:2] for robot in stage.robots] == [
        pytest.approx((spec.start.east, spec.start.north)) for spec in drawn
    ]
    assert stage.kinds == {spec.name: spec.kind for spec in drawn}
    assert stage.origin == scenario.origin
    assert not stage.crowded


def test_more_robots_than_can_be_looked_at_one_by_one_are_a_crowd():
    robots = tuple(
        RobotSpec(name=f"r{i}", kind="rover", system_id=i + 1, start=Point(3 * i, 0))
        for i in range(MANY + 1)
    )
    assert stage_of(Scenario(name="many", robots=robots)).crowded
    assert not stage_of(Scenario(name="few", robots=robots[:-1])).crowded


def test_who_holds_has_no_way_and_who_goes_has_one_from_above_the_start():
    assert staged(Hold()).path == ()
    assert staged(Hold()).target == (1, 2, 2.5)
    robot = staged(Goto(target=Point(5, 2)))
    assert robot.path == ((1, 2, 2.5), (5, 2, 2.5))
    assert robot.target == (5, 2, 2.5)
    assert staged(Goto(target=Point(5, 2)), kind="rover").path == ((1, 2, 0), (5, 2, 0))


@pytest.mark.parametrize("laps", [0.25, 1.0, 3.0])
def test_a_circles_way_is_as_long_as_its_arc_but_once_round_at_most(laps):
    way = staged(Circle(centre=Point(0, 0), radius=2.0, laps=laps)).path
    length = sum(dist(a, b) for a, b in pairwise(way))
    assert length == pytest.approx(min(laps, 1.0) * 2 * pi * 2.0, rel=1e-3)
    assert {round(dist(p, (0, 0, 2.5)), 6) for p in way} == {2.0}


def test_a_rectangle_has_its_corners_and_waypoints_are_thinned():
    corners = staged(Rectangle(corner=Point(0, 0), width=3, height=1)).path
    assert [p[:2] for p in corners] == [(0, 0), (3, 0), (3, 1), (0, 1), (0, 0)]
    points = tuple(Point(0.1 * i, 0) for i in range(1001))
    way = staged(Waypoints(points=points)).path
    assert len(way) <= WAY_POINTS
    assert way[0][0] == 0
    assert way[-1][0] == pytest.approx(100)
