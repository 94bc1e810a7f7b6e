"""Vehicles that somebody else has started are recorded, shown live, and converted from logs."""

import signal
import socket
import urllib.request
from collections import Counter

import numpy as np
import pytest

pytest.importorskip("rerun")

from rerun.chunk import RrdReader

from mavherd.transport.mavlink import Codec
from mavherd.transport.tlog import read_tlog

pytestmark = pytest.mark.timeout(120)
OBSERVER = (254, 191)


def positions(path):
    """Return the places of every robot in a recording, with their times."""
    found = {}
    for chunk in RrdReader(path).stream():
        entity = chunk.entity_path
        if entity.startswith("/world/robots/") and entity.count("/") == 3:
            batch = chunk.to_record_batch()
            if "Transform3D:translation" in batch.schema.names:
                times = batch["sim_time"].cast("int64").to_numpy() * 1e-9
                places = [row[0] for row in batch["Transform3D:translation"].to_pylist()]
                rows = found.setdefault(entity.rpartition("/")[2], [])
                rows.extend(zip(times, places, strict=True))
    return {name: sorted(rows) for name, rows in found.items()}


def kinds(tlog, sender):
    """Count the kinds of messages of one sender in a log."""
    codec, count = Codec(0), Counter()
    for _, frame in read_tlog(tlog):
        for m in codec.decode(frame):
            if (m.get_srcSystem(), m.get_srcComponent()) == sender:
                count[m.get_type()] += 1
    return count


class Recording:
    """`mavherd record`, or `view`, under way."""

    def __init__(self, sandbox, *args):
        self._sandbox = sandbox
        self._log = sandbox.folder / "said.txt"
        with self._log.open("w") as log:
            self.process = sandbox.start(*args, stderr=log)

    @property
    def said(self):
        return self._log.read_text()

    def wait_for(self, text):
        def says() -> bool:
            assert self.process.poll() is None or text in self.said, self.said
            return text in self.said

        self._sandbox.wait_for(says, f"{text!r} in what it says")

    def stop(self):
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(60)


@pytest.fixture
def vehicle(sandbox):
    """Start a vehicle that sends to a port: vehicle(port, "rover", "--sysid", 2)."""

    def start(port, kind="quadcopter", *options):
        address = f"127.0.0.1:{port}"
        return sandbox.start("vehicle", kind, "--tcp", 0, "--udpout", address, *options)

    return start


def test_whoever_sends_to_the_port_is_recorded(sandbox, vehicle):
    port = sandbox.free_port(socket.SOCK_DGRAM)
    px4 = ("--sysid", 2, "--autopilot", "px4", "--position", "3,2,0")
    both = vehicle(port, "quadcopter"), vehicle(port, "rover", *px4)
    options = ("-o", "seen.rrd", "--tlog", "seen.tlog")
    recording = Recording(sandbox, "record", "--listen", f"udp:{port}", *options)
    recording.wait_for("quadrotor, ardupilot, system 1")
    recording.wait_for("ground rover, px4, system 2")
    log = sandbox.folder / "seen.tlog.part"
    sandbox.wait_for(lambda: kinds(log, (1, 1))["LOCAL_POSITION_NED"] > 20, "positions")
    sandbox.wait_for(lambda: kinds(log, (2, 1))["LOCAL_POSITION_NED"] > 20, "positions")
    assert recording.stop() == 0
    for process in both:
        process.kill()
        process.wait()
    seen = positions(sandbox.folder / "seen.rrd")
    assert set(seen) == {"sys1", "sys2"}
    assert seen["sys2"][-1][1] == pytest.approx((3, 2, 0), abs=0.05)
    # nobody was steered: what went out are heartbeats and requests for telemetry
    assert set(kinds(sandbox.folder / "seen.tlog", OBSERVER)) == {"HEARTBEAT", "COMMAND_LONG"}

    again = sandbox.run("convert", "seen.tlog", "-o", "again.rrd")
    assert again.code == 0
    assert "2 vehicles" in again.out
    assert len(RrdReader(sandbox.folder / "again.rrd").blueprints()) == 1  # so it is the right one
    twice = positions(sandbox.folder / "again.rrd")
    for name, rows in seen.items():
        assert np.array([p for _, p in twice[name]])[-1] == pytest.approx(rows[-1][1], abs=0.05)


def test_silent_means_silent(sandbox, vehicle):
    port = sandbox.free_port(socket.SOCK_DGRAM)
    vehicle(port)
    options = ("--silent", "-o", "seen.rrd", "--tlog", "seen.tlog")
    recording = Recording(sandbox, "record", "--listen", f"udp:127.0.0.1:{port}", *options)
    log = sandbox.folder / "seen.tlog.part"
    sandbox.wait_for(lambda: log.exists() and kinds(log, (1, 1))["HEARTBEAT"] > 3, "heartbeats")
    assert recording.stop() == 0
    assert not kinds(sandbox.folder / "seen.tlog", OBSERVER)
    assert set(kinds(sandbox.folder / "seen.tlog", (1, 1))) == {"HEARTBEAT"}


def test_a_link_that_falls_silent_and_comes_back_is_told(sandbox, vehicle):
    port = sandbox.free_port()
    serves = ("vehicle", "quadcopter", "--tcp", port)
    first = sandbox.start(*serves)
    recording = Recording(sandbox, "record", "--connect", f"tcp:127.0.0.1:{port}", "-o", "seen.rrd")
    recording.wait_for("system 1")
    first.kill()
    first.wait()
    recording.wait_for("link silent")
    sandbox.start(*serves)
    recording.wait_for("link back after")
    assert recording.stop() == 0
    assert (sandbox.folder / "seen.rrd").stat().st_size > 10_000


def test_vehicles_are_shown_live_in_a_browser(sandbox, vehicle):
    port, page, data = (sandbox.free_port() for _ in range(3))
    sandbox.start("vehicle", "rover", "--tcp", port)
    viewing = ("--web", "--web-port", page, "--view-port", data)
    shown = Recording(sandbox, "view", "--connect", f"tcp:127.0.0.1:{port}", *viewing)
    shown.wait_for("system 1")
    shown.wait_for(f"http://127.0.0.1:{page}")

    def answers():
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{page}/", timeout=5) as answer:
                return answer.status == 200
        except OSError:
            return False

    sandbox.wait_for(answers, "the page")
    assert shown.stop() == 0, shown.said


def test_a_port_that_is_taken_is_one_clear_line(sandbox):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        done = sandbox.run("record", "--listen", f"udp:{port}", "-o", "seen.rrd")
    assert done.code == 2
    assert "another program listens here" in done.complaint
    assert not list(sandbox.folder.glob("*.rrd*"))


def test_where_nobody_is_heard_no_file_is_left(sandbox):
    port = sandbox.free_port(socket.SOCK_DGRAM)
    done = sandbox.run("record", "--listen", f"udp:{port}", "--duration", 1, "-o", "seen.rrd")
    assert done.code == 3
    assert "nothing is heard" in done.complaint
    assert not list(sandbox.folder.glob("*.rrd*"))


def test_a_run_without_a_recording_gets_one(sandbox):
    done = sandbox.run("run", sandbox.scenario(), "--in-process", "--no-record")
    assert done.code == 0
    assert not (done.folder / "run.rrd").exists()
    converted = sandbox.run("convert", done.folder)
    assert converted.code == 0, converted.err
    seen = positions(done.folder / "run.rrd")
    assert set(seen) == {"rover1", "quad1"}
    assert seen["rover1"][-1][1] == pytest.approx((2, 0, 0), abs=0.3)
    entities = {chunk.entity_path for chunk in RrdReader(done.folder / "run.rrd").stream()}
    wanted = {"/phase/quad1", "/mode/rover1", "/events", "/plots/rover1", "/world/believed/quad1"}
    assert wanted <= entities
