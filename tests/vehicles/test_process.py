"""The shell around a vehicle: grants, ends of file, real sockets, strangers at every port."""

import os
import random
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, closing, contextmanager, suppress
from itertools import pairwise

import pytest

from mavherd.transport.errors import VehicleError
from mavherd.transport.links import TcpServer, UdpIn, listen_tcp, socket_pair_udp
from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.grants import DONE, GRANT
from mavherd.vehicles.process import VehicleProcess, _datagrams
from mavherd.vehicles.vehicle import Vehicle

HOST = "127.0.0.1"
PATIENCE_S = 60.0  # for what happens at once, on a machine that stands still now and then
CONFIG = VehicleConfig(kind="quadcopter", system_id=3, name="q3", seed=4)


class Shell:
    """A vehicle process in a thread, with the launcher's and the coordinator's ends of it."""

    def __init__(self, endpoints=(), clock=None):
        self.coordinator, theirs = socket_pair_udp()
        self.control, control = socket.socketpair()
        self.coordinator.settimeout(PATIENCE_S)
        self.control.settimeout(PATIENCE_S)
        self.process = VehicleProcess(
            Vehicle(CONFIG), list(endpoints), coordinator=theirs, control=control
        )
        self.error = None
        self.clock = clock
        self._sockets = theirs, control, self.coordinator, self.control
        self.thread = threading.Thread(target=self._run)
        self.thread.start()

    def _run(self):
        try:
            if self.clock:
                self.process.run_free(started=0.0, clock=self.clock)
            else:
                self.process.run_lockstep()
        except VehicleError as error:
            self.error = error

    def grant(self, until_us, incoming=0):
        """Grant time; return what the vehicle says is done and what it sent."""
        self.control.sendall(GRANT.pack(until_us, incoming))
        done = DONE.unpack(self.control.recv(DONE.size, socket.MSG_WAITALL))
        return done, self.coordinator.recv(65535) if done[1] else b""

    def has_ended(self):
        """Wait for the process to end; return whether it has."""
        self.thread.join(PATIENCE_S)
        return not self.thread.is_alive()

    def lives(self, until_us):
        """Wait until the vehicle has lived so long by itself."""
        deadline = time.monotonic() + PATIENCE_S
        while self.process.vehicle.now_us < until_us:
            assert time.monotonic() < deadline
            time.sleep(0.01)

    def close(self):
        self.control.close()
        self.thread.join(PATIENCE_S)
        assert not self.thread.is_alive(), "end-of-file is the order to stop"
        self.process.close()
        for sock in self._sockets:
            sock.close()


@contextmanager
def shell(*endpoints, clock=None):
    """Run a vehicle process in lockstep, or free-running by a clock."""
    it = Shell(endpoints, clock)
    try:
        yield it
    finally:
        it.close()


def command(number, *params):
    p = (*params, *(0,) * (7 - len(params)))
    return mav.MAVLink_command_long_message(3, 1, number, 0, *p)


# Lockstep


def test_a_vehicle_advances_as_far_as_it_is_granted_and_no_further():
    with shell() as it:
        for until in (50_000, 100_000, 150_000):
            (reached, *_), _ = it.grant(until)
            assert reached == until
        time.sleep(0.05)
        assert it.process.vehicle.now_us == 150_000


def test_what_comes_out_of_the_process_is_what_the_vehicle_says_in_memory():
    talk = {3: [command(511, 30, 20_000)], 5: [command(400, 1), command(176, 1, 4)]}
    quiet, ground = Vehicle(CONFIG), Codec(254, 190)
    link, expected, heard = quiet.converse(), [], []
    for tick in range(20):
        out = quiet.handle(ground.encode(talk[tick]), link) if tick in talk else b""
        for _ in range(5):
            quiet.step()
            out += quiet.report(link, quiet.take_broadcasts())
        expected.append(out)
    ground = Codec(254, 190)
    with shell() as it:
        for tick in range(20):
            if tick in talk:
                it.coordinator.send(ground.encode(talk[tick]))
            heard.append(it.grant((tick + 1) * 50_000, incoming=tick in talk)[1])
    assert heard == expected
    assert any(expected)


def test_a_datagram_that_was_promised_and_does_not_come_is_an_error(monkeypatch):
    monkeypatch.setattr("mavherd.vehicles.process.LIVENESS_S", 0.2)
    with shell() as it:
        it.control.sendall(GRANT.pack(50_000, 1))
        assert it.has_ended()
        assert "lost before 0.05 s" in str(it.error)


def test_end_of_file_ends_lockstep():
    with shell() as it:
        it.grant(50_000)
        it.control.close()
        assert it.has_ended()
        assert it.error is None


def test_a_torn_grant_is_an_end_of_file():
    with shell() as it:
        it.control.sendall(GRANT.pack(50_000, 0)[:5])
        it.control.close()
        assert it.has_ended()
        assert it.process.vehicle.now_us == 0


def test_a_launcher_that_dies_within_a_tick_is_an_end_of_file_too():
    with shell() as it:
        it.control.sendall(GRANT.pack(20_000_000, 0))
        it.control.close()
        it.coordinator.close()
        assert it.has_ended()
        assert it.error is None


# Outside clients


def test_outside_clients_are_served_between_ticks_and_counted_once():
    port = UdpIn(HOST, 0)
    with shell(port) as it, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as gcs:
        gcs.connect((HOST, port.port))
        gcs.settimeout(PATIENCE_S)
        codec = Codec(255, 190)
        for _ in range(3):
            gcs.send(b"\xfd\x09garbage")
        assert codec.decode(gcs.recv(65535)), "whoever comes is greeted"
        (_, _, outside, _), _ = it.grant(50_000)
        assert outside == 0, "garbage is nobody"
        for _ in range(3):
            gcs.send(codec.encode([command(512, 0)]))
            answers = codec.decode(gcs.recv(65535))
            while not any(m.get_type() == "COMMAND_ACK" for m in answers):
                answers += codec.decode(gcs.recv(65535))
        (_, _, outside, _), _ = it.grant(100_000)
        assert outside == 1


def test_the_coordinators_bytes_do_not_change_when_somebody_watches():
    def ticks(it):
        return [it.grant((i + 1) * 50_000)[1] for i in range(40)]

    with shell() as it:
        alone = ticks(it)
    server = TcpServer(listen_tcp(HOST, 0))
    with (
        shell(server) as it,
        socket.create_connection((HOST, server.port), timeout=PATIENCE_S) as gcs,
    ):
        gcs.sendall(Codec(255).encode([command(511, 30, 10_000)]) + b"\xfd\xff noise")
        while not it.process.outside_clients:
            time.sleep(0.01)
        assert ticks(it) == alone
        assert gcs.recv(100)


def test_a_paused_lockstep_still_sends_heartbeats_to_those_who_wait():
    server = TcpServer(listen_tcp(HOST, 0))
    with shell(server), socket.create_connection((HOST, server.port), timeout=PATIENCE_S) as gcs:
        codec, heard = Codec(255), []
        while len(heard) < 2:
            heard += codec.decode(gcs.recv(65535))
        assert {m.get_type() for m in heard} == {"HEARTBEAT"}


# Free running


def test_free_running_follows_the_clock_and_stops_at_end_of_file():
    clock = [0.405]
    with shell(clock=lambda: clock[0]) as it:
        it.lives(400_000)
        ground = Codec(254, 190)
        it.coordinator.send(ground.encode([command(512, 148)]))
        names = []
        while "AUTOPILOT_VERSION" not in names:
            names += [m.get_type() for m in ground.decode(it.coordinator.recv(65535))]
        assert "COMMAND_ACK" in names
        assert it.process.vehicle.now_us == 400_000
        clock[0] = 0.605
        it.lives(600_000)
    assert it.process.vehicle.now_us == 600_000


def test_free_running_outlives_its_coordinator():
    clock = [0.0]
    with shell(clock=lambda: clock[0]) as it:
        it.coordinator.close()
        for tenths in range(4, 25, 4):  # it says something each second
            clock[0] = tenths * 0.1 + 0.005
            it.lives(tenths * 100_000)
        assert it.thread.is_alive()


# A real `mavherd vehicle`


@contextmanager
def by_hand(*args):
    """Run `mavherd vehicle ...`; yield the process and the line that tells its ports."""
    process = subprocess.Popen(
        [sys.executable, "-m", "mavherd", "vehicle", *args],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process, process.stdout.readline()
    finally:
        process.kill()
        process.communicate()


class Pilot:
    """A ground station on TCP, where nothing is lost however long somebody stands still."""

    def __init__(self, port):
        self.sock = socket.create_connection((HOST, port), timeout=PATIENCE_S)
        self.codec = Codec(255, 190)
        self.track = []

    def close(self):
        self.sock.close()

    def hear(self):
        """Wait for something; return it."""
        heard = self.codec.decode(self.sock.recv(65535))
        self.track += [m for m in heard if m.get_type() == "LOCAL_POSITION_NED"]
        return heard

    def command(self, number, *params):
        """Send a command; return the result in its answer."""
        self.sock.sendall(self.codec.encode([command(number, *params)]))
        while True:
            for m in self.hear():
                if m.get_type() == "COMMAND_ACK" and m.command == number:
                    return m.result


def attack(ports, over):
    """Random bytes, truncated frames and frames for nobody on every port, as fast as may be."""
    rng, good = random.Random(3), Codec(200, 1).encode([command(400, 0)])
    while not over.wait(0.002):
        junk = rng.choice(
            [rng.randbytes(rng.randrange(1, 1500)), good[: rng.randrange(len(good))], b"\xfd" * 300]
        )
        for kind, port in ports:
            with socket.socket(socket.AF_INET, kind) as sock, suppress(OSError):
                sock.settimeout(1)
                sock.connect((HOST, port))
                sock.send(junk)


def test_random_bytes_on_every_port_do_not_disturb_a_flight(hold_port):
    tcp = hold_port()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ground:
        ground.bind((HOST, 0))
        ground.settimeout(PATIENCE_S)
        out = f"{HOST}:{ground.getsockname()[1]}"
        args = ["--sysid", "3", "--instance", "0", "--tcp", str(tcp), "--udpout", out]
        with (
            by_hand("quadcopter", *args, "--udpin", f"{HOST}:0") as (process, line),
            ExitStack() as opened,
        ):
            port = int(re.search(rf"udpin:{HOST}:(\d+)", line)[1])
            assert f"tcp:{HOST}:{tcp}" in line
            _, vehicle = ground.recvfrom(65535)
            ports = [(socket.SOCK_DGRAM, port), (socket.SOCK_STREAM, tcp)]
            ports.append((socket.SOCK_DGRAM, vehicle[1]))  # which must be deaf to it
            pilot = opened.enter_context(closing(Pilot(tcp)))
            assert pilot.command(176, 1, 4) == 0
            assert pilot.command(400, 1) == 0
            assert pilot.command(22, 0, 0, 0, 0, 0, 0, 2) == 0
            pilot.track.clear()
            over = threading.Event()
            attacker = threading.Thread(target=attack, args=(ports, over))
            attacker.start()
            try:
                while len(pilot.track) < 45:
                    pilot.hear()
            finally:
                over.set()
                attacker.join()
            times = [m.time_boot_ms for m in pilot.track]
            steps = {b - a for a, b in pairwise(times[1:])}  # the very first comes at once
            assert steps == {100}, "10 Hz, all the time"
            assert pilot.track[-1].z == pytest.approx(-2, abs=0.3)
            assert pilot.codec.lost == 0
            assert pilot.command(512, 148) == 0
            process.send_signal(signal.SIGTERM)
            assert process.wait(PATIENCE_S) == 0
            assert "Traceback" not in process.stderr.read()


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_a_vehicle_by_hand_stops_cleanly(how):
    with by_hand("rover", "--tcp", "0", "--udpin", f"{HOST}:0") as (process, line):
        assert line.startswith("rover1: rover, system id 1: udpin:")
        process.stderr.readline()  # "Ctrl-C stops it."
        process.send_signal(how)
        assert process.wait(PATIENCE_S) == 0
        assert process.stderr.read() == ""


@pytest.mark.parametrize(
    ("args", "complaint"),
    [
        (["--tcp", "0", "--udpout", f"{HOST}:0"], "nobody can listen"),
        (["--tcp", "0", "--udpin", "nonsense"], "--udpin 'nonsense'"),
        (["--udpin", f"{HOST}:0", "--speed", "0"], "--speed"),
        (["--udpin", f"{HOST}:0", "--param", "maas=1"], "did you mean 'mass'"),
        (["--tcp", "65530", "--count", "2"], "ports end at 65535"),
    ],
)
def test_a_mistake_is_one_line_and_exit_code_2(args, complaint):
    done = subprocess.run(
        [sys.executable, "-m", "mavherd", "vehicle", "rover", *args],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.returncode == 2
    assert complaint in done.stderr
    assert done.stderr.startswith("mavherd: ")
    assert done.stderr.count("\n") == 1


def test_a_taken_port_is_named():
    with listen_tcp(HOST, 0) as taken:
        port = taken.getsockname()[1]
        done = subprocess.run(
            [sys.executable, "-m", "mavherd", "vehicle", "rover", "--tcp", str(port)],
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )
    assert done.returncode == 2
    assert f"tcp:{HOST}:{port}" in done.stderr
    assert os.linesep + "Traceback" not in done.stderr


def test_what_does_not_fit_one_datagram_comes_in_several_and_none_is_torn():
    parts = [bytes([k]) * 25_000 for k in range(5)]
    datagrams = _datagrams([*parts, b""])
    assert b"".join(datagrams) == b"".join(parts)
    assert [len(d) for d in datagrams] == [50_000, 50_000, 25_000]
    assert _datagrams([b"", b""]) == []
