"""The nursery forks light vehicles, tells how they end, and leaves nothing behind."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from mavherd.gcs.run.children import Nursery, how_it_ended
from mavherd.transport.errors import VehicleError
from mavherd.transport.links import listen_tcp, socket_pair_udp
from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.grants import DONE, GRANT
from mavherd.vehicles.parameters import files
from mavherd.vehicles.parameters.store import Parameters

HOST = "127.0.0.1"
PATIENCE_S = 60.0  # for what happens at once, on a machine that stands still now and then
TICK_US = 50_000


@dataclass
class Child:
    """Our ends of one vehicle process."""

    pid: int
    folder: Path
    coordinator: socket.socket
    control: socket.socket
    codec: Codec

    def tick(self, until_us: int, incoming: int = 0) -> list:
        """Grant time; return what the vehicle sent."""
        self.control.sendall(GRANT.pack(until_us, incoming))
        reached, sent, _, _ = DONE.unpack(self.control.recv(DONE.size, socket.MSG_WAITALL))
        assert reached == until_us
        return self.codec.decode(self.coordinator.recv(65535), stream=False) if sent else []

    def close(self):
        self.coordinator.close()
        self.control.close()


def alive(pid: int) -> bool:
    """Whether this process runs (a zombie does not)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):  # it may end while it is read of
        return False


def never() -> bool:
    return False


def until(condition):
    deadline = time.monotonic() + PATIENCE_S
    while not (result := condition()) and time.monotonic() < deadline:
        time.sleep(0.01)
    return result


@pytest.fixture
def nursery(tmp_path):
    it = Nursery()
    it.log_to(tmp_path / "nursery.txt")
    yield it
    it.close()
    assert (tmp_path / "nursery.txt").read_text() == ""


@pytest.fixture
def spawn(nursery, tmp_path):
    children = []

    def make(system_id=1, kind="rover", lockstep=True, tcp=None, **config):
        folder = tmp_path / f"v{system_id}"
        folder.mkdir()
        ours, theirs = socket_pair_udp()
        our_control, their_control = socket.socketpair()
        child = Child(0, folder, ours, our_control, Codec(254, 190))
        children.append(child)
        for sock in (ours, our_control):
            sock.settimeout(PATIENCE_S)
        request = {
            "folder": str(folder),
            "udpout": [],
            "config": VehicleConfig(kind=kind, system_id=system_id, **config).to_json(),
            "lockstep": lockstep,
            "started": time.monotonic(),
        }
        with theirs, their_control:
            nursery.ask(request, [theirs, their_control, *([tcp] if tcp else [])])
        nursery.fork()
        child.pid = nursery.pid(never)
        return child

    yield make
    for child in children:
        child.close()


def test_a_fleet_is_born_and_advances_in_lockstep(spawn):
    fleet = [spawn(i + 1, kind) for i, kind in enumerate(["rover", "quadcopter"] * 4)]
    assert len({child.pid for child in fleet}) == 8
    systems = set()
    for tick in range(1, 21):
        for child in fleet:
            systems |= {m.get_srcSystem() for m in child.tick(tick * TICK_US)}
    assert systems == set(range(1, 9))
    assert all(child.codec.lost == 0 for child in fleet)


def test_the_same_vehicle_sends_the_same_bytes_from_every_process(spawn, desk):
    def flight(child):
        ground, out = Codec(254, 190), []
        for tick in range(1, 60):
            messages = {
                1: mav.MAVLink_command_long_message(0, 1, 176, 0, 1, 4, 0, 0, 0, 0, 0),
                2: mav.MAVLink_command_long_message(0, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),
                3: mav.MAVLink_command_long_message(0, 1, 22, 0, 0, 0, 0, 0, 0, 0, 2),
            }
            if tick in messages:
                child.coordinator.send(ground.encode([messages[tick]]))
            child.control.sendall(GRANT.pack(tick * TICK_US, tick in messages))
            _, sent, _, _ = DONE.unpack(child.control.recv(DONE.size, socket.MSG_WAITALL))
            out.append(child.coordinator.recv(65535) if sent else b"")
        return out

    first = spawn(1, "quadcopter", seed=3)
    flown = flight(first)
    first.control.close()
    assert until(lambda: (first.folder / "truth.bin").exists())
    first.folder.rename(first.folder.with_name("first"))
    assert flight(spawn(1, "quadcopter", seed=3)) == flown
    assert len(b"".join(flown)) > 3000


def test_the_folder_tells_every_parameter_of_the_start_and_others_can_start_from_it(spawn):
    child = spawn(4, "quadcopter", params={"mass": 1.5, "RTL_ALT": 2000})
    child.tick(TICK_US)
    path = child.folder / "parameters.param"
    config = VehicleConfig(kind="quadcopter", system_id=4)
    told = files.load(path)
    assert told.keys() == {entry.parameter.name for entry in Parameters(config)}
    assert told["RTL_ALT"] == 2000
    again = Parameters(replace(config, params=files.fit(path, config).values))
    assert {entry.parameter.name: entry.value for entry in again} == pytest.approx(told)
    assert again.robot_overrides["mass"] == pytest.approx(1.5)


def test_an_end_of_file_ends_one_vehicle_with_its_logs_complete(spawn, nursery):
    one, two = spawn(1), spawn(2)
    one.tick(TICK_US)
    one.control.close()
    assert nursery.exit_code(one.pid, PATIENCE_S) == 0
    names = {"truth.bin", "log.txt", "parameters.param"}
    assert {p.name for p in one.folder.iterdir()} == names
    assert (one.folder / "log.txt").read_text() == ""
    assert two.tick(TICK_US) is not None
    assert alive(two.pid)


def test_a_killed_vehicle_is_reported_and_its_siblings_go_on(spawn, nursery):
    one, two = spawn(1), spawn(2)
    one.tick(TICK_US)
    os.kill(one.pid, signal.SIGKILL)
    code = nursery.exit_code(one.pid, PATIENCE_S)
    assert how_it_ended(code) == "was killed by SIGKILL"
    assert one.control.recv(1) == b"", "the sibling must not hold its socket open"
    assert (one.folder / "truth.bin.part").exists()
    two.tick(TICK_US)


def test_a_stopped_vehicle_does_not_outlive_the_nursery(spawn, nursery):
    one = spawn(1)
    os.kill(one.pid, signal.SIGSTOP)
    nursery._channel.close()
    assert nursery._child.wait(PATIENCE_S) == 0
    assert until(lambda: not alive(one.pid))


def test_closing_the_nursery_ends_every_vehicle(spawn, nursery):
    fleet = [spawn(i, lockstep=i % 2 == 0) for i in range(1, 7)]
    nursery.close()
    assert until(lambda: not any(alive(child.pid) for child in fleet))
    for child in fleet:
        child.close()


def test_a_vehicle_that_cannot_be_says_so_in_its_log(spawn, nursery):
    bad = spawn(1, params={"maas": 1.0})
    assert nursery.exit_code(bad.pid, PATIENCE_S) == 3
    assert "did you mean 'mass'" in (bad.folder / "log.txt").read_text()
    spawn(2).tick(TICK_US)


def test_a_dead_nursery_is_an_error_not_a_hang(spawn, nursery):
    spawn(1)
    nursery._child.kill()
    with pytest.raises(VehicleError, match="has died"):
        spawn(2)


def test_a_vehicle_serves_the_tcp_port_it_was_given(spawn):
    with listen_tcp(HOST, 0) as listening:
        port = listening.getsockname()[1]
        child = spawn(5, lockstep=False, tcp=listening)
    codec, heard = Codec(255), []
    with socket.create_connection((HOST, port), timeout=PATIENCE_S) as gcs:
        while not heard:
            heard = codec.decode(gcs.recv(65535))
    assert heard[0].get_srcSystem() == 5
    assert alive(child.pid)


HEAVY = ("numpy", "yaml", "zenoh", "rerun", "scipy", "matplotlib", "rich", "pyarrow", "pandas")
IMPORTS = """
import json, sys
import mavherd.vehicles.nursery, mavherd.vehicles.standalone
print(json.dumps(sorted({name.partition(".")[0] for name in sys.modules})))
"""


def test_a_vehicle_process_imports_nothing_heavy():
    done = subprocess.run(
        [sys.executable, "-c", IMPORTS],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=True,
    )
    imported = json.loads(done.stdout)
    assert "mavherd" in imported
    assert not set(HEAVY) & set(imported)
    # mavutil would be "pymavlink.mavutil", and draws in serial ports and environment variables
    assert "serial" not in imported
