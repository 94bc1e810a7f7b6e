"""The report is strict JSON, complete or absent, and a page that needs nothing else."""

import json
import os
from importlib.util import find_spec

import numpy as np
import pytest

from mavherd.gcs.report import report as report_module
from mavherd.gcs.report import states as states_module
from mavherd.gcs.report.judge import judge
from mavherd.gcs.report.report import RunFacts, build_report, dump_report, write_report
from mavherd.scenarios.schema import Expect, Goto, Point, RobotSpec, Scenario

PROMISED = {  # by the design
    "schema",
    "scenario",
    "seed",
    "law",
    "passed",
    "assertions",
    "collisions",
    "min_separation_m",
    "all_arrived",
    "duration_s",
    "real_time_factor",
    "digest",
    "outside_clients",
    "partial",
}


def facts(**changes):
    values = {
        "run_id": "two-1",
        "seed": 7,
        "law": "safe",
        "lockstep": True,
        "speed": None,
        "duration_s": 20.0,
        "wall_s": 1.0,
        "real_time_factor": 20.0,
        "digest": "ab" * 32,
        "python": "3.11",
        "ports": {"r1": {"udp": ["127.0.0.1:14550"]}},
    }
    return RunFacts(**values | changes)


@pytest.fixture
def run(track):
    """A rover that reaches its target past a quadcopter, and what the judge says."""
    specs = tuple(
        RobotSpec(
            name=name, kind=kind, system_id=i, start=Point(0, 0), path=Goto(target=Point(4, 0, up))
        )
        for i, (name, kind, up) in enumerate([("r1", "rover", 0), ("q2", "quadcopter", 3)], 1)
    )
    tracks = [
        track("r1", "rover", 1, lambda t: (0.25 * t, 0.0, 0.0)),
        track("q2", "quadcopter", 2, lambda t: (0.3 * t, 5.0, 3.0)),
    ]
    scenario = Scenario(
        name="two", robots=specs, description="<Two> & more", expect=Expect(collisions=0)
    )
    return scenario, specs, tracks, judge(scenario, specs, tracks, 2.0, 20.0)


@pytest.fixture
def written(run, tmp_path):
    scenario, specs, tracks, verdict = run
    report = build_report(scenario, verdict, facts())
    notes = write_report(tmp_path, report, scenario, specs, tracks, verdict)
    return tmp_path, report, notes


def test_the_report_holds_what_the_design_promises(run):
    report = build_report(run[0], run[3], facts())
    assert report.keys() >= PROMISED
    assert report["collisions"] == 0
    assert report["passed"]
    assert not report["all_arrived"]  # the quadcopter is 5 m beside its target
    assert [r["name"] for r in report["robots"]] == ["r1", "q2"]
    assert report["robots"][0]["arrival_s"] == pytest.approx(3.8 / 0.25 - 2, abs=0.011)
    assert report["pairs"][0]["contact_m"] == pytest.approx(0.595)
    assert report["assertions"][0]["text"] == "no collision: none"


@pytest.mark.parametrize("trouble", [{"error": "r1 died"}, {"exit_code": 4}])
def test_a_run_that_did_not_end_well_has_not_passed(run, trouble):
    assert not build_report(run[0], run[3], facts(**trouble))["passed"]


def test_unknown_numbers_are_null_never_nan(run):
    report = build_report(run[0], run[3], facts(real_time_factor=float("nan"), wall_s=float("inf")))
    again = json.loads(dump_report(report), parse_constant=pytest.fail)
    assert again["real_time_factor"] is None
    assert again["wall_s"] is None
    assert again == report


def test_a_large_team_lists_only_its_nearest_pairs(run, track):
    scenario, specs, _, _ = run
    tracks = [track(f"r{i}", "rover", i, lambda t, i=i: (3.0 * i, 0, 0), 0.1) for i in range(1, 31)]
    report = build_report(scenario, judge(scenario, specs, tracks, 0.0, 1.0), facts())
    assert report["pairs_total"] == 30 * 29 // 2
    distances = [p["min_separation_m"] for p in report["pairs"]]
    assert len(distances) == report_module.MAX_PAIRS
    assert distances == sorted(distances)
    assert distances[0] == pytest.approx(3.0)


def test_everything_is_written_and_nothing_is_left_half_done(written):
    folder, report, notes = written
    names = {str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()}
    names = {n for n in names if not n.startswith("tracks")}
    figures = {name for name in names if name.startswith("figures/")}
    assert names - figures >= {"report.json", "report.html", "states.parquet"}
    assert {"figures/plan.png", "figures/plan.svg"} <= figures
    assert {name[-3:] for name in figures} == {"png", "svg"}
    assert json.loads((folder / "report.json").read_text()) == report
    assert notes == []


def test_states_are_a_table_with_units_that_agrees_with_the_tracks(written, run):
    pq = pytest.importorskip("pyarrow.parquet")
    table = pq.read_table(written[0] / "states.parquet")
    rover, quad = run[2]
    assert table.num_rows == len(rover) + len(quad)
    assert table.schema.field("v_east_m_s").metadata[b"unit"] == b"m/s"
    assert table.schema.field("roll_rate_rad_s").metadata[b"unit"] == b"rad/s"
    assert b"ENU" in table.schema.metadata[b"frame"]
    first = table.slice(0, len(rover))
    assert set(first["robot"].to_pylist()) == {"r1"}
    assert first["east_m"].to_numpy() == pytest.approx(rover.position[:, 0])
    assert first["left_rad_s"].null_count == 0
    assert first["rotor1_rad_s"].null_count == len(rover)


def forget_the_view_extra(monkeypatch):
    def without(name):
        return None if name in ("pyarrow", "matplotlib") else find_spec(name)

    monkeypatch.setattr(states_module, "find_spec", without)
    monkeypatch.setattr(report_module, "find_spec", without)


def test_without_the_view_extra_states_are_npz_and_one_line_says_what_to_install(
    run, tmp_path, monkeypatch
):
    forget_the_view_extra(monkeypatch)
    scenario, specs, tracks, verdict = run
    report = build_report(scenario, verdict, facts())
    (note,) = write_report(tmp_path, report, scenario, specs, tracks, verdict)
    assert "pyarrow" in note
    assert "matplotlib" in note
    assert "pip install 'mavherd[view]'" in note
    assert "pip install 'mavherd[view]'" in (tmp_path / "report.html").read_text()
    with np.load(tmp_path / "states.npz") as states:
        mine = states["robot"] == "q2"
        assert states["east_m"][mine] == pytest.approx(tracks[1].position[:, 0])
        assert np.isnan(states["left_rad_s"][mine]).all()


def test_without_the_view_extra_what_a_folder_has_stays_and_its_age_is_told(
    written, run, monkeypatch
):
    folder, report, _ = written
    scenario, specs, tracks, verdict = run
    before = {path: path.read_bytes() for path in folder.glob("*.parquet")}
    assert before
    os.utime(folder / "states.parquet", (1.7e9, 1.7e9))
    os.utime(folder / "figures" / "plan.png", (1.7e9, 1.7e9))
    with monkeypatch.context() as patch:
        forget_the_view_extra(patch)
        (note,) = write_report(folder, report, scenario, specs, tracks, verdict)
    assert note.count("2023-11-14 22:13 UTC") == 2
    page = (folder / "report.html").read_text()
    assert page.count("<figure>") == len(list((folder / "figures").glob("*.png"))) > 1
    assert "figures are those drawn before, 2023-11-14 22:13 UTC" in page
    assert {path: path.read_bytes() for path in folder.glob("*.parquet")} == before
    assert not (folder / "states.npz").exists()


def test_a_table_from_before_the_extra_was_installed_makes_way(run, tmp_path):
    pytest.importorskip("pyarrow")
    (tmp_path / "states.npz").touch()
    states_module.write_states(tmp_path, run[2])
    assert [path.name for path in tmp_path.glob("states.*")] == ["states.parquet"]


def test_a_run_without_any_truth_still_gets_its_report(run, tmp_path):
    scenario, specs, _, _ = run
    verdict = judge(scenario, specs, [], 1.0, 5.0)
    report = build_report(scenario, verdict, facts(digest=None, exit_code=3, error="none came up"))
    notes = write_report(tmp_path, report, scenario, specs, [], verdict)
    assert notes == ["no robot has a track, so no figures"]
    assert json.loads((tmp_path / "report.json").read_text())["min_separation_m"] is None
    assert "none came up" in (tmp_path / "report.html").read_text()
    assert "no robot has a track" in (tmp_path / "report.html").read_text()
