"""Scripts on real processes: repeatable in lockstep, safe when they end in mid-flight."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import closing, contextmanager, suppress
from math import dist, hypot
from pathlib import Path

import pytest

from mavherd.gcs import Fleet
from mavherd.gcs.report.truth import read_truth
from mavherd.gcs.script import FleetError, LinkLost, TakenOver
from mavherd.transport.errors import LinkError, MavherdError

GUID_TIMEOUT_S = 3.0  # of vehicles by hand, where it is not theirs to be patient
PATIENT = {"ardupilot": "GUID_TIMEOUT=60", "px4": "COM_OF_LOSS_T=60"}  # with a busy machine


@pytest.fixture
def in_folder(tmp_path, monkeypatch):
    """Run folders go to a folder of the test's own; vehicles of a run open no ports there."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def truth(fleet, name):
    return read_truth(fleet.folder / "vehicles" / name / "truth.bin")


def test_a_lockstep_script_is_as_repeatable_as_a_scenario(in_folder):
    digests = []
    for _ in range(2):
        with Fleet.from_scenario("one-quad") as fleet:
            quad = fleet["quad1"]
            quad.arm()
            quad.takeoff(up=3)
            before = fleet.time
            time.sleep(0.1)  # between two calls time stands still
            assert fleet.time == before
            quad.goto(east=4, north=4, up=3)
            quad.velocity(east=0.5)
            fleet.sleep(3)
            quad.land()
        track = truth(fleet, "quad1")
        there = min(dist(place, (4, 4, 3)) for place in track.position.tolist())
        assert there < 0.25
        assert track.position[-1][2] == pytest.approx(0, abs=0.05)
        report = fleet.outcome.report
        assert (report["passed"], report["exit_code"], report["partial"]) == (True, 0, False)
        assert report["script"] is True
        digests.append(report["digest"])
    assert digests[0] == digests[1]
    assert (fleet.folder / "events.jsonl").exists()


def test_others_follow_their_own_paths_meanwhile(in_folder):
    with Fleet.from_scenario("crossing-targets", own=["quad1"]) as fleet:
        assert [v.name for v in fleet] == ["quad1"]
        fleet["quad1"].arm()
        fleet["quad1"].takeoff(up=4)
        fleet.sleep(25)
    arrived = {r["name"]: r["arrived"] for r in fleet.outcome.report["robots"]}
    assert all(there for name, there in arrived.items() if name != "quad1")
    assert fleet.outcome.report["collisions"] == 0


def began(fleet):
    """Return between which moments of the wall clock fleet time was 0, as it is now."""
    before, now, after = time.monotonic(), fleet.time, time.monotonic()
    return before - now - 1e-6, after - now + 1e-6


def test_a_free_running_script_follows_the_wall_clock(in_folder):
    with Fleet.from_scenario("one-rover", lockstep=False, seed=4) as fleet:
        rover = fleet["rover1"]
        rover.arm()
        first = began(fleet)
        rover.goto(east=1.5, north=0)
        last = began(fleet)
        assert first[0] <= last[1]
        assert last[0] <= first[1]
        rover.land()
    assert fleet.outcome.report["digest"] is None
    assert dist(truth(fleet, "rover1").position[-1][:2], (1.5, 0)) < 0.3


@pytest.mark.parametrize("at_end", ["land", "hold", "leave"])
def test_an_error_in_mid_air_gets_out_but_not_before_the_end(in_folder, at_end):
    with pytest.raises(ZeroDivisionError) as caught:  # noqa: SIM117, PT012 - what is tested
        with Fleet.from_scenario("one-quad", at_end=at_end) as fleet:
            fleet["quad1"].arm()
            fleet["quad1"].takeoff(up=2)
            fleet["quad1"].velocity(east=1)
            fleet.sleep(2)
            raise ZeroDivisionError("a slip")
    assert not getattr(caught.value, "__notes__", [])
    report = fleet.outcome.report
    assert report["error"] == "the script ended with ZeroDivisionError: a slip"
    assert (report["exit_code"], report["passed"]) == (1, False)
    end = truth(fleet, "quad1")
    height = end.position[-1][2]
    assert height == pytest.approx(0 if at_end == "land" else 2, abs=0.25)
    if at_end == "leave":
        assert end.velocity[-1][0] > 0.5
    with pytest.raises(FleetError, match="opened once"):
        fleet.open()


def test_a_vehicle_process_that_dies_ends_the_script_with_its_name(in_folder):
    fleet = Fleet.from_scenario("one-rover").open()
    fleet["rover1"].arm()
    os.kill(_pid_of(fleet, "rover1"), signal.SIGKILL)
    with pytest.raises(FleetError, match=r"rover1 \(pid \d+\) was killed by SIGKILL") as caught:
        fleet.sleep(10)
    fleet.__exit__(FleetError, caught.value, None)
    assert fleet.outcome.report["exit_code"] == 1


def _pid_of(fleet, name):
    """Return the process whose log is that of the vehicle."""
    log = (fleet.folder / "vehicles" / name / "log.txt").resolve()
    for entry in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if (entry / "fd/1").readlink() == log:
                return int(entry.name)
    raise AssertionError(f"no process of {name}")


# Vehicles that somebody else has started


@contextmanager
def vehicles(sandbox, *wanted):
    """Start vehicles (kind, system id, east, autopilot, parameters); yield where each is reached.

    Without any parameter they bear with a script that gets no processor for a while.
    """
    started, places = [], []
    for kind, system_id, east, autopilot, *parameters in wanted:
        tcp, watch = sandbox.free_port(), sandbox.free_port(socket.SOCK_DGRAM)
        options = ["--sysid", system_id, "--position", f"{east},0,0", "--autopilot", autopilot]
        options += [w for p in parameters or [PATIENT[autopilot]] for w in ("--param", p)]
        options += ["--tcp", tcp, "--udpout", f"127.0.0.1:{watch}"]
        vehicle = sandbox.start("vehicle", kind, *options)
        assert f"tcp:127.0.0.1:{tcp}" in vehicle.stdout.readline()
        started.append(vehicle)
        places.append((f"tcp:127.0.0.1:{tcp}", f"udpin:127.0.0.1:{watch}"))
    try:
        yield started, places
    finally:
        for vehicle in started:
            if vehicle.poll() is None:
                vehicle.send_signal(signal.SIGCONT)
                vehicle.send_signal(signal.SIGINT)
                vehicle.communicate(timeout=60)


def test_one_fleet_of_both_flight_stacks(sandbox, in_folder):
    wanted = ("quadcopter", 9, 0, "px4"), ("quadcopter", 3, 4, "ardupilot")
    with vehicles(sandbox, *wanted, ("rover", 5, 8, "ardupilot")) as (_, places):
        (first, _), (_, second), (third, _) = places
        with Fleet.connect(first, second, third) as fleet:
            assert [(v.name, v.system_id) for v in fleet] == [
                ("quad1", 3),
                ("rover1", 5),
                ("quad2", 9),
            ]
            fleet.all.arm()
            fleet.all.takeoff(up=2)
            assert [v.mode for v in fleet] == ["GUIDED", "GUIDED", "OFFBOARD"]
            starts = [v.position for v in fleet]
            for vehicle, start in zip(fleet, starts, strict=True):
                vehicle.goto(start.east, start.north + 3, wait=False)
            fleet.all.wait_arrival()
            for vehicle, start in zip(fleet, starts, strict=True):
                wanted = (start.east, start.north + 3)
                assert dist(vehicle.position[:2], wanted) < 0.3, vehicle
            assert fleet["quad2"].wait_message("BATTERY_STATUS")["id"] == 0
            assert fleet["rover1"].autopilot == "ardupilot"
        assert not any(v.armed for v in fleet)
        report = fleet.outcome.report
        assert (report["collisions"], report["exit_code"], report["error"]) == (0, 0, None)


SCRIPT = """
import sys
from mavherd.gcs import Fleet

with Fleet.connect(sys.argv[1]) as fleet:
    (quad,) = fleet
    quad.arm()
    quad.takeoff(up=4)
    quad.velocity(north=1)
    print("moves", flush=True)
    fleet.sleep(3600)
"""


class Watcher:
    """Looks at a vehicle from a link of its own."""

    def __init__(self, sandbox, address):
        self.client = sandbox.connect(address)
        self.client.wait_heartbeat(timeout=60)
        self.seen, self.mode, self.armed, self.clocks = [], 0, False, {}
        self._over = threading.Event()
        self._sandbox = sandbox
        sandbox.greet(self.client)
        self._thread = threading.Thread(target=self._watch)
        self._thread.start()

    def _watch(self):
        greeted = time.monotonic()
        while not self._over.is_set():
            m = self.client.recv_match(blocking=True, timeout=0.2)
            if time.monotonic() - greeted > 1:
                greeted = time.monotonic()
                self._sandbox.greet(self.client)
            match m and m.get_type():
                case "LOCAL_POSITION_NED":
                    self.seen.append((m.time_boot_ms / 1e3, hypot(m.vx, m.vy), -m.z))
                case "HEARTBEAT":
                    self.mode, self.armed = m.custom_mode, bool(m.base_mode & 128)
                case "TIMESYNC":
                    self.clocks[m.ts1] = m.tc1 * 1e-9

    @property
    def speed(self):
        return self.seen[-1][1] if self.seen else 0.0

    def ask_time(self):
        """Return the vehicle's own time, s, at a moment from now on."""
        asked = time.monotonic_ns()
        self.client.mav.timesync_send(0, asked)
        return self._sandbox.wait_for(lambda: self.clocks.get(asked), "its clock")

    def close(self):
        self._over.set()
        self._thread.join()
        self.client.close()


def start_script(folder, *args):
    """Start a script that is under way for an hour; return it once its vehicle moves."""
    (folder / "script.py").write_text(SCRIPT)
    script = subprocess.Popen(
        [sys.executable, "script.py", *args],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    said = script.stdout.readline()
    assert said == "moves\n", said + script.stdout.read()
    return script


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_a_script_that_dies_or_freezes_leaves_its_vehicle_on_hold(sandbox, in_folder, how):
    impatient = f"GUID_TIMEOUT={GUID_TIMEOUT_S}"
    wanted = ("quadcopter", 1, 0, "ardupilot", impatient), ("quadcopter", 2, 20, "ardupilot")
    with vehicles(sandbox, *wanted) as (_, places):
        folders = in_folder / "a", in_folder / "b"
        for folder in folders:
            folder.mkdir()
        watchers = [Watcher(sandbox, watch) for _, watch in places]
        scripts = [start_script(f, t) for f, (t, _) in zip(folders, places, strict=True)]
        try:
            for watcher in watchers:
                sandbox.wait_for(lambda w=watcher: w.speed > 0.8, "movement")
            scripts[0].send_signal(how)
            os.waitid(os.P_PID, scripts[0].pid, os.WEXITED | os.WSTOPPED | os.WNOWAIT)
            since = watchers[0].ask_time()
            sandbox.wait_for(lambda: watchers[0].speed < 0.1, "hold")
            held = next(at for at, speed, _ in watchers[0].seen if at > since and speed < 0.1)
            assert held - since < GUID_TIMEOUT_S + 2.0  # to brake
            assert (watchers[0].mode, watchers[0].armed) == (4, True)
            assert watchers[1].speed > 0.8  # goes on
            here = watchers[1].seen[-1][0]
            sandbox.wait_for(lambda: watchers[1].seen[-1][0] > here + 2, "two more seconds")
            assert watchers[1].speed > 0.8
        finally:
            for script in scripts:
                script.kill()
                script.communicate()
            for watcher in watchers:
                watcher.close()


@pytest.mark.parametrize(
    ("how", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_a_script_that_is_ended_lands_first(sandbox, in_folder, how, code):
    with vehicles(sandbox, ("quadcopter", 1, 0, "px4")) as (_, places):
        ((tcp, watch),) = places
        watcher = Watcher(sandbox, watch)
        script = start_script(in_folder, tcp)
        try:
            script.send_signal(how)
            script.communicate(timeout=60)
            assert script.returncode in (code, -how)
            sandbox.wait_for(lambda: not watcher.armed, "the end of it")
            assert watcher.seen[-1][2] < 0.2
        finally:
            script.kill()
            watcher.close()


def test_a_pilot_takes_over_from_a_script(sandbox, in_folder):
    with vehicles(sandbox, ("quadcopter", 1, 0, "ardupilot")) as (_, places):
        ((tcp, watch),) = places
        with (
            closing(sandbox.connect(watch)) as pilot,
            Fleet.connect(tcp, at_end="land") as fleet,
        ):
            (quad,) = fleet
            quad.arm()
            quad.takeoff(up=3)
            pilot.wait_heartbeat(timeout=60)
            quad.goto(east=300, north=0, wait=False)
            pilot.set_mode("LOITER")
            with pytest.raises(TakenOver, match="left GUIDED for LOITER"):
                quad.wait_arrival()
        assert quad.mode == "LOITER"  # leaving the block has left it to its pilot
        assert quad.armed


def test_a_vehicle_that_vanishes_is_lost(sandbox, in_folder):
    with vehicles(sandbox, ("rover", 1, 0, "ardupilot")) as (started, places):
        fleet = Fleet.connect(places[0][0]).open()
        (rover,) = fleet
        rover.arm()
        started[0].kill()
        with pytest.raises(LinkLost, match=r"rover1: goto: nothing heard for [1-9]\d s"):
            rover.goto(east=30, north=0)
        with pytest.raises(LinkLost, match="left as they are: rover1: nothing heard"):
            fleet.close()
    assert "left as they are" in fleet.outcome.report["error"]


# What cannot be opened


def test_a_process_that_dies_does_not_leave_external_vehicles_in_the_air(sandbox, in_folder):
    with vehicles(sandbox, ("quadcopter", 1, 0, "ardupilot")) as (_, [(address, _)]):
        (in_folder / "two.yaml").write_text(f"""
name: two
team: {{start_sigma_m: 0}}
robots:
  - {{name: quad1, kind: quadcopter, system_id: 1, start: {{east: 0, north: 0}},
     connect: "{address}", hold: {{east: 0, north: 0, up: 2}}}}
  - {{name: quad2, kind: quadcopter, system_id: 2, start: {{east: 4, north: 0}},
     hold: {{east: 4, north: 0, up: 2}}}}
""")
        fleet = Fleet.from_scenario("two.yaml")
        died = pytest.raises(FleetError, match=r"quad2 .* was killed by SIGKILL")
        with died, fleet:
            fleet.all.arm()
            fleet["quad1"].takeoff(up=2)
            os.kill(_pid_of(fleet, "quad2"), signal.SIGKILL)
            fleet.sleep(30)
        assert not fleet["quad1"].armed
        assert fleet["quad1"].position.up < 0.1


def test_a_path_to_follow_cannot_wait(in_folder):
    with Fleet.from_scenario("one-rover", lockstep=False) as fleet:
        rover = fleet["rover1"]
        rover.arm()
        rover.follow(lambda t: fleet.sleep(t + 9))
        since = fleet.time
        with pytest.raises(FleetError, match="a path to follow cannot wait"):
            fleet.sleep(60)
        assert fleet.time - since < 60  # at once


def test_nobody_there_is_said_with_the_address(sandbox):
    port = sandbox.free_port()
    with pytest.raises(FleetError, match=rf"0 vehicles heard within 3 s; tcp:127.0.0.1:{port}"):
        Fleet.connect(f"tcp:127.0.0.1:{port}", timeout=3)


def test_two_vehicles_of_one_system_id_are_refused(sandbox, in_folder):
    wanted = ("rover", 4, 0, "ardupilot"), ("quadcopter", 4, 9, "ardupilot")
    with (
        vehicles(sandbox, *wanted) as (_, places),
        pytest.raises(FleetError, match="have the same system id"),
    ):
        Fleet.connect(*(tcp for tcp, _ in places))


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        (lambda: Fleet.from_scenario("one-qad"), "did you mean 'one-quad'"),
        (lambda: Fleet.from_scenario("one-quad", own=["quad2"]), "no robot is called 'quad2'"),
        (lambda: Fleet.from_scenario("one-quad", at_end="explode"), "land, hold, return, leave"),
        (lambda: Fleet.from_scenario("one-quad", set=["team.law=saef"]), "did you mean 'safe'"),
        (lambda: Fleet.from_scenario("one-quad", lockstep=False, speed=2.0), "wall clock"),
        (lambda: Fleet.connect(), "no address"),
        (lambda: Fleet.connect("udp:127.0.0.1:14550"), "did you mean 'udpin:127.0.0.1:14550'"),
        (lambda: Fleet.connect("tcp:192.0.2.1:5760"), "confirm=True"),
        (lambda: Fleet.connect("tcp:192.0.2.1:5760", confirm=True), "fence"),
    ],
)
def test_wrong_input_is_refused_before_anything_starts(in_folder, wrong, why):
    with pytest.raises(MavherdError, match=why):
        wrong()
    assert list(in_folder.iterdir()) == []


@pytest.mark.parametrize("lockstep", [True, False])
def test_a_fleet_that_is_closed_says_so(in_folder, lockstep):
    with Fleet.from_scenario("one-rover", lockstep=lockstep) as fleet:
        fleet.sleep(0.1)
    with pytest.raises(FleetError, match="the fleet is closed"):
        fleet.sleep(1)


def test_a_fleet_that_is_not_open_says_so(in_folder):
    fleet = Fleet.from_scenario("one-quad")
    with pytest.raises(FleetError, match="not open"):
        fleet.sleep(1)
    assert len(fleet) == 0
    fleet.close()


def test_a_port_that_is_taken_leaves_nothing_behind(in_folder):
    with socket.socket(type=socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        with pytest.raises(LinkError, match=f"{port}"):
            Fleet.connect(f"udpin:127.0.0.1:{port}", timeout=2)
