"""`mavherd run` from the command to the files: complete, repeatable, open to outside clients."""

import json
from contextlib import closing
from math import dist
from xml.etree import ElementTree

import pytest
from pymavlink import mavutil

KEYS = {  # that design and documentation promise
    *("schema", "scenario", "seed", "law", "passed", "assertions", "collisions"),
    *("min_separation_m", "all_arrived", "duration_s", "real_time_factor", "digest"),
    *("outside_clients", "partial"),
}


@pytest.fixture(scope="module")
def crossing(shared_sandbox):
    """One run of the largest of the first scenarios, recorded, as JSON."""
    options = "--json", "--seed", 3, "--junit", "ci/junit.xml"
    return shared_sandbox.run("run", "crossing-targets", *options, timeout=110)


def test_a_run_leaves_everything_it_promises(crossing):
    assert crossing.code == 0
    folder = crossing.folder
    files = {str(f.relative_to(folder)) for f in folder.rglob("*") if f.is_file()}
    assert files >= {"scenario.yaml", "ports.json", "events.jsonl", "report.json", "report.html"}
    assert files >= {"states.parquet", "run.rrd", "figures/plan.png"}
    for robot in crossing.report["robots"]:
        name = robot["name"]
        own = {f"vehicles/{name}/{f}" for f in ("truth.bin", f"{name}.tlog", "log.txt")}
        assert files >= own
    assert not [f for f in files if f.endswith((".part", ".lock"))]
    assert all((folder / f).stat().st_size for f in files if not f.endswith(".txt"))
    assert not [f for f in files if f.endswith(".txt") and (folder / f).stat().st_size]
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    assert {"vehicle": "quad3", "kind": "phase", "text": "done"}.items() <= events[-1].items()


def test_json_on_stdout_is_the_report_alone(crossing):
    assert crossing.out == (crossing.folder / "report.json").read_text()
    report = json.loads(crossing.out)
    assert report.keys() >= KEYS
    assert report["passed"]
    assert report["all_arrived"]
    assert not report["partial"]
    assert (report["seed"], report["law"], report["collisions"]) == (3, "safe", 0)
    assert (report["lockstep"], report["outside_clients"]) == (True, 0)


def test_the_report_counts_what_the_run_has_cost_and_what_went_over_its_links(crossing):
    report = crossing.report
    cpu = report["cpu"]
    parts = ("launcher_s", "vehicles_s", "coordinators_s", "recorder_s")
    assert all(cpu[part] > 0 for part in parts)
    assert cpu["total_s"] == pytest.approx(sum(cpu[part] for part in parts))
    own = [robot["cpu_s"] for robot in report["robots"]]
    assert 0 < sum(own) < cpu["vehicles_s"]  # which the process that forks them is part of
    for robot in report["robots"]:
        setpoints, link = robot["setpoints"], robot["link"]
        assert setpoints["rate_hz"] == pytest.approx(20)  # in lockstep one each tick
        assert setpoints["longest_gap_s"] == pytest.approx(0.05)
        assert link["lost_frames"] == 0
        assert link["position_rate_hz"] == pytest.approx(20, rel=0.01)
        assert link["oldest_state_s"] == 0
        tlog = crossing.folder / "vehicles" / robot["name"] / f"{robot['name']}.tlog"
        stamps = 8 * (link["to_vehicle_frames"] + link["from_vehicle_frames"])
        told = link["to_vehicle_bytes"] + link["from_vehicle_bytes"]
        assert told + stamps == tlog.stat().st_size
    assert report["missing"] == []


def test_junit_says_what_the_report_says(crossing, shared_sandbox):
    suite = ElementTree.parse(shared_sandbox.folder / "ci" / "junit.xml").getroot()[0]
    assert (suite.get("failures"), suite.get("errors")) == ("0", "0")
    assert int(suite.get("tests")) == 1 + len(crossing.report["assertions"])
    properties = {each.get("name"): each.get("value") for each in suite.iter("property")}
    assert properties["digest"] == crossing.report["digest"]


def test_digest_is_computed_again_from_the_tlogs(crossing, shared_sandbox):
    again = shared_sandbox.run("digest", crossing.folder)
    assert (again.code, again.out.strip()) == (0, crossing.report["digest"])


def test_a_stock_reader_reads_the_tlogs(crossing):
    with closing(
        mavutil.mavlink_connection(str(crossing.folder / "vehicles/quad1/quad1.tlog"))
    ) as log:
        seen, times = {}, []
        while m := log.recv_match():
            assert m.get_type() != "BAD_DATA"
            seen.setdefault(m.get_type(), m)
            times.append(m._timestamp)
    assert seen["HEARTBEAT"].get_srcSystem() == 4
    assert seen["SET_POSITION_TARGET_LOCAL_NED"].get_srcSystem() == 254
    assert seen.keys() >= {"COMMAND_LONG", "COMMAND_ACK", "LOCAL_POSITION_NED", "ATTITUDE"}
    assert times == sorted(times)
    assert times[-1] - times[0] == pytest.approx(crossing.report["duration_s"], abs=0.2)


@pytest.mark.parametrize("name", ["one-quad", "one-rover"])
def test_the_first_steps_pass(sandbox, name):
    done = sandbox.run("run", name, "--no-record", "--out", "elsewhere/deep")
    assert done.code == 0
    assert done.out == ""
    (folder,) = (sandbox.folder / "elsewhere/deep").iterdir()
    report = json.loads((folder / "report.json").read_text())
    assert report["passed"]
    assert not report["partial"]
    assert not (folder / "run.rrd").exists()


def test_one_seed_one_digest_and_another_seed_another(sandbox):
    options = "run", "crossing-targets", "--no-record", "--set", "duration=6"
    runs = [sandbox.run(*options, "--seed", seed) for seed in (7, 7, 8)]
    assert [run.code for run in runs] == [4, 4, 4]  # it needs longer than that
    first, second, other = (run.report["digest"] for run in runs)
    assert first == second != other


@pytest.fixture(scope="module")
def short(shared_sandbox):
    """One short run of a rover and a quadcopter, to compare others with."""
    done = shared_sandbox.run("run", shared_sandbox.scenario(), "--no-record")
    assert done.code == 0
    return done


def test_distributed_coordinators_are_told_apart_by_nothing_on_the_links(sandbox, short):
    distributed = "--set", "team.coordinators=per-robot"
    each = sandbox.run("run", sandbox.scenario(), "--no-record", *distributed)
    assert each.code == 0
    assert each.report["digest"] == short.report["digest"]


def test_set_changes_what_is_run_and_is_kept(sandbox):
    done = sandbox.run(
        "run", sandbox.scenario(), "--no-record", "--set", "robots.rover1.goto.east=1"
    )
    (rover,) = (r for r in done.report["robots"] if r["name"] == "rover1")
    assert rover["arrived"]
    assert rover["arrival_s"] < 3
    again = sandbox.run("run", done.folder / "scenario.yaml", "--no-record")
    assert again.report["digest"] == done.report["digest"]


@pytest.mark.parametrize("speed", [1, 5])
def test_speed_paces_lockstep_to_the_wall_clock(sandbox, speed):
    scenario = sandbox.scenario(far=10, duration=2 * speed)
    done = sandbox.run("run", scenario, "--no-record", "--speed", speed)
    assert done.code == 4
    report = done.report
    assert report["duration_s"] == pytest.approx(2 * speed)
    assert report["wall_s"] > 1.9
    assert report["wall_s"] < 3 or report["late_ticks"]  # a machine that is too busy is told of
    assert report["speed"] == speed


def test_a_free_run_follows_the_wall_clock_and_has_no_digest(sandbox):
    scenario = sandbox.scenario(far=1)
    done = sandbox.run("run", scenario, "--no-record", "--free-run")
    assert done.code == 0
    report = done.report
    assert report["passed"]
    assert (report["lockstep"], report["digest"], report["speed"]) == (False, None, 1)
    assert 0.5 < report["real_time_factor"] <= 1
    assert report["ticks"] > 100


def test_an_outside_client_is_served_and_leaves_the_digest_alone(sandbox, short):
    scenario = sandbox.scenario()
    tcp = sandbox.free_port()
    options = "--no-record", "--paused", "--speed", 4, "--tcp", tcp
    process = sandbox.start("run", scenario, *options)
    sandbox.wait_for(lambda: list(sandbox.folder.glob("runs/*/ports.json")), "ports")
    with closing(sandbox.connect(f"tcp:127.0.0.1:{tcp}")) as client:
        assert client.wait_heartbeat(timeout=60).get_srcSystem() == 1
        sandbox.greet(client)
        sandbox.wait_for(lambda: sandbox.clock("resume"), "the clock")
        while True:  # until it has arrived
            told = client.recv_match(type="LOCAL_POSITION_NED", blocking=True, timeout=60)
            assert told.get_srcSystem() == 1
            if dist((told.x, told.y), (0, 2)) < 0.3:
                break
    done = sandbox.finish(process)
    assert done.code == 0
    assert done.report["outside_clients"] == 1
    assert done.report["digest"] == short.report["digest"]
    assert "1 outside client" in done.err
    assert "1 outside client took part" in (done.folder / "report.html").read_text()


def test_what_comes_with_mavherd_is_listed_and_checked(sandbox):
    listed = sandbox.run("scenarios")
    names = [line.split()[0] for line in listed.out.splitlines()]
    assert {"one-quad", "one-rover", "crossing-targets"} <= set(names)
    for name in names[:2]:
        checked = sandbox.run("check", name)
        assert (checked.code, checked.err) == (0, "")
        assert checked.out.startswith(f"{name}: ")
    assert sandbox.run("version").out.startswith("mavherd ")
