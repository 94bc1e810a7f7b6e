"""One vehicle by hand serves stock clients and nobody can harm it."""

import os
import random
import re
import signal
import socket
import subprocess
import sys
import time
from contextlib import closing, suppress
from itertools import pairwise
from pathlib import Path

import pytest

from mavherd.transport.mavlink import Codec, mav

EXAMPLE = Path(__file__).parents[2] / "examples" / "fly_square.py"


def stop(sandbox, vehicle):
    vehicle.send_signal(signal.SIGINT)
    done = sandbox.finish(vehicle)
    assert done.code == 0
    return done


@pytest.mark.parametrize("link", ["tcp", "udp"])
def test_a_stock_script_flies_a_square_while_a_second_client_watches(sandbox, link):
    gcs, api = (sandbox.free_port(socket.SOCK_DGRAM) for _ in range(2))
    tcp = sandbox.free_port()
    with closing(sandbox.connect(f"udpin:127.0.0.1:{gcs}")) as watcher:
        options = "--tcp", tcp, "--udpout", f"127.0.0.1:{gcs}", "--udpout", f"127.0.0.1:{api}"
        vehicle = sandbox.start("vehicle", "quadcopter", "--speed", 5, *options)
        assert f"tcp:127.0.0.1:{tcp}" in vehicle.stdout.readline()
        address = f"tcp:127.0.0.1:{tcp}" if link == "tcp" else f"udpin:127.0.0.1:{api}"
        heartbeat = watcher.wait_heartbeat(timeout=60)
        assert not heartbeat.base_mode & 128
        sandbox.greet(watcher)  # from here on it gets more than heartbeats
        watcher.recv_match(type="LOCAL_POSITION_NED", blocking=True, timeout=60)
        script = subprocess.Popen(
            [sys.executable, EXAMPLE, address], stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )
        north_east, up, armed = [], [], []
        while script.poll() is None:
            m = watcher.recv_match(blocking=True, timeout=1)
            match m and m.get_type():
                case "LOCAL_POSITION_NED":
                    north_east.append((m.x, m.y))
                case "GLOBAL_POSITION_INT":
                    up.append(m.relative_alt / 1e3)
                case "HEARTBEAT":
                    armed.append(bool(m.base_mode & 128))
        out = script.stdout.read().decode()
        script.stdout.close()
        assert script.returncode == 0, out
        assert out.splitlines()[-1] == "landed and disarmed"
        sandbox.wait_for(
            lambda: not watcher.recv_match(type="HEARTBEAT", blocking=True).base_mode & 128,
            "the second client sees the vehicle disarmed",
        )
    stop(sandbox, vehicle)
    assert True in armed
    assert 2.8 < max(up) < 3.3
    assert is_square(north_east)


def is_square(places):
    """Return whether the places pass all corners in turn and stay on the sides."""
    corners = [(5, 0), (5, 5), (0, 5), (0, 0)]
    for place in places:
        if corners and max(abs(place[0] - corners[0][0]), abs(place[1] - corners[0][1])) < 0.3:
            corners.pop(0)
        from_side = min(abs(x - side) for x in place for side in (0, 5))
        assert from_side < 0.4, place
    return not corners


def test_garbage_on_every_port_does_no_harm(sandbox):
    rng = random.Random(1)
    tcp = sandbox.free_port()
    options = "--tcp", tcp, "--udpin", "127.0.0.1:0", "--speed", 5
    vehicle = sandbox.start("vehicle", "rover", *options)
    udp = int(re.search(r"udpin:127.0.0.1:(\d+)", vehicle.stdout.readline())[1])
    with (
        socket.create_connection(("127.0.0.1", tcp)) as stream,
        socket.socket(type=socket.SOCK_DGRAM) as datagrams,
        closing(sandbox.connect(f"udpout:127.0.0.1:{udp}")) as client,
    ):
        sandbox.greet(client)
        frame = client.recv_match(type="HEARTBEAT", blocking=True, timeout=60).get_msgbuf()
        for _ in range(300):
            cut = bytes(frame[: rng.randrange(1, len(frame))])
            flipped = bytes(b ^ (rng.random() < 0.1) for b in frame)
            for junk in (rng.randbytes(rng.randrange(1, 600)), cut, flipped, b""):
                datagrams.sendto(junk, ("127.0.0.1", udp))
                stream.sendall(junk)
    with closing(sandbox.connect(f"tcp:127.0.0.1:{tcp}")) as client:
        sandbox.greet(client)
        assert client.recv_match(type="LOCAL_POSITION_NED", blocking=True, timeout=60)
    stop(sandbox, vehicle)


def test_a_client_that_reads_nothing_holds_up_nobody(sandbox):
    tcp = sandbox.free_port()
    vehicle = sandbox.start("vehicle", "rover", "--tcp", tcp, "--speed", 50)
    vehicle.stdout.readline()
    with (
        socket.create_connection(("127.0.0.1", tcp)) as deaf,
        closing(sandbox.connect(f"tcp:127.0.0.1:{tcp}")) as client,
    ):
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        sandbox.greet(client)
        m = client.recv_match(type="SYSTEM_TIME", blocking=True, timeout=60)
        later = m.time_boot_ms + 20_000
        sandbox.wait_for(
            lambda: client.recv_match(type="SYSTEM_TIME", blocking=True).time_boot_ms > later,
            "time goes on",
        )
    stop(sandbox, vehicle)


FLOOD = """
import socket, sys, time
data = bytes.fromhex(sys.argv[2])
with socket.socket(type=socket.SOCK_DGRAM) as sock:
    sock.connect(("127.0.0.1", int(sys.argv[1])))
    sock.setblocking(False)
    began, sent = time.monotonic(), 0
    while True:
        try:
            sock.send(data)
        except OSError:
            pass
        sent += 1
        if (early := sent / 50_000 - (time.monotonic() - began)) > 0.01:
            time.sleep(early)
"""


def test_fifty_thousand_commands_a_second_on_its_port_do_not_slow_it_down(sandbox):
    vehicle = sandbox.start("vehicle", "quadcopter", "--udpin", "127.0.0.1:0")
    port = re.search(r"udpin:127.0.0.1:(\d+)", vehicle.stdout.readline())[1]
    command = mav.MAVLink_command_long_message(1, 1, mav.MAV_CMD_REQUEST_MESSAGE, 0, 148, *[0] * 6)
    flood = Codec(66, 1).encode([command]).hex()
    with closing(sandbox.connect(f"udpout:127.0.0.1:{port}")) as client:
        sandbox.greet(client)
        flooder = subprocess.Popen([sys.executable, "-c", FLOOD, port, flood])
        try:
            times, costs = [], []  # its own clock, and (wall clock, processor)
            while not times or times[-1] - times[0] < 3:
                sandbox.greet(client)  # which the flood may wash away
                if m := client.recv_match(type="ATTITUDE", blocking=True, timeout=1):
                    times.append(m.time_boot_ms / 1000)
                    costs.append((time.monotonic(), cpu_of(vehicle.pid)))
            assert flooder.poll() is None
        finally:
            flooder.kill()
            flooder.wait()
    assert max(later - earlier for earlier, later in pairwise(times)) < 0.15, "at 10 Hz"
    wall, cpu = (last - first for first, last in zip(costs[5], costs[-1], strict=True))
    # at first it is starting up, and who gets no processor is slow without a flood
    assert times[-1] - times[5] > 0.9 * wall or cpu < 0.8 * wall
    stop(sandbox, vehicle)


def cpu_of(pid):
    """Return the processor time, s, that a process has had."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


STOPS = signal.SIGINT, signal.SIGTERM, signal.SIGHUP


@pytest.mark.parametrize("how", STOPS)
def test_it_runs_until_it_is_stopped(sandbox, how):
    vehicle = sandbox.start("vehicle", "quadcopter", "--udpin", "127.0.0.1:0")
    vehicle.stdout.readline()
    vehicle.send_signal(how)
    done = sandbox.finish(vehicle)
    assert done.code == 0


def test_nohup_keeps_it_running(sandbox):
    with listener() as station:
        vehicle = sandbox.start("vehicle", "rover", "--udpout", address(station), prefix=("nohup",))
        hear(station, 1)
        vehicle.send_signal(signal.SIGHUP)
        greet_until(station, {1}, "ATTITUDE")
    stop(sandbox, vehicle)


class Fleet:
    """Several vehicles of one command, all of them at work."""

    def __init__(self, sandbox, station, count=3, **popen):
        words = "vehicle", "rover", "-n", count, "--udpin", "127.0.0.1:0"
        self.parent = sandbox.start(*words, "--udpout", address(station), **popen)
        greet_until(station, range(1, count + 1), "ATTITUDE")
        self.children = sorted(sandbox.processes().keys() - {self.parent.pid})


def listener():
    """Return a socket where a ground station listens."""
    station = socket.socket(type=socket.SOCK_DGRAM)
    station.bind(("127.0.0.1", 0))
    station.settimeout(60)
    return station


def address(station):
    return f"127.0.0.1:{station.getsockname()[1]}"


def hear(station, count):
    """Wait for so many vehicles; return their addresses by system id."""
    found, codec = {}, Codec(255, 190)
    while len(found) < count:
        data, sender = station.recvfrom(4096)
        found |= {m.get_srcSystem(): sender for m in codec.decode(data, stream=False)}
    return found


def greet_until(station, system_ids, name):
    """Send heartbeats to whoever is heard; return one `name` of each of these vehicles."""
    codec, waiting, found = Codec(255, 190), set(system_ids), {}
    beat = mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    while waiting:
        data, sender = station.recvfrom(4096)
        for m in codec.decode(data, stream=False):
            if m.get_type() == "HEARTBEAT":
                station.sendto(codec.encode([beat]), sender)
            elif m.get_type() == name:
                waiting.discard(m.get_srcSystem())
                found[m.get_srcSystem()] = m
    return found


def test_ten_vehicles_at_one_station_are_ten_processes_with_ports_of_their_own(sandbox):
    with listener() as station:
        fleet = Fleet(sandbox, station, 10)
        assert len(fleet.children) == 10
        assert sorted(hear(station, 10)) == list(range(1, 11))
        places = greet_until(station, range(1, 11), "LOCAL_POSITION_NED")
        assert [round(places[i].y) for i in range(1, 11)] == [3 * i for i in range(10)]
    fleet.parent.send_signal(signal.SIGINT)
    done = sandbox.finish(fleet.parent)
    assert done.code == 0
    lines = done.out.splitlines()
    assert [line.split(":")[0] for line in lines] == [f"rover{i}" for i in range(1, 11)]
    assert len({re.search(r"udpin:127.0.0.1:(\d+)", line)[1] for line in lines}) == 10


@pytest.mark.parametrize("how", STOPS)
@pytest.mark.parametrize("whom", ["the command", "its terminal"])
def test_several_end_together(sandbox, how, whom):
    with listener() as station:
        fleet = Fleet(sandbox, station, start_new_session=True)
    (os.kill if whom == "the command" else os.killpg)(fleet.parent.pid, how)
    with suppress(ProcessLookupError):
        fleet.parent.send_signal(signal.SIGINT)  # people press it twice
    done = sandbox.finish(fleet.parent)
    assert done.code == 0
    assert done.err == "Ctrl-C stops them.\n"


def test_signals_that_come_together_are_one_and_even_who_hangs_is_ended(sandbox):
    with listener() as station:
        fleet = Fleet(sandbox, station)
    os.kill(fleet.children[0], signal.SIGSTOP)
    for each in (signal.SIGSTOP, *STOPS, signal.SIGCONT):
        os.kill(fleet.parent.pid, each)
    done = sandbox.finish(fleet.parent)
    assert (done.code, done.err) == (0, "Ctrl-C stops them.\n")


def test_none_outlives_a_command_that_was_killed(sandbox):
    with listener() as station:
        fleet = Fleet(sandbox, station)
    fleet.parent.kill()
    sandbox.wait_for(lambda: not sandbox.processes(), "all have ended")


@pytest.mark.parametrize(
    ("how", "prefix"),
    [(signal.SIGKILL, ()), (signal.SIGTERM, ()), (signal.SIGKILL, ("env", "--ignore-signal=CHLD"))],
)
def test_one_that_dies_ends_the_others(sandbox, how, prefix):
    with listener() as station:
        fleet = Fleet(sandbox, station, prefix=prefix)
    os.kill(fleet.children[1], how)
    done = sandbox.finish(fleet.parent)
    assert done.code == 3
    expected = rf"rover\d ended by itself \({how.name}\); the others have been stopped"
    assert re.search(expected, done.complaint)


def test_one_that_hangs_is_ended_all_the_same(sandbox):
    with listener() as station:
        fleet = Fleet(sandbox, station)
    os.kill(fleet.children[0], signal.SIGSTOP)
    fleet.parent.send_signal(signal.SIGTERM)
    assert sandbox.finish(fleet.parent).code == 0
