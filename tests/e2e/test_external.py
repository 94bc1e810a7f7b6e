"""Vehicles that somebody else has started fly the paper's missions, and are never left alone."""

import json
import os
import re
import signal
import socket
from contextlib import suppress
from math import degrees, pi

import pytest
import yaml
from pymavlink import mavutil

from mavherd.scenarios.dump import scenario_to_yaml
from mavherd.scenarios.loader import load_scenario

MISSIONS = ("crossing-targets", "circle-traffic", "tracking")
FAR = """
name: far
duration: 600
team: {start_sigma_m: 0}
robots:
  - {name: rover1, kind: rover, start: {east: 0, north: 0}, goto: {east: 2000, north: 0}}
  - {name: rover2, kind: rover, start: {east: 0, north: 12}, goto: {east: 2000, north: 12}}
  - name: quad1
    kind: quadcopter
    start: {east: 0, north: 4}
    goto: {east: 2000, north: 4, up: 1}
  - name: quad2
    kind: quadcopter
    start: {east: 0, north: 8}
    goto: {east: 2000, north: 8, up: 1}
"""
DOWN_S = 40.0  # from one metre, on a busy machine
pytestmark = pytest.mark.timeout(300)  # real time


class Somebody:
    """Starts vehicles by hand, where a scenario wants them, and looks on as a ground station."""

    def __init__(self, sandbox):
        self.sandbox = sandbox
        self.processes = {}
        self.ports = {}

    def bring(self, scenario, own=()):
        """Start the vehicles of `scenario` but those in `own`; return it with their addresses."""
        data, origin = yaml.safe_load(scenario_to_yaml(scenario)), scenario.origin
        for spec, robot in zip(scenario.robots, data["robots"], strict=True):
            if spec.name in own:
                continue
            number = spec.system_id
            tcp, udp = self.sandbox.free_port(), self.sandbox.free_port(socket.SOCK_DGRAM)
            stack = ("ardupilot", "px4")[number // 2 % 2]
            compass = degrees(pi / 2 - spec.heading) % 360
            self.processes[spec.name] = self.sandbox.start(
                *("vehicle", spec.kind, "--sysid", number, "--autopilot", stack),
                f"--home={origin.lat_deg},{origin.lon_deg},{origin.alt_m},{compass}",
                f"--position={spec.start.east},{spec.start.north},0",
                *("--tcp", tcp, "--udpout", f"127.0.0.1:{udp}"),
            )
            self.ports[spec.name] = tcp
            robot.pop("profile")
            robot["connect"] = f"tcp:127.0.0.1:{tcp}" if number % 2 else f"udpin:127.0.0.1:{udp}"
            robot["autopilot"] = stack if number % 3 else "auto"
        return data

    def armed(self):
        """Return which of the living vehicles are armed."""
        return {name for name in self.ports if self._is_armed(name)}

    def _is_armed(self, name):
        if self.processes[name].poll() is not None:
            return False
        client = self.sandbox.connect(f"tcp:127.0.0.1:{self.ports[name]}")
        try:
            heartbeat = client.recv_match(type="HEARTBEAT", blocking=True, timeout=60)
            assert heartbeat, f"{name} does not say whether it is armed"
            return bool(heartbeat.base_mode & mavutil.mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        finally:
            client.close()

    def leave(self):
        """End all vehicles."""
        for process in self.processes.values():
            with suppress(ProcessLookupError):
                process.terminate()


class Flight:
    """A run of the scenario FAR with somebody else's vehicles, all on their way."""

    def __init__(self, runs, vehicles, own=(), **changes):
        self.runs = runs
        self.somebody = Somebody(vehicles)
        (runs.folder / "plan.yaml").write_text(FAR)
        data = self.somebody.bring(load_scenario(runs.folder / "plan.yaml"), own)
        data["team"] |= changes
        (runs.folder / "far.yaml").write_text(yaml.safe_dump(data))
        self.process = runs.start("run", "far.yaml", "--no-record")
        self.folder = runs.wait_for_run()

    def said(self, name):
        """Return what the run has said of the end of a vehicle."""
        lines = (self.folder / "events.jsonl").read_text().splitlines()
        events = [json.loads(line) for line in lines]
        return [e["text"] for e in events if (e["vehicle"], e["kind"]) == (name, "rest")]

    def finish(self):
        return self.runs.finish(self.process)


@pytest.fixture
def flight(make_sandbox, request):
    flights = []

    def start(**options):
        name = request.node.name[:40]
        flights.append(Flight(make_sandbox(name), make_sandbox(name + "-vehicles"), **options))
        return flights[-1]

    yield start
    for each in flights:
        each.somebody.leave()


@pytest.fixture(scope="module")
def missions(make_sandbox):
    """The paper's three missions at the same time, every vehicle external."""
    started = {}
    for name in MISSIONS:
        runs, somebody = make_sandbox(name), Somebody(make_sandbox(name + "-vehicles"))
        data = somebody.bring(load_scenario(name))
        for robot, limit in data["expect"].get("tracking_rmse_m", {}).items():
            data["expect"]["tracking_rmse_m"][robot] = 2 * limit  # on a busy machine, in real time
        (runs.folder / "plan.yaml").write_text(yaml.safe_dump(data))
        started[name] = runs, somebody, runs.start("run", "plan.yaml", "--json", "--no-record")
    done = {}
    for name, (runs, somebody, process) in started.items():
        done[name] = runs.finish(process), somebody.armed()
        somebody.leave()
    return done


@pytest.mark.timeout(600)  # real time, three at once
@pytest.mark.parametrize("name", MISSIONS)
def test_a_mission_of_external_vehicles_ends_as_with_our_own(missions, name):
    done, armed = missions[name]
    assert done.code == 0, done.err
    assert armed == set()
    report = done.report
    assert report["passed"]
    assert report["all_arrived"]
    assert report["collisions"] == 0
    assert {robot["source"] for robot in report["robots"]} == {"telemetry"}
    assert not report["partial"]
    assert "judged by its own telemetry" in (done.folder / "report.html").read_text()


def test_ctrl_c_in_mid_flight_brings_everyone_down(flight):
    far = flight()
    far.process.send_signal(signal.SIGINT)
    done = far.finish()
    assert done.code == 130, done.err
    assert far.somebody.armed() == set()
    assert far.said("quad1") == ["is brought to hold, then land", "is disarmed"]
    assert far.said("rover1") == ["is brought to hold, then disarm", "is disarmed"]
    assert "quad1: is brought to hold, then land" in done.err  # the user sees what he waits for
    assert not done.report["partial"]


def test_ctrl_c_twice_does_not_wait_for_them(flight):
    far = flight(at_end="return")  # which takes long
    far.process.send_signal(signal.SIGINT)
    far.runs.wait_for(lambda: far.said("quad2"), "the first Ctrl-C is heard")
    far.process.send_signal(signal.SIGINT)
    assert far.finish().code == 130
    assert far.somebody.armed()


def test_they_may_be_left_holding(flight):
    far = flight(at_end="hold")
    far.process.send_signal(signal.SIGINT)
    assert far.finish().code == 130
    assert far.somebody.armed() == set(far.somebody.ports)
    assert far.said("quad1") == ["is brought to hold", "holds, armed"]


def test_a_vehicle_that_dies_brings_the_others_down(flight):
    far = flight()
    far.somebody.processes["quad2"].kill()
    done = far.finish()
    assert done.code == 3
    assert re.search(r"quad2: no heartbeat for \d\d s", done.complaint)
    assert far.somebody.armed() == set()


def test_a_launcher_that_is_killed_leaves_nobody_in_the_air(flight):
    far = flight()
    far.process.kill()
    far.runs.wait_for(lambda: not far.runs.processes(), "the coordinator ends", DOWN_S + 30)
    assert far.somebody.armed() == set()


def test_a_coordinator_that_is_killed_ends_the_run(flight):
    """Nobody steers its vehicles then: their own failsafes and their pilots have them."""
    far = flight()
    os.kill(far.runs.part("coordinator"), signal.SIGKILL)
    done = far.finish()
    assert done.code == 3
    assert "the coordinator was killed by SIGKILL" in done.complaint
    left = "nobody steers rover1, rover2, quad1, quad2 any more, may be flying, armed (ArduPilot"
    assert left in done.complaint
    assert left in done.report["error"]
    log = (done.folder / "events.jsonl").read_text()
    events = [event for event in map(json.loads, log.splitlines()) if event["kind"] == "problem"]
    told = {e["vehicle"] for e in events if "nobody steers it any more" in e["text"]}
    assert told == {"rover1", "rover2", "quad1", "quad2"}
    assert "quad1: nobody steers it any more" in done.err


def test_a_coordinator_that_hangs_is_told_of_in_the_same_way(flight):
    far = flight()
    os.kill(far.runs.part("coordinator"), signal.SIGSTOP)
    done = far.finish()
    assert done.code == 3
    assert "the coordinator is frozen" in done.complaint
    assert "nobody steers rover1, rover2, quad1, quad2 any more" in done.complaint


def test_only_those_of_the_coordinator_that_was_killed_are_left_alone(flight):
    far = flight(coordinators="per-robot")
    os.kill(far.runs.part("coordinator"), signal.SIGKILL)  # one of four
    done = far.finish()
    assert done.code == 3
    name = re.search(r"the coordinator of (\w+) was killed by SIGKILL", done.complaint)[1]
    assert f"nobody steers {name} any more" in done.complaint
    assert far.somebody.armed() <= {name}


def test_one_of_our_own_that_dies_brings_the_others_down(flight):
    far = flight(own=("rover2",), coordinators="per-robot")
    os.kill(far.runs.part("rover2"), signal.SIGKILL)
    done = far.finish()
    assert done.code == 3
    assert far.somebody.armed() == set()
    assert far.said("quad1") == ["is brought to hold, then land", "is disarmed"]


@pytest.mark.timeout(300)
def test_own_and_external_vehicles_share_a_mission_each_with_its_own_coordinator(make_sandbox):
    runs, somebody = make_sandbox("mixed"), Somebody(make_sandbox("mixed-vehicles"))
    data = somebody.bring(load_scenario("crossing-targets"), own=("rover2", "quad3"))
    data["team"]["coordinators"] = "per-robot"
    (runs.folder / "plan.yaml").write_text(yaml.safe_dump(data))
    try:
        done = runs.run("run", "plan.yaml")
        assert done.code == 0, done.err
        assert somebody.armed() == set()
        own = {r["name"] for r in done.report["robots"] if r["source"] == "physics"}
        assert own == {"rover2", "quad3"}
    finally:
        somebody.leave()


def test_the_wrong_vehicle_behind_an_address_is_named_and_left_alone(make_sandbox):
    runs, somebody = make_sandbox("wrong"), Somebody(make_sandbox("wrong-vehicles"))
    data = somebody.bring(load_scenario("one-quad"))
    data["robots"][0]["system_id"] = 9
    (runs.folder / "plan.yaml").write_text(yaml.safe_dump(data))
    try:
        done = runs.run("run", "plan.yaml")
        assert done.code == 3
        assert "answers here, the scenario wants 9" in done.complaint
        assert somebody.armed() == set()
    finally:
        somebody.leave()
