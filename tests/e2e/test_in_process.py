"""One process or many: the same bytes, the same truth, the same verdict."""

import json
import signal

import pytest

from mavherd.gcs.run.in_process import simulate
from mavherd.scenarios.loader import load_scenario

REFUSAL = ["duration=40", "robots.quad1.params.BATT_ARM_VOLT=100"]  # which comes at 30 s
OF_THE_SHELL = {  # not of what was simulated
    *("run_id", "started_at", "wall_s", "real_time_factor", "in_process", "cpu", "cpu_s", "ports"),
}


@pytest.mark.parametrize(
    ("name", "seed", "changes"),
    [
        ("one-quad", 1, ["duration=5"]),
        ("one-rover", 2, ["duration=5", "disturbance=white"]),
        ("tracking", 3, ["duration=7"]),
        ("circle-traffic", 4, ["duration=6", "disturbance=held"]),
        ("circle-traffic", 5, ["duration=5", "team.coordinators=per-robot"]),
        ("crossing-targets", 6, ["duration=6", "team.autopilot=px4"]),
        ("crossing-targets", 7, ["duration=8", "team.law=paper"]),
        ("crossing-targets", 8, ["duration=8", "team.law=off", "team.coordinators=per-robot"]),
        ("crossing-targets", 1, REFUSAL),
        ("crossing-targets", 1, [*REFUSAL, "team.coordinators=per-robot"]),
    ],
)
def test_processes_and_one_process_agree(sandbox, tmp_path, name, seed, changes):
    scenario = load_scenario(name, changes, seed)
    here = simulate(scenario, keep=tmp_path / "here")
    sets = [word for change in changes for word in ("--set", change)]
    there = sandbox.run("run", name, "--seed", seed, *sets, "--no-record")
    assert here.exit_code == there.code == (3 if REFUSAL[1] in changes else 4)
    assert here.report["digest"] == there.report["digest"] is not None
    assert lasting(here.report) == lasting(there.report)
    for spec in scenario.robots:
        for file in ("truth.bin", "parameters.param", f"{spec.name}.tlog"):
            path = f"vehicles/{spec.name}/{file}"
            assert (here.folder / path).read_bytes() == (there.folder / path).read_bytes()
    for file in ("events.jsonl", "scenario.yaml", "robots.json", "states.parquet"):
        assert (here.folder / file).read_bytes() == (there.folder / file).read_bytes()


def lasting(report):
    robots = [without_shell(robot) for robot in report["robots"]]
    return without_shell(report) | {"robots": robots}


def without_shell(row):
    return {key: value for key, value in row.items() if key not in OF_THE_SHELL}


def test_the_command_runs_a_scenario_to_its_end_and_keeps_it(sandbox):
    done = sandbox.run("run", sandbox.scenario(far=1), "--in-process", "--json")
    assert done.code == 0
    assert done.out == (done.folder / "report.json").read_text()
    assert done.report["passed"]
    assert done.report["ports"] == {}
    again = sandbox.run("digest", done.folder)
    assert again.out.strip() == done.report["digest"]
    files = {f.relative_to(done.folder).as_posix() for f in done.folder.rglob("*") if f.is_file()}
    assert files >= {"report.html", "states.parquet", "figures/plan.png", "events.jsonl"}
    assert files.isdisjoint({"ports.json", "run.rrd", "recorder.txt", "launcher.txt"})


def test_ctrl_c_ends_it_with_a_report(sandbox):
    scenario = sandbox.scenario(far=2000, duration=3600)
    process = sandbox.start("run", scenario, "--in-process", "--speed", 1)
    sandbox.wait_for_run('"active"')
    process.send_signal(signal.SIGINT)
    done = sandbox.finish(process)
    assert done.code == 130
    assert (done.report["error"], done.report["exit_code"]) == ("interrupted", 130)
    assert done.report["digest"]
    assert not list(done.folder.rglob("*.part"))
    events = [json.loads(line) for line in (done.folder / "events.jsonl").read_text().splitlines()]
    assert {e["vehicle"] for e in events} == {"rover1", "quad1"}


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--gcs-udp", 14550], "--gcs-udp 14550: with --in-process there are no ports"),
        (["--free-run"], "--in-process: the team runs free"),
        (["--set", "robots.quad1.connect=tcp:127.0.0.1:5760"], "--in-process: the team runs free"),
    ],
)
def test_what_one_process_cannot_do_is_refused(sandbox, options, complaint):
    done = sandbox.run("run", sandbox.scenario(), "--in-process", *options)
    assert done.code == 2
    assert complaint in done.complaint
    assert done.folder is None
