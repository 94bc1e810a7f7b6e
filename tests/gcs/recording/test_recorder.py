"""The recorder writes what Zenoh and the logs tell, whole, and never holds anybody up."""

import json
import math
import os
import resource
import select
import signal
import socket
import subprocess
import sys
import time
import warnings
from contextlib import suppress

import numpy as np
import pytest

pytest.importorskip("rerun")

from mavherd.gcs.recording.replay import Recording, mend
from mavherd.gcs.recording.robots import write_robots
from mavherd.scenarios.dump import scenario_to_yaml
from mavherd.scenarios.schema import Goto, Point, RobotSpec, Scenario, Team
from mavherd.transport.bus import Bus
from mavherd.transport.wire import (
    Phase,
    Target,
    VehicleState,
    pack_snapshot,
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
PATIENCE = 60.0
# As the launcher starts it, but for a machine that is busy or stands still for a while: it gets as
# much of it as all others, and keeps its session.
RECORDER = """
import os, runpy
from mavherd.transport import bus
bus.LEASE_MS = 60_000
os.nice = lambda increment: 0
runpy.run_module("mavherd.gcs.recording.recorder", run_name="__main__", alter_sys=True)
"""


@pytest.fixture
def recorder(tmp_path, endpoint):
    """Start recorders on the run folder; all are gone afterwards."""
    scenario = Scenario(name="test", robots=SPECS, team=Team(start_sigma_m=0.0))
    (tmp_path / "scenario.yaml").write_text(scenario_to_yaml(scenario))
    tell(tmp_path, (0.0, None, "begin"))
    started = []

    def start(*options):
        process = subprocess.Popen(
            [sys.executable, "-c", RECORDER, str(tmp_path), endpoint, RUN, *options],
            bufsize=0,  # what was said but not read yet, `select` sees
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


def hear(process, word):
    """Wait until it says something that begins so; return it."""
    line = ""
    while not line.startswith(word):
        assert select.select([process.stdout], [], [], PATIENCE)[0], f"it never said {word}"
        line = process.stdout.readline().decode()
        assert line, f"it has ended and never said {word}: {process.stderr.read()}"
    return line.strip()


def end(process):
    """Close its input; return its complaints."""
    process.stdin.close()
    assert process.wait(PATIENCE) == 0
    return process.stderr.read().decode()


@pytest.fixture
def logs(tmp_path, truth_log):
    """Write all truth logs: under their temporary names, or finished."""

    def write(suffix=""):
        for spec in SPECS:
            path = tmp_path / "vehicles" / spec.name / f"truth.bin{suffix}"
            truth_log(path, spec.name, spec.kind, spec.system_id, WAYS[spec.name], SECONDS)

    return write


def wait_for(condition):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def newest(path, entity, component):
    """Return the time of the last value in a recording that may go on, -1 before the first."""
    with suppress(RuntimeError, ValueError, KeyError):  # it has no whole beginning yet
        return read_recording(path)[entity][component][-1][0]
    return -1.0


def read_recording(path):
    """Return what was recorded over time: entity -> component -> list of (time, value)."""
    from rerun.chunk import RrdReader

    found = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of one that has no end yet
        chunks = list(RrdReader(path).stream())
    for chunk in chunks:
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


def states(tick):
    """Return what is believed of all robots at a tick."""
    t = tick / 20
    phase = Phase.STARTING if t < 3 else Phase.ACTIVE
    still = (0.0, 0.0, 0.0)
    return [
        VehicleState(s.name, s.system_id, tick, t, still, still, (1, 0, 0, 0), 4, t >= 1, phase)
        for s in SPECS
    ]


def target(tick, name="r1", north=0.3):
    still = (0.0, 0.0, 0.0)
    return Target(name, tick / 20, (0.5 * tick / 20, north, 0.0), still, still, still)


def wanted(bus, key):
    """Return a publisher to which somebody listens."""
    publisher = bus.publisher(key)
    wait_for(lambda: publisher.wanted)
    return publisher


def publish(bus):
    """Say what a coordinator says during the run, and things that nobody should say."""
    snapshots = wanted(bus, "snapshot")
    for tick in range(0, int(SECONDS * 20) + 1, 2):
        snapshots.put(pack_snapshot(tick, tick / 20, states(tick), [target(tick)]))
    ghost = states(200)[0]._replace(name="ghost")
    nowhere = target(200, "q2", math.nan)
    snapshots.put(pack_snapshot(200, SECONDS, [ghost], [target(200, "ghost"), nowhere]))
    for junk in (b"", b"junk", bytes(4000), b"\xff" * 4000):
        snapshots.put(junk)


def tell(folder, *events):
    """Say what the launcher writes down."""
    with (folder / "events.jsonl").open("a") as log:
        for t, vehicle, text in events:
            event = {"t": t, "vehicle": vehicle, "kind": "phase", "text": text}
            log.write(json.dumps(event) + "\n")


def test_a_run_is_recorded_whole_though_logs_grow_and_junk_comes(
    tmp_path, endpoint, recorder, logs
):
    logs()
    whole = {path: path.read_bytes() for path in tmp_path.glob("vehicles/*/truth.bin")}
    for path in whole:
        path.unlink()
    recording = tmp_path / "run.rrd.part"
    with Bus.router(endpoint, RUN, reliable=True) as bus:
        process = recorder()
        hear(process, "ready")
        publish(bus)
        assert b": snapshot: " in process.stderr.readline()  # the junk has come, so all has
        parts = {path: path.with_name("truth.bin.part").open("wb", buffering=0) for path in whole}
        for share in (0.3, 0.7):
            for path, file in parts.items():
                file.write(whole[path][file.tell() : int(share * len(whole[path]))])
            until = (share - 0.1) * SECONDS
            wait_for(
                lambda until=until: newest(recording, "/world/robots/r1", "translation") > until
            )
        wait_for(lambda: newest(recording, "/phase/r1", "state") == 3.0)
        for path, file in parts.items():
            file.write(whole[path][file.tell() :])
            file.close()
            path.with_name("truth.bin.part").rename(path)
        with (tmp_path / "events.jsonl").open("a") as log:
            log.write("not JSON\n[]\n")
        tell(tmp_path, (3.0, "r1", "active"))
        complaints = end(process)
    assert [line.split(": ")[1] for line in complaints.splitlines()] == ["events.jsonl"]
    assert not recording.exists()
    seen = read_recording(tmp_path / "run.rrd")
    poses = seen["/world/robots/r1"]["translation"]
    times = [t for t, _ in poses]
    assert (times[0], times[-1]) == pytest.approx((0.0, SECONDS), abs=0.05)
    assert 0.0 < np.diff(times).min() <= np.diff(times).max() <= 0.051  # 20 Hz or more
    for t, position in poses:
        assert position[0] == pytest.approx([0.5 * t, 0.0, 0.0], abs=1e-5)
    assert [t for t, _ in seen["/phase/q2"]["state"]] == [0.0, 3.0]
    assert [t for t, _ in seen["/mode/r1"]["state"]] == [0.0, 1.0]
    texts = [v[0] for _, v in seen["/events"]["text"]]
    assert ["begin" in texts[0], "active" in texts[1], len(texts)] == [True, True, 2]
    assert not any(entity.startswith("/phase/") and "ghost" in entity for entity in seen)


def test_robots_with_coordinators_of_their_own_are_recorded_together(
    tmp_path, endpoint, recorder, logs
):
    logs()
    with Bus.router(endpoint, RUN, reliable=True) as bus:
        process = recorder()
        hear(process, "ready")
        snapshots = wanted(bus, "snapshot")
        others = [bus.publisher(f"vehicle/r1/{what}") for what in ("state", "target")]
        assert not any(other.wanted for other in others)  # it would hold up who waits for it
        for tick in range(0, int(SECONDS * 20), 2):
            for state in states(tick - tick % 40):  # their links are silent, but for a moment
                aims = [target(tick)] if state.name == "r1" else []
                snapshots.put(pack_snapshot(tick, tick / 20, [state], aims))
        snapshots.put(pack_snapshot(200, math.nan, states(200), []))
        assert b"snapshot: of no moment" in process.stderr.readline()  # the last has come
        assert end(process) == ""
    seen = read_recording(tmp_path / "run.rrd")
    assert [t for t, _ in seen["/mode/q2"]["state"]] == [0.0, 2.0]
    assert "/world/targets/r1" in seen
    ages = {round(t, 2): row for t, row in seen["/fleet/ages"]["scalars"]}
    assert len(ages) == len(seen["/fleet/ages"]["scalars"])
    assert ages[5.9] == pytest.approx([1.9] * 3)


def test_an_interrupt_is_left_to_the_launcher_and_who_is_killed_leaves_what_there_was(
    tmp_path, endpoint, recorder, logs
):
    logs(".part")
    part = tmp_path / "run.rrd.part"
    with Bus.router(endpoint, RUN):
        process = recorder()
        hear(process, "ready")
        os.kill(process.pid, signal.SIGINT)
        for name in WAYS:
            entity = f"/world/robots/{name}"
            wait_for(lambda e=entity: newest(part, e, "translation") >= SECONDS - 0.1)
        process.kill()
        process.wait()
    mended = tmp_path / "mended.rrd"  # who is killed while he writes leaves half a word
    mend(Recording(part, None), mended)
    assert newest(mended, "/world/robots/q3", "translation") >= SECONDS - 0.1
    assert not (tmp_path / "run.rrd").exists()


def test_a_disk_that_is_full_ends_the_recording_and_what_there_is_can_be_read(
    tmp_path, endpoint, recorder, logs
):
    part = tmp_path / "run.rrd.part"
    with Bus.router(endpoint, RUN):
        process = recorder()
        hear(process, "ready")
        wait_for(lambda: newest(part, "/events", "text") == 0.0)
        room = part.stat().st_size + 2000
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (room, room))
        logs()
        assert hear(process, "lost") == f"lost {part}: cannot be written any more"
        assert process.wait(PATIENCE) == 3
    assert newest(part, "/events", "text") == 0.0
    assert not (tmp_path / "run.rrd").exists()


def test_a_recording_that_cannot_be_begun_is_told_of(tmp_path, endpoint, recorder):
    (tmp_path / "run.rrd.part").symlink_to("/dev/full")
    with Bus.router(endpoint, RUN):
        process = recorder()
        assert "No space left on device" in hear(process, "lost it cannot be begun")
        assert process.wait(PATIENCE) == 3


def test_a_port_that_somebody_has_costs_the_viewers_and_not_the_recording(
    tmp_path, endpoint, recorder, logs
):
    logs()
    with socket.create_server(("127.0.0.1", 0)) as other, Bus.router(endpoint, RUN):
        port = other.getsockname()[1]
        process = recorder("--serve", str(port))
        told = hear(process, "lost viewers")  # and never "serving"
        assert told == f"lost viewers: port {port} cannot be served"
        process.stdin.write(b"\n")
        hear(process, "done")
        end(process)
    last = newest(tmp_path / "run.rrd", "/world/robots/r1", "translation")
    assert last == pytest.approx(SECONDS, abs=0.05)


def test_viewers_are_served_until_the_end_though_the_file_is_whole_before(
    tmp_path, endpoint, recorder, logs, hold_port
):
    logs()
    port = hold_port()
    with Bus.router(endpoint, RUN):
        process = recorder("--serve", str(port))
        hear(process, "serving")
        process.stdin.write(b"\n")
        hear(process, "done")
        last = newest(tmp_path / "run.rrd", "/world/robots/r1", "translation")
        assert last == pytest.approx(SECONDS, abs=0.05)
        socket.create_connection(("127.0.0.1", port)).close()
        assert end(process) == ""
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", port)) != 0


def test_without_a_router_the_recorder_says_so(recorder, endpoint):
    process = recorder()
    _, complaint = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2
    assert complaint.decode().startswith(f"mavherd recorder: no Zenoh router at {endpoint}")


def test_a_folder_lists_who_takes_part(tmp_path):
    write_robots(tmp_path, SPECS, Team(takeoff_up=2.5))
    robots = json.loads((tmp_path / "robots.json").read_text())
    assert [(r["name"], r["kind"], r["system_id"]) for r in robots] == [
        (s.name, s.kind, s.system_id) for s in SPECS
    ]
    assert robots[0]["target"] == [9, 0, 0]
    assert robots[1]["target"] == [0, 3, 2.5]
