"""A scenario means what it says: defaults, groups, names, overrides, and the way back to YAML."""

from itertools import combinations, pairwise, product
from math import dist, pi, radians
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.scenarios.dump import scenario_to_yaml
from mavherd.scenarios.loader import load_scenario, shipped
from mavherd.scenarios.paths import path_duration, reference
from mavherd.scenarios.schema import (
    Circle,
    Goto,
    Hold,
    Point,
    Rectangle,
    RobotSpec,
    Team,
    Waypoints,
)
from mavherd.transport.frames import Triple
from mavherd.vehicles.config import Disturbance

ONE = """\
    name: one
    robots:
      - {kind: rover, start: {east: 1, north: 2}}
    """

TEAM = """\
    name: team
    description: "Everything at once: yes"
    duration: 1e2
    seed: 7
    origin: {lat: -33.9, lon: 18.4, alt: 12}
    team:
      law: off
      rate_hz: 10
      start_sigma_m: 0.05
      takeoff_up: 3
      coordinators: per-robot
      law_params: {k_f: 3, k_r: 2.5}
    disturbance: held
    robots:
      - {name: a, kind: rover, system_id: 7, start: {east: 0, north: 0, heading_deg: 33.3},
         rectangle: {corner: {east: 0, north: 0}, width: 4, height: 3, clockwise: true}}
      - {name: b, kind: rover, start: {east: 8, north: 0}, then: stay,
         waypoints: {points: [{east: 8, north: 0}, {east: 9, north: 1}], speed: 0.25}}
      - {name: "1e3", kind: quadcopter, start: {east: 0, north: 9}, profile: paper, then: return,
         circle: {centre: {east: 0, north: 11, up: 2}, radius: 2, start_angle_deg: 77.7, laps: 2.5},
         params: {mass: 1.3, v_max: 2}, disturbance: {form: white, amplitude: 0.1}}
      - {name: d, kind: quadcopter, start: {east: 9, north: 9}, hold: {up: 4}, dwell_s: 2}
    expect: {collisions: 0, all_arrive_within_s: 90, tracking_rmse_m: {a: 0.2}, min_separation_m: 1}
    """


def test_a_scenario_needs_only_a_name_and_a_robot(load):
    scenario = load(ONE)
    (robot,) = scenario.robots
    assert (robot.name, robot.kind, robot.system_id) == ("rover1", "rover", 1)
    assert robot.path == Hold(at=Point(1.0, 2.0))
    assert scenario.team == Team()
    assert scenario.disturbance.form == "off"


def test_every_key_arrives_where_it_belongs(load):
    scenario = load(TEAM)
    a, b, c, d = scenario.robots
    assert (scenario.duration, scenario.seed, scenario.origin.lat_deg) == (100.0, 7, -33.9)
    assert scenario.team.law == "off"
    assert scenario.team.law_params == {"k_f": 3.0, "k_r": 2.5}
    assert scenario.disturbance == Disturbance(form="held")
    assert a.heading == radians(33.3)
    assert a.path == Rectangle(corner=Point(0, 0), width=4, height=3, clockwise=True)
    assert b.path == Waypoints(points=(Point(8, 0), Point(9, 1)), speed=0.25)
    assert isinstance(c.path, Circle)
    assert c.path.start_angle == pytest.approx(77.7 * pi / 180)
    assert c.disturbance == Disturbance(form="white", amplitude=0.1)
    assert d.path == Hold(at=Point(9, 9, 4))
    assert scenario.expect.tracking_rmse_m == {"a": 0.2}


def test_system_ids_follow_the_listing_and_skip_those_given(load):
    text = """\
        name: ids
        robots:
          - {kind: rover, start: {east: 0, north: 0}}
          - {kind: rover, start: {east: 5, north: 0}, system_id: 2}
          - {kind: rover, start: {east: 9, north: 0}}
        """
    assert [robot.system_id for robot in load(text).robots] == [1, 2, 3]
    assert [robot.system_id for robot in load(text, "robots.0.system_id=9").robots] == [9, 2, 1]


def test_nameless_robots_are_named_by_kind_around_the_names_in_use(load):
    text = """\
        name: names
        robots:
          - {kind: quadcopter, start: {east: 0, north: 0}}
          - {kind: quadcopter, start: {east: 3, north: 0}, name: quad2}
          - {kind: rover, start: {east: 6, north: 0}}
          - {kind: quadcopter, start: {east: 9, north: 0}}
          - {kind: rover, start: {east: 12, north: 0}, count: 2, name: rover}
        """
    names = [robot.name for robot in load(text).robots]
    assert names == ["quad1", "quad2", "rover3", "quad3", "rover1", "rover2"]


def test_a_group_moves_as_a_formation(load):
    text = """\
        name: group
        robots:
          - {kind: rover, count: 3, spacing: {east: 0, north: 2}, system_id: 11,
             start: {east: 1, north: 1}, goto: {east: 9, north: 1}}
        """
    robots = load(text).robots
    assert [robot.name for robot in robots] == ["rover1", "rover2", "rover3"]
    assert [robot.system_id for robot in robots] == [11, 12, 13]
    assert [robot.start for robot in robots] == [Point(1, 1), Point(1, 3), Point(1, 5)]
    assert [robot.path for robot in robots] == [Goto(target=Point(9, n)) for n in (1, 3, 5)]


def test_a_group_stands_on_a_square_grid_unless_told(load):
    text = "{name: g, robots: [{kind: quadcopter, count: 5, start: {east: 0, north: 0}}]}"
    starts = [(robot.start.east, robot.start.north) for robot in load(text).robots]
    assert starts == [(0, 0), (2, 0), (4, 0), (0, 2), (2, 2)]


def test_240_robots_load(load):
    text = "{name: g, robots: [{kind: quadcopter, count: 240, start: {east: 0, north: 0}}]}"
    assert load(text).robots[-1].system_id == 240


def test_merge_keys_and_anchors_work_and_own_keys_win(load):
    text = """\
        name: anchors
        robots:
          - &first {kind: rover, start: {east: 0, north: 0}, dwell_s: 3}
          - {<<: *first, start: {east: 5, north: 0}}
        """
    assert [robot.dwell_s for robot in load(text).robots] == [3.0, 3.0]
    assert load(text, "robots.0.dwell_s=1").robots[1].dwell_s == 3.0


@pytest.mark.parametrize(
    ("override", "read", "value"),
    [
        ("team.law=paper", lambda s: s.team.law, "paper"),
        ("duration=30", lambda s: s.duration, 30.0),
        ("robots.1e3.params.mass=1.4", lambda s: s.robots[2].params["mass"], 1.4),
        ("robots.2.params.mass=1.4", lambda s: s.robots[2].params["mass"], 1.4),
        ("robots[2].params.mass=1.4", lambda s: s.robots[2].params["mass"], 1.4),
        ("robots.a.params.mass=9", lambda s: s.robots[0].params, {"mass": 9.0}),
        ("robots.b.waypoints.points.1.north=5", lambda s: s.robots[1].path.points[1].north, 5.0),
        ("disturbance=off", lambda s: s.disturbance.form, "off"),
        (
            "disturbance.amplitude=1",
            lambda s: (s.disturbance.form, s.disturbance.amplitude),
            ("held", 1.0),
        ),
        ("expect={collisions: 3}", lambda s: s.expect.collisions, 3),
        ("expect=", lambda s: s.expect.collisions, None),
        ("team.law_params.k_f=-1e-3", lambda s: s.team.law_params["k_f"], -0.001),
    ],
)
def test_an_override_wins_over_the_file(load, override, read, value):
    assert read(load(TEAM, override)) == value


def test_overrides_reach_a_group_and_each_of_its_robots(load):
    text = "{name: g, robots: [{name: q, kind: quadcopter, count: 2, start: {east: 0, north: 0}}]}"
    robots = load(text, "robots.q3.dwell_s=4", "robots.q.count=3", "robots.q.then=return").robots
    assert [robot.dwell_s for robot in robots] == [0.0, 0.0, 4.0]
    assert {robot.then for robot in robots} == {"return"}


def test_the_last_override_wins_and_the_seed_argument_over_all(load):
    assert load(ONE, "seed=3", "seed=4").seed == 4
    assert load(ONE, "seed=3", seed=5).seed == 5


def test_a_rate_is_rounded_to_a_whole_number_of_slices(load):
    assert load(ONE, "team.rate_hz=33.3333").team.rate_hz == 100 / 3


@pytest.mark.parametrize("text", [ONE, TEAM])
def test_yaml_of_a_scenario_loads_to_the_same_scenario(load, text):
    scenario = load(text)
    assert load(scenario_to_yaml(scenario)) == scenario


@given(st.floats(-360, 360))
def test_any_heading_survives_the_way_through_yaml(tmp_path_factory, heading):
    path = tmp_path_factory.getbasetemp() / "heading.yaml"
    start = f"robots.0.start={{east: 0, north: 0, heading_deg: {heading:.17g}}}"
    scenario = load_scenario("one-rover", [start])
    path.write_text(scenario_to_yaml(scenario))
    assert load_scenario(path) == scenario


def test_loading_twice_gives_the_same(load):
    assert load(TEAM) == load(TEAM)


def test_all_shipped_scenarios_load_teach_and_survive_the_way_through_yaml(load):
    names = {name for name, description in shipped() if description}
    assert names == {"tracking", "crossing-targets", "circle-traffic", "one-quad", "one-rover"}
    for name in names:
        scenario = load_scenario(name)
        assert scenario.name == name
        assert scenario.disturbance.form == "off"
        assert scenario.expect.collisions == 0
        assert load(scenario_to_yaml(scenario)) == scenario


def test_shipped_files_open_with_comments():
    folder = Path(__file__).parents[2] / "scenarios" / "shipped"
    for path in folder.glob("*.yaml"):
        assert path.read_text().startswith("# "), path


def test_a_shipped_name_loads_even_beside_a_folder_of_that_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("tracking").mkdir()
    assert load_scenario("tracking").name == "tracking"


def test_the_missions_have_the_geometry_of_the_paper():
    crossing = {robot.name: robot for robot in load_scenario("crossing-targets").robots}
    for i, place in enumerate((4.0, 7.0, 10.0), start=1):
        rover, quad = crossing[f"rover{i}"], crossing[f"quad{i}"]
        assert rover.start == Point(-1.3 * (i - 1), -1.3 * (i - 1))
        assert quad.start.east == pytest.approx(-4 - 1.3 * (i - 1))
        assert rover.path == Goto(target=Point(place, place))
        assert quad.path == Goto(target=Point(place, place, 3.0))
        assert (rover.heading, quad.heading) == (pi / 4, pi / 4)
        assert quad.then == "return"
    traffic = {robot.name: robot for robot in load_scenario("circle-traffic").robots}
    radii = {name: r.path.radius for name, r in traffic.items() if isinstance(r.path, Circle)}
    assert radii == {"rover1": 3.0, "rover2": 3.0, "quad1": 2.0}
    assert traffic["rover3"].path == Goto(target=Point(0, 0))
    assert traffic["quad2"].path == Hold(at=Point(2, 0, 2))
    assert traffic["quad3"].path == Hold(at=Point(0, 2, 2))


def test_the_four_tracks_keep_well_apart():
    scenario = load_scenario("tracking")
    for one, other in combinations(scenario.robots, 2):
        for t, u in product(range(30), repeat=2):
            here = reference(one.path, one, scenario.team, t).position
            there = reference(other.path, other, scenario.team, u).position
            assert dist(here[:2], there[:2]) > 2.9


def test_the_circles_meet_oncoming_traffic_and_both_posts():
    scenario = load_scenario("circle-traffic")
    rover1, rover2, _, quad1, *posts = scenario.robots

    def gaps(one: RobotSpec, other: RobotSpec) -> list[float]:
        def at(robot: RobotSpec, t: float) -> Triple:
            return reference(robot.path, robot, scenario.team, t).position

        return [dist(at(one, i / 10), at(other, i / 10)) for i in range(450)]

    def meetings(gaps: list[float]) -> int:
        return sum(a >= 0.5 > b for a, b in pairwise(gaps))

    assert meetings(gaps(rover1, rover2)) == 2
    assert [meetings(gaps(quad1, post)) for post in posts] == [1, 1]
    times = [(path_duration(robot.path) or 0) + robot.dwell_s for robot in (rover1, rover2, quad1)]
    assert all(40 < time < 45 for time in times)
