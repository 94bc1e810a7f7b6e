"""Vehicles that somebody else has started, flight stacks and the fence, as a scenario has them."""

from pathlib import Path
from re import DOTALL, findall

import pytest

from mavherd.scenarios.dump import scenario_to_yaml
from mavherd.scenarios.loader import load_scenario
from mavherd.scenarios.paths import top_speed
from mavherd.scenarios.schema import Fence
from mavherd.scenarios.starts import MARGIN, contact_distance, draw_starts

MIXED = """\
    name: mixed
    team: {autopilot: px4, ready_timeout_s: 45, at_end: return, start_sigma_m: 0.6}
    fence: {east: [-20, 20], north: [-10, 30.5], up: 10}
    robots:
      - {name: real, kind: quadcopter, start: {east: 0, north: 0}, connect: tcp:127.0.0.1:5760,
         max_speed: 2.5, goto: {east: 3, north: 3, up: 4}}
      - {name: known, kind: rover, start: {east: 0, north: 5}, connect: "udpin:0.0.0.0:14550",
         autopilot: ardupilot}
      - {name: ours, kind: quadcopter, start: {east: 1.2, north: 0}, hold: {east: 9, north: 9}}
      - {name: other, kind: quadcopter, start: {east: 9, north: 0}, autopilot: generic}
    """


def test_external_robots_and_flight_stacks_arrive_where_they_belong(load):
    scenario = load(MIXED)
    real, known, ours, other = scenario.robots
    assert [spec.connect for spec in scenario.robots] == [
        "tcp:127.0.0.1:5760",
        "udpin:0.0.0.0:14550",
        None,
        None,
    ]
    assert [spec.external for spec in scenario.robots] == [True, True, False, False]
    stacks = [spec.autopilot for spec in (real, known, ours, other)]
    assert stacks == ["auto", "ardupilot", "px4", "generic"]
    assert (scenario.team.ready_timeout_s, scenario.team.at_end) == (45.0, "return")
    assert scenario.fence == Fence(east=(-20, 20), north=(-10, 30.5), up=10)


def test_the_team_s_flight_stack_is_for_those_of_ours_that_name_none(load):
    stacks = [spec.autopilot for spec in load(MIXED, "team.autopilot=ardupilot").robots]
    assert stacks == ["auto", "ardupilot", "ardupilot", "generic"]


def test_external_robots_survive_the_way_through_yaml(load):
    scenario = load(MIXED)
    assert load(scenario_to_yaml(scenario)) == scenario


def test_a_shipped_scenario_takes_a_real_vehicle_by_override():
    scenario = load_scenario("crossing-targets", ["robots.quad2.connect=udpin:127.0.0.1:14550"])
    assert [spec.name for spec in scenario.robots if spec.external] == ["quad2"]


def test_coordination_counts_with_the_speed_that_is_given_else_with_that_of_ours(load):
    real, known, ours, _ = load(MIXED, "robots.ours.max_speed=0.7").robots
    assert top_speed(real) == 2.5
    assert top_speed(ours) == 0.7
    assert top_speed(known) == top_speed(load_scenario("one-rover").robots[0])


def test_parameters_have_the_names_of_the_robot_s_own_flight_stack(load):
    ours = load(MIXED, "robots.ours.params.MPC_Z_VEL_MAX_UP=1.5").robots[2]
    assert ours.params == {"MPC_Z_VEL_MAX_UP": 1.5}
    assert top_speed(ours) == top_speed(load_scenario("one-quad").robots[0])


def test_a_path_may_be_as_fast_as_a_real_vehicle_but_no_faster(load, refused):
    path = "robots.known.rectangle={corner: {east: 0, north: 5}, width: 9, height: 9, speed: 1.8}"
    load(MIXED, path, "robots.known.max_speed=1.8")
    text = refused(MIXED, path, "robots.known.max_speed=1.7")
    assert "1.8 m/s is more than this rover can do (its max_speed is 1.7)" in text


def test_external_robots_stand_where_they_stand_and_ours_keep_clear_of_them(load):
    for seed in range(60):
        scenario = load(MIXED, "fence.east=[-0.3, 9.4]", seed=seed)
        drawn = draw_starts(scenario)
        assert drawn[:2] == scenario.robots[:2]
        assert drawn[2].start != scenario.robots[2].start
        for real in drawn[:2]:
            apart = drawn[2].start.east - real.start.east, drawn[2].start.north - real.start.north
            assert sum(d * d for d in apart) ** 0.5 >= contact_distance(drawn[2], real) + MARGIN
        assert all(-0.3 <= spec.start.east <= 9.4 for spec in drawn)


def test_some_addresses_may_be_shared(load, refused):
    same = "robots.known.connect=tcp:127.0.0.1:5760"
    assert "tcp:127.0.0.1:5760 is already the address of 'real'" in refused(MIXED, same)
    assert "both a `system_id`" in refused(MIXED, same, "robots.real.system_id=3")
    load(MIXED, same, "robots.real.system_id=3", "robots.known.system_id=4")  # a router
    load(MIXED, "robots.real.connect=udpin:0.0.0.0:14550")  # told apart by their system ids
    serial = "robots.{}.connect=serial:/dev/ttyUSB0{}".format
    assert "is already" in refused(MIXED, serial("real", ""), serial("known", ":115200"))


def test_a_group_shares_the_address_it_listens_on(load):
    swarm = "connect: 'udpin:0.0.0.0:14550', start: {east: 0, north: 0}}]}"
    robots = load("{name: g, robots: [{kind: rover, count: 3, " + swarm).robots
    assert {spec.connect for spec in robots} == {"udpin:0.0.0.0:14550"}
    assert [spec.system_id for spec in robots] == [1, 2, 3]


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ("robots.real.connect=tcp:5760", "robots[0].connect: 'tcp:5760': the host is missing"),
        ("robots.real.connect=udp:0.0.0.0:14550", "did you mean 'udpin:0.0.0.0:14550'?"),
        ("robots.real.connect=5760", "robots[0].connect: must be text, got 5760"),
        ("robots.real.profile=paper", "robots[0].profile: cannot be given to a vehicle with"),
        ("robots.real.params.mass=2", "robots[0].params: cannot be given to a vehicle with"),
        ("robots.real.disturbance=held", "remove it here and set it on the vehicle"),
        ("robots.real.kind=", "robots[0].kind: is missing"),
        ("robots.real.start=", "robots[0].start: is missing"),
        ("robots.real.autopilot=generic", "(one of: ardupilot, px4, auto)"),
        ("robots.real.max_speed=0", "robots[0].max_speed: must be positive"),
        ("robots.ours.autopilot=auto", "or give `connect` for an external vehicle"),
        ("robots.ours.autopilot=px5", "unknown autopilot 'px5' (did you mean 'px4'?)"),
        ("robots.ours.max_speed=9", "robots[2].max_speed: 9 m/s is more than this quadcopter"),
        ("robots.ours.params.GUID_TIMEOUT=1", "unknown parameter of a quadcopter"),
        ("team.autopilot=auto", "team.autopilot: unknown autopilot 'auto'"),
        ("team.at_end=crash", "team.at_end: unknown at_end 'crash' (one of: land, hold, return)"),
        ("team.ready_timeout_s=0", "team.ready_timeout_s: must be positive"),
        ("team.rate_hz=5", "robots[0].connect: team.rate_hz is 5, too slow to steer a real"),
        ("fence={east: [-20, 20], up: 10}", "fence.north: is missing"),
        ("fence.east=20", "fence.east: must be a list, got 20"),
        ("fence.east=[20]", "fence.east: must be two numbers, got 1 (as in [-20, 20])"),
        ("fence.east=[20, -20]", "fence.east: must rise, got 20 to -20"),
        ("fence.east=[-20, far]", "fence.east.1: must be a number, got 'far'"),
        ("fence.west=3", "fence: unknown key 'west' (did you mean 'east'?)"),
        ("fence.up=0", "fence.up: must be 0.3..10000"),
        (
            "fence.up=3",
            "robots[0].goto: 'real' is sent outside the fence, at east 3, north 3, up 4",
        ),
        ("fence.east=[-1, 8.9]", "robots[2].hold: 'ours' is sent outside the fence"),
        ("fence.north=[0.5, 20]", "robots[0].start: 'real' starts outside the fence"),
        (
            "robots.other.circle={centre: {east: 9, north: 0}, radius: 11.5}",
            "robots[3].circle: 'other' is sent outside the fence, at east 20.5, north 0",
        ),
        (
            "robots.other.rectangle={corner: {east: 9, north: 0}, width: 4, height: 31}",
            "robots[3].rectangle: 'other' is sent outside the fence, at east 13, north 31, up 2"
            " (fence: east -20 to 20, north -10 to 30.5, up to 10 m)",
        ),
        (
            "robots.other.waypoints={points: [{east: 0, north: 0}, {east: 9, north: -11}]}",
            "robots[3].waypoints: 'other' is sent outside the fence",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_its_cure(refused, change, complaint):
    assert complaint in refused(MIXED, change)


def test_the_team_of_the_docs_loads_and_stands_where_its_simulators_are_put(load):
    page = (Path(__file__).parents[2] / "docs" / "external.md").read_text()
    (team,) = findall(r"```yaml\n(.*?)```", page, DOTALL)
    scenario = load(team)
    assert [spec.autopilot for spec in scenario.robots] == ["auto"] * 3
    homes = findall(r"--home ([\d.]+),([\d.]+)", page)
    homes += findall(r"PX4_HOME_LAT=([\d.]+) PX4_HOME_LON=([\d.]+)", page)
    for spec, (lat, lon) in zip(scenario.robots, homes, strict=True):
        north, east = scenario.origin.from_geodetic(float(lat), float(lon))
        assert (east, north) == pytest.approx((spec.start.east, spec.start.north), abs=0.05)
