"""The recorder writes what Zenoh and the truth logs tell, whole, and never holds anybody up."""

import json
import os
import select
import signal
import socket
import subprocess
import sys
import time

import numpy as np
import pytest

pytest.importorskip("rerun")

from mavherd.gcs.recording.robots import read_robots, write_robots
from mavherd.gcs.recording.separation import LiveSeparation
from mavherd.scenarios.schema import Goto, Point, RobotSpec, Team
from mavherd.transport.bus import Bus
from mavherd.transport.wire import (
    Phase,
    Target,
    VehicleState,
    pack_target,
    pack_team,
)

RUN = "test-run"
SPECS = (
    RobotSpec(
        name="r1", kind="rover", system_id=1, start=Point(0, 0), path=Goto(target=Point(9, 0))
    ),
    RobotSpec(name="q2", kind="quadcopter", system_id=2, start=Point(0, 3)),
    RobotSpec(name="q3", kind="quadcopter", system_id=3, start=Point(4, 3)),
)
WAYS = {
    "r1": lambda t: (0.5 * t, 0.0, 0.0),
    "q2": lambda t: (0.0, 3.0, np.minimum(t, 2.0)),
    "q3": lambda t: (4.0 - 0.1 * t, 3.0, np.minimum(t, 2.0)),
}
SECONDS = 10.0


@pytest.fixture
def endpoint():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@pytest.fixture
def recorder(tmp_path, endpoint):
    """Start recorders on the run folder; all are gone afterwards."""
    write_robots(tmp_path, SPECS, Team())
    started = []

    def start():
        process = subprocess.Popen(
            [sys.executable, "-m", "mavherd.gcs.recording.recorder", str(tmp_path), endpoint, RUN],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout, process.stderr):
            pipe.close()


def wait_ready(process):
    readable, _, _ = select.select([process.stdout], [], [], 20)
    assert readable
    assert process.stdout.readline() == b"ready\n"


def end(process):
    """Close its input; return its complaints."""
    process.stdin.close()
    assert process.wait(20) == 0
    return process.stderr.read().decode()


@pytest.fixture
def logs(tmp_path, truth_log):
    """Write all truth logs: under their temporary names, or finished."""

    def write(suffix=""):
        for spec in SPECS:
            path = tmp_path / "vehicles" / spec.name / f"truth.bin{suffix}"
            truth_log(path, spec.name, spec.kind, spec.system_id, WAYS[spec.name], SECONDS)

    return write


def read_recording(path):
    """Return what was recorded over time: entity -> component -> list of (time, value)."""
    from rerun.chunk import RrdReader

    found = {}
    for chunk in RrdReader(path).stream():
        if "sim_time" not in chunk.timeline_names:
            continue
        rows = chunk.to_record_batch()
        times = [t.value / 1e9 for t in rows["sim_time"]]
        for name in rows.schema.names:
            if ":" in name:
                values = zip(times, rows[name].to_pylist(), strict=True)
                entity = found.setdefault(chunk.entity_path, {})
                entity.setdefault(name.split(":")[1], []).extend(values)
    return {e: {c: sorted(v, key=lambda x: x[0]) for c, v in d.items()} for e, d in found.items()}


def publish(bus):
    """Say what a coordinator and the launcher say during the run."""
    team, events = bus.publisher("team"), bus.publisher("events")
    targets = {spec.name: bus.publisher(f"vehicle/{spec.name}/target") for spec in SPECS}
    deadline = time.monotonic() + 10
    while not all(p.wanted for p in (team, events, *targets.values())):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    still = (0.0, 0.0, 0.0)
    for tick in range(int(SECONDS * 20)):
        t = tick / 20
        phase = Phase.STARTING if t < 3 else Phase.ACTIVE
        states = [
            VehicleState(s.name, s.system_id, tick, t, still, still, (1, 0, 0, 0), 4, t >= 1, phase)
            for s in SPECS
        ]
        team.put(pack_team(tick, states))
        target = Target("r1", t, (0.5 * t, 0.3, 0.0), still, still, still)
        targets["r1"].put(pack_target(target))
    for t, vehicle, text in ((0.0, None, "begin"), (3.0, "r1", "active")):
        events.put(json.dumps({"t": t, "vehicle": vehicle, "kind": "phase", "text": text}).encode())
    events.put(b"not JSON")


def test_a_run_is_recorded_whole_and_reads_back(tmp_path, endpoint, recorder, logs):
    with Bus.router(endpoint, RUN, reliable=True) as bus:
        process = recorder()
        wait_ready(process)
        publish(bus)
        logs()
        time.sleep(0.5)  # samples are on their way; the recorder polls every 0.25 s
        complaints = end(process)
    assert complaints.count("\n") == 1
    assert "events: event:" in complaints
    assert not (tmp_path / "run.rrd.part").exists()
    seen = read_recording(tmp_path / "run.rrd")

    poses = seen["/world/r1"]["translation"]
    assert len(poses) == 501  # 50 Hz
    assert poses[-1][0] == pytest.approx(10.0)
    assert poses[-1][1][0] == pytest.approx([5.0, 0.0, 0.0])
    facing_north = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]  # x y z w, from east
    assert seen["/world/q2"]["quaternion"][0][1][0] == pytest.approx(facing_north)

    speed = seen["/plots/speed/r1"]["scalars"]
    assert speed[100][1] == pytest.approx([0.5])
    error = seen["/plots/error/r1"]["scalars"]
    assert len(error) == 100  # 10 Hz
    assert [value for _, value in error] == pytest.approx(np.full((100, 1), 0.3), abs=1e-6)

    quads = seen["/plots/separation/quadcopter-quadcopter"]["scalars"]
    assert [t for t, _ in quads] == pytest.approx(np.arange(201) / 20)
    assert quads[200][1] == pytest.approx([3.0])
    assert "/plots/separation/rover-rover" not in seen
    trail = seen["/trails/r1"]["strips"]
    assert trail[-1][1][0][-1] == pytest.approx([5.0, 0.0, 0.0], abs=0.2)

    assert [(t, v[0]) for t, v in seen["/mode/r1"]["state"]] == [
        (0.0, "HOLD disarmed"),
        (1.0, "HOLD"),
    ]
    assert [(t, v[0]) for t, v in seen["/phase/q2"]["state"]] == [
        (0.0, "starting"),
        (3.0, "active"),
    ]
    assert [v[0] for _, v in seen["/events"]["text"]] == ["begin", "r1: active"]


def test_logs_that_grow_and_are_renamed_are_followed(tmp_path, endpoint, recorder, logs):
    logs()
    whole = {}
    for spec in SPECS:
        path = tmp_path / "vehicles" / spec.name / "truth.bin"
        whole[path] = path.read_bytes()
        path.unlink()
    with Bus.router(endpoint, RUN):
        process = recorder()
        wait_ready(process)
        files = {path: path.with_name("truth.bin.part").open("wb", buffering=0) for path in whole}
        for share in (0.3, 0.7, 1.0):
            for path, data in whole.items():
                file = files[path]
                file.write(data[file.tell() : int(share * len(data))])
            time.sleep(0.3)  # let it read a part
        for path, file in files.items():
            file.close()
            path.with_name("truth.bin.part").rename(path)
        assert end(process) == ""
    poses = read_recording(tmp_path / "run.rrd")["/world/q3"]["translation"]
    assert [t for t, _ in poses] == pytest.approx(np.arange(501) / 50)


def test_interrupt_is_left_to_the_launcher_and_a_killed_recorder_leaves_a_visible_part(
    tmp_path, endpoint, recorder, logs
):
    logs(".part")
    with Bus.router(endpoint, RUN):
        process = recorder()
        wait_ready(process)
        os.kill(process.pid, signal.SIGINT)
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(0.7)
        process.kill()
        process.wait()
    assert (tmp_path / "run.rrd.part").exists()
    assert not (tmp_path / "run.rrd").exists()


def test_without_a_router_the_recorder_says_so(recorder, endpoint):
    process = recorder()
    _, complaint = process.communicate(timeout=20)
    assert process.returncode == 2
    assert complaint.decode().startswith(f"mavherd recorder: no Zenoh router at {endpoint}")


def test_robots_travel_through_their_file(tmp_path):
    write_robots(tmp_path, SPECS, Team(takeoff_up=2.5))
    robots = read_robots(tmp_path)
    assert [(r.name, r.kind, r.system_id) for r in robots] == [
        (s.name, s.kind, s.system_id) for s in SPECS
    ]
    assert robots[0].target == (9, 0, 0)
    assert robots[1].target == (0, 3, 2.5)


def test_live_separation_waits_for_the_slow_but_not_for_ever(track):
    live = LiveSeparation({"a": "rover", "b": "rover", "c": "rover"})
    live.add(track("a", "rover", 1, lambda t: (0, 0, 0), 1.0))
    live.add(track("b", "rover", 2, lambda t: (2, 0, 0), 1.0))
    assert len(live.take()[0]) == 0  # nothing from c yet
    live.add(track("a", "rover", 1, lambda t: (0, 0, 0), 3.0, start=1.0))
    live.add(track("b", "rover", 2, lambda t: (2, 0, 0), 3.0, start=1.0))
    time_s, smallest = live.take()
    assert time_s == pytest.approx(np.arange(41) / 20)  # to two seconds before the newest
    assert smallest["rover-rover"] == pytest.approx(2.0)
    time_s, _ = live.take(everything=True)
    assert time_s == pytest.approx(np.arange(41, 81) / 20)
