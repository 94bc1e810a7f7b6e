"""A plan numbers its runs, knows the command that repeats each, and is found again."""

import shlex
from dataclasses import replace
from pathlib import Path

import pytest

from mavherd.gcs.sweep.grid import Axis
from mavherd.gcs.sweep.plan import (
    MAX_POINTS,
    Plan,
    check_size,
    difference,
    fingerprint,
    load_points,
    plan_from_json,
    plan_to_json,
)
from mavherd.scenarios.loader import load_scenario
from mavherd.transport.errors import MavherdError

HERE = Path("sweep.json")
TWO = Plan(
    scenario="crossing-targets",
    sets=("duration=90",),
    grid=(Axis("team.law", ("paper", "safe")), Axis("team.rate_hz", ("10", "20", "25"))),
    seeds=(0, 1, 7),
)


def test_every_point_gets_its_first_seed_before_any_gets_its_second():
    jobs = [TWO.job(number) for number in range(TWO.runs)]
    assert len(jobs) == 18
    assert [(job.point, job.seed) for job in jobs[:7]] == [*((p, 0) for p in range(6)), (0, 1)]
    assert len({(job.point, job.seed) for job in jobs}) == 18


def test_the_last_axis_changes_fastest():
    assert [tuple(TWO.settings(point).values()) for point in range(4)] == [
        ("paper", "10"),
        ("paper", "20"),
        ("paper", "25"),
        ("safe", "10"),
    ]
    assert list(TWO.settings(0)) == ["team.law", "team.rate_hz"]


def test_a_plan_without_a_grid_has_one_point():
    plan = Plan(scenario="one-quad", seeds=(3,))
    assert (plan.points, plan.runs, plan.settings(0)) == (1, 1, {})


def test_the_command_names_a_run_so_that_it_loads_as_the_same_scenario(dash):
    plan = Plan(
        scenario=str(dash),
        grid=(Axis("robots.r1.goto", ("{east: 2, north: 0}", "{east: 3, north: 0}")),),
        sets=("description='it''s, quoted'",),
        seeds=(5, 6),
    )
    points = load_points(plan, dash)
    program, verb, source, *options = shlex.split(plan.command(1, 6, str(dash)))
    assert (program, verb) == ("mavherd", "run")
    sets = [text for flag, text in zip(options[::2], options[1::2], strict=True) if flag == "--set"]
    assert options[:2] == ["--seed", "6"]
    assert load_scenario(source, sets, 6) == replace(points[1], seed=6)


def test_a_plan_survives_its_file(planned):
    plan, points = planned(seeds=(0, 1, 2, 9), sets=("duration=20",), law=("off", "safe"))
    assert plan_from_json(plan_to_json(plan, points), HERE) == plan


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"schema": 1}', "null", '{"schema": 1, "version": "1", "grid": 3}']
)
def test_a_file_that_is_no_plan_is_named(text):
    with pytest.raises(MavherdError, match=r"sweep\.json: not one of mavherd's plans"):
        plan_from_json(text, HERE)


def test_a_plan_of_another_schema_says_by_whom():
    with pytest.raises(MavherdError, match=r"another version of mavherd, 9\.9"):
        plan_from_json('{"schema": 99, "version": "9.9"}', HERE)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"seeds": (0, 1)}, "--seeds is 0,1, not 0,1,7"),
        ({"grid": TWO.grid[:1]}, "--set team.rate_hz is not varied, not 10,20,25"),
        ({"grid": (*TWO.grid, Axis("duration", ("9", "8")))}, "--set duration is 9,8, not fixed"),
        ({"grid": TWO.grid[::-1]}, "the grid's order is team.rate_hz, team.law"),
        ({"sets": ()}, "--set is nothing, not duration=90"),
        ({"mode": "processes"}, "mode is processes, not in-process"),
        ({"version": "7"}, "version is 7"),
        ({"scenario": "tracking", "fingerprint": "x"}, "scenario is tracking, not crossing"),
        ({"fingerprint": "x"}, "the scenario itself has changed"),
    ],
)
def test_two_plans_differ_by_name(change, said):
    assert said in difference(TWO, replace(TWO, **change))


def test_the_same_plan_does_not_differ_however_its_file_is_called():
    assert not difference(TWO, replace(TWO, scenario="./elsewhere/crossing-targets.yaml"))


def test_a_changed_scenario_has_another_fingerprint(planned):
    plan, points = planned()
    other = load_points(replace(plan, sets=("robots.r2.goto.east=1.001",)), plan.scenario)
    assert fingerprint(points) != fingerprint(other)


def test_too_many_grid_points_or_runs_are_refused():
    digits = tuple(map(str, range(22)))
    wide = Plan(scenario="x", grid=tuple(Axis(k, digits) for k in "abc"), seeds=(0,))
    assert wide.points > MAX_POINTS
    with pytest.raises(MavherdError, match="22 x 22 x 22 = 10,648 grid points"):
        check_size(wide)
    with pytest.raises(MavherdError, match=r"22 grid points x 50,000 seeds = 1,100,000 runs"):
        check_size(replace(wide, grid=wide.grid[:1], seeds=tuple(range(50_000))))
    check_size(replace(wide, grid=wide.grid[:2], seeds=tuple(range(2000))))


@pytest.mark.parametrize(
    ("axis", "said"),
    [
        (Axis("team.lwa", ("safe", "off")), "team: unknown key 'lwa'"),
        (Axis("team.law", ("safe", "paprika")), "unknown law 'paprika' (did you mean 'paper'?"),
        (Axis("team.rate_hz", ("20", "33")), "33 Hz has a period of"),
        (Axis("robots.r9.goto.east", ("1", "2")), "robots has no 'r9'"),
        (Axis("team.law_params.no_such", ("1", "2")), "unknown parameter 'no_such'"),
        (Axis("duration", ("30", "30.0")), "duration=30.0 is the same scenario as another"),
        (
            Axis("robots.r1.connect", ("null", "'udpin:127.0.0.1:14550'")),
            "r1: external vehicles follow a clock of their own",
        ),
    ],
)
def test_every_grid_point_is_checked_before_anything_runs(dash, axis, said):
    plan = Plan(scenario=str(dash), grid=(axis,), seeds=(0,))
    with pytest.raises(MavherdError) as error:
        load_points(plan, dash)
    assert said in str(error.value)
