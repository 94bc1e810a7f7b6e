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
from contextlib import contextmanager

import pytest

from mavherd.transport.errors import VehicleError
from mavherd.transport.links import TcpServer, UdpIn, listen_tcp, socket_pair_udp
from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.grants import DONE, GRANT
from mavherd.vehicles.process import VehicleProcess, _datagrams
from mavherd.vehicles.vehicle import Vehicle

HOST = "127.0.0.1"
CONFIG = VehicleConfig(kind="quadcopter", system_id=3, name="q3", seed=4)


class Shell:
    """A vehicle process in a thread, with the launcher's and the coordinator's ends of it."""

    def __init__(self, endpoints=(), free=False):
        self.coordinator, theirs = socket_pair_udp()
        self.control, control = socket.socketpair()
        self.coordinator.settimeout(5)
        self.control.settimeout(5)
        self.process = VehicleProcess(
            Vehicle(CONFIG), list(endpoints), coordinator=theirs, control=control
        )
        self.error = None
        self.free = free
        self._sockets = theirs, control, self.coordinator, self.control
        self.thread = threading.Thread(target=self._run)
        self.thread.start()

    def _run(self):
        try:
            if self.free:
                self.process.run_free()
            else:
                self.process.run_lockstep()
        except VehicleError as error:
            self.error = error

    def grant(self, until_us, incoming=0):
        """Grant time; return what the vehicle says is done and what it sent."""
        self.control.sendall(GRANT.pack(until_us, incoming))
        done = DONE.unpack(self.control.recv(DONE.size, socket.MSG_WAITALL))
        return done, self.coordinator.recv(65535) if done[1] else b""

    def close(self):
        self.control.close()
        self.thread.join(5)
        assert not self.thread.is_alive(), "end-of-file is the order to stop"
        self.process.close()
        for sock in self._sockets:
            sock.close()


@contextmanager
def shell(*endpoints, free=False):
    it = Shell(endpoints, free)
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
        it.thread.join(5)
        assert "lost before 0.05 s" in str(it.error)


def test_end_of_file_ends_lockstep():
    with shell() as it:
        it.grant(50_000)
        it.control.close()
        it.thread.join(2)
        assert not it.thread.is_alive()
        assert it.error is None


def test_a_torn_grant_is_an_end_of_file():
    with shell() as it:
        it.control.sendall(GRANT.pack(50_000, 0)[:5])
        it.control.close()
        it.thread.join(2)
        assert not it.thread.is_alive()
        assert it.process.vehicle.now_us == 0


def test_a_launcher_that_dies_within_a_tick_is_an_end_of_file_too():
    with shell() as it:
        it.control.sendall(GRANT.pack(20_000_000, 0))
        it.control.close()
        it.coordinator.close()
        it.thread.join(10)
        assert not it.thread.is_alive()
        assert it.error is None


# Outside clients


def test_outside_clients_are_served_between_ticks_and_counted_once():
    port = UdpIn(HOST, 0)
    with shell(port) as it, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as gcs:
        gcs.connect((HOST, port.port))
        gcs.settimeout(5)
        codec = Codec(255, 190)
        for _ in range(3):
            gcs.send(b"\xfd\x09garbage")
        time.sleep(0.05)
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
    with shell(server) as it, socket.create_connection((HOST, server.port), timeout=5) as gcs:
        gcs.sendall(Codec(255).encode([command(511, 30, 10_000)]) + b"\xfd\xff noise")
        while not it.process.outside_clients:
            time.sleep(0.01)
        assert ticks(it) == alone
        assert gcs.recv(100)


def test_a_paused_lockstep_still_sends_heartbeats_to_those_who_wait():
    server = TcpServer(listen_tcp(HOST, 0))
    with shell(server), socket.create_connection((HOST, server.port), timeout=5) as gcs:
        codec, heard = Codec(255), []
        while len(heard) < 2:
            heard += codec.decode(gcs.recv(65535))
        assert {m.get_type() for m in heard} == {"HEARTBEAT"}


# Free running


def test_free_running_follows_the_wall_clock_and_stops_at_end_of_file():
    with shell(free=True) as it:
        began = time.monotonic()
        while it.process.vehicle.now_us < 400_000:
            assert time.monotonic() - began < 5
            time.sleep(0.01)
        assert time.monotonic() - began > 0.3
        ground = Codec(254, 190)
        it.coordinator.send(ground.encode([command(512, 148)]))
        names = []
        while "AUTOPILOT_VERSION" not in names:
            names += [m.get_type() for m in ground.decode(it.coordinator.recv(65535))]
        assert "COMMAND_ACK" in names


def test_free_running_outlives_its_coordinator():
    with shell(free=True) as it:
        it.coordinator.close()
        before = it.process.vehicle.now_us
        time.sleep(0.3)
        assert it.process.vehicle.now_us > before
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


def udp_client(port=None):
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind((HOST, 0))
    if port is not None:
        sock.connect((HOST, port))
    sock.settimeout(5)
    return sock


class Pilot:
    """A ground station on one UDP port."""

    def __init__(self, port):
        self.sock = udp_client(port)
        self.codec = Codec(255, 190)

    def hear(self, seconds):
        heard, deadline = [], time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0:
            self.sock.settimeout(left)
            try:
                heard += self.codec.decode(self.sock.recv(65535), stream=False)
            except TimeoutError:
                break
        return heard

    def command(self, number, *params):
        self.sock.settimeout(5)  # `hear` leaves what was left of its own time
        self.sock.send(self.codec.encode([command(number, *params)]))
        deadline = time.monotonic() + 5
        while time.monotonic() < deadline:
            for m in self.codec.decode(self.sock.recv(65535), stream=False):
                if m.get_type() == "COMMAND_ACK" and m.command == number:
                    return m.result
        raise AssertionError(f"no answer to {number}")


def attack(ports, seconds):
    """Random bytes, truncated frames and frames for nobody on every port, as fast as may be."""
    rng, good = random.Random(3), Codec(200, 1).encode([command(400, 0)])
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        junk = rng.choice(
            [rng.randbytes(rng.randrange(1, 1500)), good[: rng.randrange(len(good))], b"\xfd" * 300]
        )
        for kind, port in ports:
            with socket.socket(socket.AF_INET, kind) as sock:
                sock.settimeout(1)
                if sock.connect_ex((HOST, port)) == 0:
                    sock.send(junk)
        time.sleep(0.002)


def test_random_bytes_on_every_port_do_not_disturb_a_flight():
    with udp_client() as ground:
        out = f"{HOST}:{ground.getsockname()[1]}"
        with listen_tcp(HOST, 0) as free:
            tcp = free.getsockname()[1]
        args = ["--sysid", "3", "--instance", "0", "--tcp", str(tcp), "--udpout", out]
        with by_hand("quadcopter", *args, "--udpin", f"{HOST}:0") as (process, line):
            port = int(re.search(rf"udpin:{HOST}:(\d+)", line)[1])
            assert f"tcp:{HOST}:{tcp}" in line
            _, vehicle = ground.recvfrom(65535)
            ports = [(socket.SOCK_DGRAM, port), (socket.SOCK_STREAM, tcp)]
            ports.append((socket.SOCK_DGRAM, vehicle[1]))  # which must be deaf to it
            pilot = Pilot(port)
            assert pilot.command(176, 1, 4) == 0
            assert pilot.command(400, 1) == 0
            assert pilot.command(22, 0, 0, 0, 0, 0, 0, 2) == 0
            attacker = threading.Thread(target=attack, args=(ports, 3.5))
            attacker.start()
            heard = pilot.hear(4.5)
            attacker.join()
            track = [m for m in heard if m.get_type() == "LOCAL_POSITION_NED"]
            assert len(track) > 35, "10 Hz, all the time"
            assert track[-1].z == pytest.approx(-2, abs=0.3)
            assert pilot.codec.lost == 0
            assert pilot.command(512, 148) == 0
            process.send_signal(signal.SIGTERM)
            assert process.wait(5) == 0
            assert "Traceback" not in process.stderr.read()
            pilot.sock.close()


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_a_vehicle_by_hand_stops_cleanly(how):
    with by_hand("rover", "--tcp", "0", "--udpin", f"{HOST}:0") as (process, line):
        assert line.startswith("rover1: rover, system id 1: udpin:")
        process.stderr.readline()  # "Ctrl-C stops it."
        time.sleep(0.1)
        process.send_signal(how)
        assert process.wait(5) == 0
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
        timeout=20,
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
            timeout=20,
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
