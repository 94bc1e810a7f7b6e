"""A row says of a run what its report says, in columns that all grid points share."""

from dataclasses import replace

import pytest

from mavherd.gcs.run.in_process import simulate
from mavherd.gcs.sweep.columns import columns, result_row, settings_row
from mavherd.gcs.sweep.grid import Axis
from mavherd.gcs.sweep.plan import Plan, load_points
from mavherd.scenarios.loader import load_scenario


def kinds_of(plan, points):
    described = columns(plan, points)
    names = [column.name for column in described]
    assert len(set(names)) == len(names)
    return {column.name: column.kind for column in described}


def test_a_row_is_made_of_the_report_and_fits_the_columns(planned):
    plan, points = planned(law=("off", "safe"))
    report = simulate(points[1]).report
    row = result_row(points[1], report)
    assert set(row) <= set(kinds_of(plan, points))
    arrivals = {robot["name"]: robot["arrival_s"] for robot in report["robots"]}
    assert (row["arrival_r1_s"], row["arrival_r2_s"]) == (arrivals["r1"], arrivals["r2"])
    assert row["last_arrival_s"] == max(arrivals.values())
    assert row["arrived"] == 2
    assert row["min_separation_rover_rover_m"] == report["min_separation_m"]
    assert (row["passed"], row["assertions_failed"], row["collisions"]) == (True, None, 0)
    assert row["digest"] == report["digest"]


def test_a_robot_that_did_not_arrive_leaves_no_last_arrival(planned):
    _, (scenario,) = planned()
    report = simulate(replace(scenario, duration=1.5)).report
    row = result_row(scenario, report)
    assert (row["exit_code"], row["all_arrived"], row["last_arrival_s"]) == (4, False, None)
    assert "timed out" in row["error"]


def test_assertions_that_failed_are_named(planned):
    _, (scenario,) = planned(sets=("expect={min_separation_m: 9, all_arrive_within_s: 0.5}",))
    row = result_row(scenario, simulate(scenario).report)
    assert row["assertions_failed"] == "all_arrive_within_s, min_separation_m"
    assert (row["passed"], row["exit_code"]) == (False, 1)


def test_a_run_without_a_verdict_is_its_error(planned):
    _, (scenario,) = planned()
    report = simulate(scenario).report | {"exit_code": 3, "error": "r1: lost"}
    assert result_row(scenario, report) == {"passed": False, "exit_code": 3, "error": "r1: lost"}


def test_trackers_have_an_rmse_and_those_who_go_an_arrival():
    plan = Plan(scenario="tracking", seeds=(0,))
    kinds = kinds_of(plan, [load_scenario("tracking"), load_scenario("crossing-targets")])
    assert {"rmse_quad1_m", "rmse_rover2_m", "arrival_quad1_s", "arrival_rover3_s"} <= set(kinds)
    assert {"min_separation_mixed_m", "collisions_quadcopter_quadcopter"} <= set(kinds)


def test_grid_points_may_have_other_robots_than_others(dash):
    one = "[{{name: {}, kind: {}, start: {{east: 0, north: 0}}, goto: {{east: 1, north: 0}}}}]"
    robots = one.format("a", "rover"), one.format("b", "quadcopter")
    plan = Plan(scenario=str(dash), grid=(Axis("robots", robots),), seeds=(0,))
    kinds = kinds_of(plan, load_points(plan, dash))
    assert {"arrival_a_s", "arrival_b_s"} <= set(kinds)
    assert "min_separation_rover_rover_m" not in kinds


@pytest.mark.parametrize(
    ("values", "kind", "first"),
    [
        (("10", "20"), "int", 10),
        (("10", "12.5"), "float", 10.0),
        (("1e1", "20"), "float", 10.0),
        (("off", "held"), "text", "off"),
        (("true", "false"), "text", "true"),
        (("1", "off"), "text", "1"),
        (("[1, 2]", "[3]"), "text", "[1, 2]"),
        (("99999999999999999999", "1"), "float", 1e20),
    ],
)
def test_a_column_of_settings_holds_numbers_when_all_are(values, kind, first):
    plan = Plan(scenario="x", grid=(Axis("some.key", values),), seeds=(4,))
    kinds = kinds_of(plan, [])
    assert kinds["some.key"] == kind
    row = settings_row(plan, kinds, plan.job(0))
    assert row == {"run": 0, "seed": 4, "some.key": first}
    assert type(row["some.key"]) is {"int": int, "float": float, "text": str}[kind]
