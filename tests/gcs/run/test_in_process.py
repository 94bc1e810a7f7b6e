"""A whole team in one process: nothing left over, everything in the report, the same every time."""

import json
import re
import socket
import threading
from dataclasses import replace
from pathlib import Path

import pytest

from mavherd.gcs.run.in_process import simulate
from mavherd.gcs.run.in_process_team import InProcess
from mavherd.scenarios.loader import load_scenario
from mavherd.scenarios.starts import draw_starts
from mavherd.transport.bus import Bus
from mavherd.transport.errors import MavherdError
from mavherd.transport.tlog import digest
from mavherd.transport.wire import Phase

MEETING = """
name: meeting
duration: {duration}
team: {{law: {law}, coordinators: {coordinators}, start_sigma_m: {sigma}}}
robots:
  - {{name: one, kind: rover, start: {{east: 0, north: 0}}, goto: {{east: 3, north: 0}}}}
  - name: two
    kind: rover
    start: {{east: 3, north: 0, heading_deg: 180}}
    goto: {{east: 0, north: 0}}
  - name: three
    kind: quadcopter
    start: {{east: 0, north: 4}}
    goto: {{east: 1, north: 4, up: 1}}
expect: {{collisions: 0}}
"""
DOCS = Path(__file__).parents[3] / "docs" / "in-process.md"
OF_THE_CALL = {"run_id", "started_at", "wall_s", "real_time_factor", "cpu"}  # not simulated
OF_THE_LOGS = {  # of which a run that is not kept has none: but for it nothing differs
    *("actuator_rms_rad_s", "deadlock_s", "setpoints", "link"),
    *("deadlock_any_s", "deadlock_all_s", "setpoint_rate_min_hz", "setpoint_longest_gap_s"),
    *("lost_frames", "longest_silence_s", "oldest_state_s", "link_bytes"),
}


@pytest.fixture
def meeting(tmp_path):
    """Make a scenario of two rovers that change places beside a quadcopter."""

    def make(law="safe", coordinators="central", duration=60, sigma=0.05):
        file = tmp_path / "meeting.yaml"
        file.write_text(
            MEETING.format(law=law, coordinators=coordinators, duration=duration, sigma=sigma)
        )
        return load_scenario(file)

    return make


def lasting(report):
    return {key: value for key, value in report.items() if key not in OF_THE_CALL}


def placed(report):
    """Return what the robots' places tell."""

    def without(row):
        return {key: value for key, value in row.items() if key not in OF_THE_LOGS}

    robots = [without(robot) for robot in report["robots"]]
    return lasting(report) | {"robots": robots, "fleet": without(report["fleet"])}


def test_a_run_is_judged_and_leaves_nothing_behind(meeting, tmp_path, monkeypatch):
    scenario = meeting()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    result = simulate(scenario)
    assert (result.exit_code, result.folder, result.notes) == (0, None, ())
    assert result.report["passed"]
    assert [robot["arrived"] for robot in result.report["robots"]] == [True] * 3
    assert result.report["min_separation_m"] > 0.79  # two rovers touch at that
    assert result.report["ticks"] * 0.05 == pytest.approx(result.report["duration_s"])
    assert json.loads(json.dumps(result.report)) == result.report
    assert list(elsewhere.iterdir()) == []


def test_no_socket_no_thread_and_no_zenoh_session_is_opened(meeting, monkeypatch):
    def refuse(*_, **__):
        raise AssertionError("opened")

    monkeypatch.setattr(socket, "socket", refuse)
    monkeypatch.setattr(threading.Thread, "start", refuse)
    monkeypatch.setattr(Bus, "router", refuse)
    monkeypatch.setattr(Bus, "client", refuse)
    for coordinators in ("central", "per-robot"):
        assert simulate(meeting(coordinators=coordinators, duration=2)).exit_code == 4


def test_one_seed_is_one_run_and_another_is_another(meeting):
    scenario = meeting(duration=3)
    first, again = simulate(scenario), simulate(scenario)
    assert lasting(first.report) == lasting(again.report)
    other = simulate(replace(scenario, seed=scenario.seed + 1))
    assert other.report["digest"] != first.report["digest"]
    assert other.report["pairs"] != first.report["pairs"]


def test_what_is_kept_says_the_same_as_what_is_not(meeting, tmp_path):
    scenario = meeting(duration=4)
    told = simulate(scenario)
    kept = simulate(scenario, keep=tmp_path / "runs")
    assert told.exit_code == kept.exit_code == 4
    assert placed(kept.report) == placed(told.report)
    assert all(robot["setpoints"]["count"] > 20 for robot in kept.report["robots"])
    assert [robot["setpoints"] for robot in told.report["robots"]] == [None] * 3
    assert kept.folder.parent == tmp_path / "runs"
    assert json.loads((kept.folder / "report.json").read_text()) == kept.report
    tlogs = [kept.folder / "vehicles" / n / f"{n}.tlog" for n in ("one", "two", "three")]
    assert digest(tlogs) == told.report["digest"]
    files = {f.relative_to(kept.folder).as_posix() for f in kept.folder.rglob("*") if f.is_file()}
    assert files >= {"scenario.yaml", "robots.json", "events.jsonl", "report.html"}
    assert files >= {f"vehicles/one/{f}" for f in ("truth.bin", "parameters.param")}
    assert not [f for f in files if f.endswith(".part")]
    assert not [f for f in files if f.endswith("ports.json")]
    again = simulate(load_scenario(kept.folder / "scenario.yaml"))
    assert again.report["digest"] == told.report["digest"]


def test_distributed_coordinators_decide_the_same(meeting):
    central = simulate(meeting(duration=8))
    each = simulate(meeting(duration=8, coordinators="per-robot"))
    assert lasting(each.report) == lasting(central.report)


def test_a_failed_assertion_is_a_verdict(meeting):
    result = simulate(meeting(law="off"))
    assert result.exit_code == 1
    assert result.report["collisions"] == 1
    assert not result.report["passed"]
    assert result.report["error"] is None


def test_a_vehicle_that_refuses_ends_the_run_with_its_reason(meeting):
    scenario = meeting()
    *rovers, quad = scenario.robots
    weak = replace(quad, params={"BATT_ARM_VOLT": 100.0})
    result = simulate(replace(scenario, robots=(*rovers, weak)))
    assert result.exit_code == 3
    assert result.report["error"].startswith("three: ")
    assert not result.report["passed"]
    assert result.report["digest"]


def test_an_interrupt_ends_it_with_a_report(meeting):
    asked = iter(range(100))
    result = simulate(meeting(), interrupted=lambda: next(asked) == 40)
    assert (result.exit_code, result.report["error"]) == (130, "interrupted")
    assert result.report["duration_s"] == pytest.approx(2.0)


def test_one_that_never_began_has_no_digest(meeting):
    result = simulate(meeting(), interrupted=lambda: True)
    assert result.exit_code == 130
    assert result.report["digest"] is None
    assert result.report["min_separation_m"] is None


def test_external_vehicles_are_somebody_elses(meeting):
    scenario = meeting()
    one, *others = scenario.robots
    abroad = replace(one, connect="tcp:127.0.0.1:5760")
    with pytest.raises(MavherdError, match="one: external vehicles cannot be run in process"):
        simulate(replace(scenario, robots=(abroad, *others)))


def test_whoever_holds_the_team_lets_time_pass(meeting):
    scenario = meeting(sigma=0)
    events = []
    team = InProcess(scenario, draw_starts(scenario), events.append)
    assert (team.now, team.ticks, team.finished, team.expired(0.1)) == (0, 0, False, False)
    for _ in range(2):
        team.tick(50_000)
    assert (team.now, team.ticks) == (pytest.approx(0.1), 2)
    assert team.expired(0.1)
    begun = [e["vehicle"] for e in events if e["text"] == Phase.STARTING.name.lower()]
    assert begun == ["one", "two", "three"]
    rows = [len(places) for places in team.places]
    before = team.digest
    team.tick(50_000)
    assert rows == [10] * 3
    assert [len(places) for places in team.places] == [15] * 3
    assert team.digest != before


def test_what_the_page_shows_runs(capsys):
    (script,) = re.findall(r"^```python\n(.*?)^```$", DOCS.read_text(), re.MULTILINE | re.DOTALL)
    assert "range(3)" in script
    exec(script.replace("range(3)", "range(1, 2)"), {})
    seed, exit_code, separation, told = capsys.readouterr().out.split()
    assert (seed, exit_code) == ("1", "0")
    assert float(separation) > 0.4  # two quadcopters touch at that
    assert len(told) == 16
