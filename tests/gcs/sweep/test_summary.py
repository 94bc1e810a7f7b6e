"""The summary counts what the rows say, and names the runs that are worth a look."""

import json
from io import StringIO
from math import inf

import pytest
from rich.console import Console

from mavherd.gcs.sweep.intervals import wilson
from mavherd.gcs.sweep.summary import Summary
from mavherd.gcs.sweep.summary_table import summary_table

GOOD = {
    "passed": True,
    "exit_code": 0,
    "collisions": 0,
    "collisions_rover_rover": 0,
    "min_separation_m": 3.0,
    "min_separation_rover_rover_m": 3.0,
    "all_arrived": True,
    "arrived": 2,
    "last_arrival_s": 10.0,
    "duration_s": 20.0,
    "wall_s": 0.5,
    "digest": "abc",
}
HIT = GOOD | {"passed": False, "exit_code": 1, "collisions": 2, "min_separation_m": 0.5}
LATE = GOOD | {
    "passed": False,
    "exit_code": 4,
    "error": "timed out",
    "all_arrived": False,
    "last_arrival_s": None,
}
FAR = GOOD | {"passed": False, "exit_code": 1, "assertions_failed": "tracking_rmse_m.r1"}
CRASHED = {"passed": False, "exit_code": 3, "error": "ValueError: x"}


@pytest.fixture
def summary(planned, table_of):
    """Return the summary of a sweep over two laws whose rows alternate: summary(off, safe)."""

    def make(off, safe):
        plan, points = planned(seeds=tuple(range(len(off))), law=("off", "safe"))
        rows = [row for pair in zip(off, safe, strict=True) for row in pair]
        return Summary(plan, points, table_of(plan, points, rows))

    return make


def test_rates_are_of_the_runs_with_a_verdict(summary):
    s = summary([HIT, HIT, GOOD, CRASHED], [GOOD, GOOD, LATE, GOOD])
    off, safe = s.rates(0), s.rates(1)
    assert off["collided"] == wilson(2, 3)
    assert off["passed"] == wilson(1, 3)
    assert safe["timed_out"] == wilson(1, 4)
    assert safe["all_arrived"] == wilson(3, 4)
    assert s.failed == 1


def test_medians_count_a_robot_that_never_arrived_as_later_than_all(summary):
    arrivals = [GOOD | {"last_arrival_s": float(t)} for t in range(5)]
    s = summary([*arrivals, LATE, LATE], [GOOD] * 7)
    assert sorted(s.values(0, "last_arrival_s").tolist()) == [0, 1, 2, 3, 4, inf, inf]
    assert s.medians(0)["last_arrival_s"].median == 3.0
    point = s.as_json("dash")["points"][0]["medians"]["last_arrival_s"]
    assert (point["median"], point["never"], point["greatest"]) == (3.0, 2, None)


def test_what_nobody_measured_has_no_median(summary):
    medians = summary([GOOD], [GOOD]).medians(0)
    assert medians["min_separation_m"].median == 3.0
    assert "max_rmse_m" not in medians


def test_the_worst_runs_are_collisions_first_in_turn_of_the_grid_points(summary):
    s = summary(
        [HIT, HIT | {"collisions": 5}, LATE, GOOD, GOOD],
        [GOOD, HIT | {"collisions": 1}, GOOD, GOOD | {"min_separation_m": 0.9}, FAR],
    )
    looks = s.as_json("dash.yaml")["worst"]
    assert [(x["set"]["team.law"], x["seed"], x["why"]) for x in looks] == [
        ("off", 1, "5 collisions"),
        ("safe", 1, "1 collision"),
        ("off", 0, "2 collisions"),
        ("safe", 4, "failed: tracking_rmse_m.r1"),
        ("off", 2, "timed out"),
        ("safe", 3, "nearest of those that passed, 0.900 m"),
    ]
    assert looks[0]["command"] == "mavherd run dash.yaml --seed 1 --set team.law=off"
    assert looks[0]["digest"] == "abc"


def test_failures_are_told_once_for_each_reason(summary):
    other = CRASHED | {"error": "KeyError: y"}
    s = summary([CRASHED, GOOD, other], [CRASHED, GOOD, GOOD])
    failures = s.as_json("dash")["failures"]
    assert [(x["why"], x["runs"], x["seed"]) for x in failures] == [
        ("ValueError: x", 2, 0),
        ("KeyError: y", 1, 2),
    ]


def test_a_sweep_in_which_everything_failed_has_a_summary_too(summary):
    s = summary([CRASHED] * 3, [CRASHED] * 3)
    told = s.as_json("dash")
    assert told["failed"] == 6
    assert told["worst"] == []
    assert told["points"][0]["rates"]["passed"]["rate"] is None
    assert told["points"][0]["medians"] == {}
    json.dumps(told, allow_nan=False)


def shown(summary, folder):
    console = Console(width=80, file=StringIO())
    console.print(summary_table(summary.as_json(str(folder)), folder), crop=False)
    return console.file.getvalue()


def test_the_table_fits_a_terminal_and_commands_stay_whole(summary, tmp_path):
    s = summary([HIT] * 8, [GOOD] * 8)
    source = tmp_path / "a-rather-long-name-for-a-folder-that-somebody-chose" / "scenario.yaml"
    text = shown(s, source)
    lines = text.splitlines()
    assert lines[0] == "dash  16 runs  2 grid points x 8 seeds".replace("dash", s.plan.scenario)
    assert any(line.split()[:4] == ["off", "8", "0%", "100%"] for line in lines)
    assert any(line.split() == ["0..32%", "68..100%", "3.00..3.00", "10.0..10.0"] for line in lines)
    assert f"  mavherd run {source} --seed 0 --set team.law=off" in lines


def test_of_many_grid_points_the_table_shows_some(planned, table_of, tmp_path):
    rates = tuple(f"{x / 100}" for x in range(50, 100))
    plan, points = planned(seeds=(0,), setpoint_timeout_s=rates)
    s = Summary(plan, points, table_of(plan, points, [GOOD] * 50))
    assert "and 10 more grid points, in summary.json" in shown(s, tmp_path)
