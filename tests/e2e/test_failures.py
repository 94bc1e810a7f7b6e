"""What dies, freezes or is shouted at in mid-run is named, and nothing is left behind."""

import json
import os
import random
import re
import signal
import socket

import pytest

from mavherd.vehicles.grants import LIVENESS_S

SOON = 0.8 * LIVENESS_S  # nobody waits for one who is gone as for one who may be frozen


def start(sandbox, *options, record=False):
    """Start a run without an end; return the process once the robots have moved for a while."""
    scenario = sandbox.scenario(far=2000, duration=3600)
    record = () if record else ("--no-record",)
    process = sandbox.start("run", scenario, *record, *options)
    truth = sandbox.wait_for_run() / "vehicles/rover1/truth.bin.part"
    enough = truth.stat().st_size + 20_000  # more than a second's rows
    sandbox.wait_for(lambda: truth.stat().st_size > enough, "movement")
    return process


@pytest.mark.parametrize("pace", ["--speed=2", "--free-run"])
@pytest.mark.parametrize(
    ("victim", "complaint"),
    [("rover1", r"rover1 \(pid \d+\)"), ("coordinator", "the coordinator")],
)
def test_a_process_that_is_killed_ends_the_run_with_3(sandbox, pace, victim, complaint):
    process = start(sandbox, pace)
    os.kill(sandbox.part(victim), signal.SIGKILL)
    done = sandbox.finish(process)
    assert done.code == 3
    pattern = rf"mavherd: {complaint} was killed by SIGKILL at \d+\.\d\d s"
    assert re.fullmatch(pattern, done.complaint)
    report = done.report
    assert (report["exit_code"], report["passed"], report["partial"]) == (3, False, True)
    assert report["error"] in done.complaint
    assert report["duration_s"] > 0
    assert (done.folder / "report.html").exists()


def test_a_vehicle_that_dies_before_the_first_tick_is_named_too(sandbox):
    process = sandbox.start("run", sandbox.scenario(far=2000, duration=3600))
    sandbox.wait_for(lambda: list(sandbox.folder.glob("runs/*/ports.json")), "the vehicles")
    os.kill(sandbox.part("quad1"), signal.SIGKILL)
    done = sandbox.finish(process)
    assert done.code == 3
    assert re.match(r"mavherd: quad1 \(pid \d+\) was killed by SIGKILL at ", done.complaint)
    assert done.report["partial"]


def test_one_of_several_coordinators_that_is_killed_is_the_one_that_is_named(sandbox):
    process = start(sandbox, "--speed=2", "--set", "team.coordinators=per-robot")
    os.kill(sandbox.part("coordinator"), signal.SIGKILL)
    done = sandbox.finish(process)
    assert done.code == 3
    assert re.search(r"the coordinator of (rover1|quad1) was killed by SIGKILL", done.complaint)


def test_a_run_outlives_its_nursery(sandbox):
    process = sandbox.start("run", sandbox.scenario(), "--no-record", "--paused")
    sandbox.wait_for(lambda: sandbox.clock("step", 100), "some seconds of the run")
    os.kill(sandbox.part("nursery"), signal.SIGKILL)
    assert sandbox.clock("resume")
    done = sandbox.finish(process)
    assert done.code == 0
    assert done.report["passed"]
    assert not done.report["partial"]


@pytest.mark.parametrize("pace", ["--speed=5", "--free-run"])
def test_a_vehicle_that_freezes_ends_the_run_with_3(sandbox, pace):
    process = start(sandbox, pace)
    os.kill(sandbox.part("quad1"), signal.SIGSTOP)
    done = sandbox.finish(process)
    assert done.code == 3
    frozen, silent = "is frozen: no answer to the tick", r"no heartbeat for \d\d s"
    said = frozen if pace == "--speed=5" else silent
    assert re.match(rf"mavherd: quad1.* {said}", done.complaint)
    assert done.report["error"] in done.complaint
    if pace == "--speed=5":  # and one is told before, while all wait
        assert "quad1: no answer to the tick after " in done.err


def test_when_the_launcher_is_killed_all_others_end_by_themselves(sandbox):
    process = start(sandbox, "--speed=2", record=True)
    assert len(sandbox.processes()) == 6
    sandbox.wait_for((sandbox.run_folder() / "run.rrd.part").exists, "a recording")
    process.kill()
    sandbox.wait_for(lambda: not sandbox.processes(), "the end of all others", SOON)
    folder = sandbox.finish(process).folder
    files = {str(f.relative_to(folder)) for f in folder.rglob("*")}
    assert files >= {"run.rrd", "vehicles/quad1/truth.bin", "vehicles/quad1/quad1.tlog"}
    assert not [f for f in files if f.endswith(".part") or f.startswith("report")]


def test_when_the_launcher_of_a_free_run_is_killed_all_others_end_by_themselves(sandbox):
    process = start(sandbox, "--free-run", "--set", "team.coordinators=per-robot")
    assert len(sandbox.processes()) == 6
    process.kill()
    sandbox.wait_for(lambda: not sandbox.processes(), "the end of all others", SOON)
    sandbox.finish(process)


def test_a_run_that_takes_too_long_ends_with_4(sandbox):
    done = sandbox.run("run", sandbox.scenario(duration=3), "--no-record")
    assert done.code == 4
    assert done.complaint == "mavherd: timed out: not done after 3 s of fleet time"
    assert (done.report["exit_code"], done.report["passed"]) == (4, False)
    assert not done.report["partial"]


def test_an_assertion_that_fails_ends_with_1(sandbox):
    done = sandbox.run(
        "run", "one-rover", "--no-record", "--set", "expect.tracking_rmse_m.rover1=0.01"
    )
    assert done.code == 1
    assert "FAIL" in done.err
    assert (done.report["exit_code"], done.report["passed"]) == (1, False)
    assert [a["passed"] for a in done.report["assertions"]] == [True, False]


def test_garbage_on_every_port_of_a_run_changes_nothing(sandbox):
    rng = random.Random(3)  # whose bytes contain no frame with a right checksum by chance
    quiet = sandbox.run("run", sandbox.scenario(), "--no-record")
    tcp = sandbox.free_port()
    with socket.socket(type=socket.SOCK_DGRAM) as ground:
        ground.bind(("127.0.0.1", 0))
        ground.settimeout(60)
        options = "--paused", "--tcp", tcp, "--gcs-udp", ground.getsockname()[1]
        process = sandbox.start("run", sandbox.scenario(), "--no-record", *options)
        frames = {}  # one from each vehicle's address
        while len(frames) < 2:
            frame, address = ground.recvfrom(2048)
            frames[address] = frame
        sandbox.wait_for(lambda: sandbox.clock("step", 40), "the first seconds")
        folder = sandbox.run_folder()
        ports = json.loads((folder / "ports.json").read_text())
        served = [p["tcp"] for p in ports.values() if isinstance(p, dict)] + [ports["zenoh"]]
        assert len(served) == 3
        streams = [socket.create_connection(_address(text)) for text in served]
        for round_ in range(100):
            if round_ == 50:  # half of it comes while time stands still
                assert sandbox.clock("speed", 5)
                assert sandbox.clock("resume")
            for address, frame in frames.items():
                cut = frame[: rng.randrange(1, len(frame))]
                flipped = bytes(b ^ (rng.random() < 0.1) for b in frame)
                for junk in (rng.randbytes(rng.randrange(1, 600)), cut, flipped):
                    ground.sendto(junk, address)
                    for stream in streams:
                        _try_to_send(stream, junk)
        for stream in streams:
            stream.close()
        done = sandbox.finish(process)
    assert done.code == 0
    assert done.report["digest"] == quiet.report["digest"]


def _address(text):
    host, _, port = text.removeprefix("tcp/").rpartition(":")
    return host, int(port)


def _try_to_send(stream, data):
    try:
        stream.sendall(data)
    except ConnectionError:  # Zenoh hangs up on those who do not speak its language
        stream.close()
    except OSError:
        assert stream.fileno() == -1
