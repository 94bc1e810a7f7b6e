"""Lines to external vehicles mend themselves, never wait, and say what is wrong."""

import errno
import os
import pty
import select
import socket
import sys
import termios
import time
import tty
from contextlib import closing, contextmanager, suppress
from itertools import pairwise

import pytest
import serial

from mavherd.transport.connect import Address, parse_connect
from mavherd.transport.errors import LinkError
from mavherd.transport.lines import TcpClient, open_line
from mavherd.transport.serial_line import SerialLine

HOST = "127.0.0.1"
PATIENCE = 60.0


class Clock:
    """Time that passes when a test says so."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


def until(condition, what):
    deadline = time.monotonic() + PATIENCE
    while not (value := condition()):
        assert time.monotonic() < deadline, what
        time.sleep(0.005)
    return value


def hear(line, count):
    """Return `count` bytes from a line."""
    got = b""

    def more():
        nonlocal got
        got += b"".join(data for _, data in line.receive())
        return len(got) >= count

    until(more, f"{count} bytes of {line.label}")
    return got


def closed_port(port=0):
    """Return a socket that keeps a port where nobody listens; `server` can."""
    sock = socket.socket()
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    sock.bind((HOST, port))
    sock.settimeout(PATIENCE)
    return sock


def server(port=0):
    sock = closed_port(port)
    sock.listen()
    return sock


def tcp_address(sock):
    return parse_connect(f"tcp:{HOST}:{sock.getsockname()[1]}")


def connected(line):
    return until(lambda: list(line.receive()) or not line.problem, "a connection")


# TCP


def test_a_tcp_line_carries_bytes_both_ways():
    with server() as listening, closing(open_line(tcp_address(listening))) as line:
        connected(line)
        peer, _ = listening.accept()
        with peer:
            line.send(b"to the vehicle")
            assert peer.recv(100) == b"to the vehicle"
            peer.send(b"to the ground")
            assert hear(line, 13) == b"to the ground"
            assert line.sockets()


def test_opening_a_tcp_line_does_not_wait_for_an_answer():
    with socket.socket() as deaf:
        deaf.bind((HOST, 0))
        deaf.listen(0)
        port = deaf.getsockname()[1]
        waiting = [socket.socket() for _ in range(4)]  # fill its queue: the next call hangs
        for sock in waiting:
            sock.setblocking(False)
            sock.connect_ex((HOST, port))
        assert select.select([deaf], [], [], PATIENCE)[0]
        clock = Clock()
        with closing(TcpClient(parse_connect(f"tcp:{HOST}:{port}"), clock)) as line:
            assert list(line.receive()) == []
            line.send(b"anybody?")
            assert line.problem == "not connected yet"  # a call that blocks ends in minutes
            clock.now += 6
            assert list(line.receive()) == []
            assert line.problem == "no answer"
        for sock in waiting:
            sock.close()


def test_a_socket_that_cannot_be_had_is_a_problem_and_tried_again(monkeypatch):
    def no_ip6(*_):
        raise OSError(errno.EAFNOSUPPORT, "")

    with server() as listening:
        address, clock = tcp_address(listening), Clock()
        with monkeypatch.context() as patched:
            patched.setattr(socket, "socket", no_ip6)
            line = TcpClient(address, clock)
            assert line.problem == "address family not supported by protocol"
            assert list(line.receive()) == []
        with closing(line):
            clock.now += 10
            connected(line)
            assert line.problem == ""


def test_a_refused_tcp_connection_is_tried_again_less_and_less_often():
    clock, attempts = Clock(), []
    with closed_port() as port, closing(TcpClient(tcp_address(port), clock)) as line:

        def refused():
            assert list(line.receive()) == []
            return line._dialling is None

        until(refused, "a refusal")
        assert line.problem == "connection refused"
        dial = line._dial
        line._dial = lambda: (attempts.append(clock.now), dial())
        while clock.now < 125:
            clock.now += 0.125
            until(refused, "a refusal")
        pauses = [b - a for a, b in pairwise(attempts)]
        assert attempts[0] - 100 <= 0.625
        assert pauses[0] == pytest.approx(1.0, abs=0.25)
        assert pauses == sorted(pauses)
        assert 5.0 <= pauses[-1] <= 5.25


def test_a_tcp_line_connects_as_soon_as_the_vehicle_is_started_and_again_when_it_is_restarted():
    with closed_port() as port, closing(open_line(tcp_address(port))) as line:
        until(lambda: list(line.receive()) or "refused" in line.problem, "a refusal")
        for _ in range(2):
            with server(port.getsockname()[1]) as listening:
                connected(line)
                peer, _ = listening.accept()
                with peer:
                    peer.send(b"here")
                    assert hear(line, 4) == b"here"
            until(lambda: list(line.receive()) or line.problem, "the loss")
            assert line.problem in ("connection closed by the other end", "connection refused")
            line.send(b"into the void")


def test_a_tcp_line_does_not_take_itself_for_the_vehicle():
    itself = socket.socket()
    itself.bind((HOST, 0))
    itself.connect(itself.getsockname())  # so does the kernel when it picks the port called
    with closed_port() as port, closing(TcpClient(tcp_address(port))) as line:
        until(lambda: list(line.receive()) or line._dialling is None, "a refusal")
        line._dialling, line.problem = itself, ""
        line._await(itself)
        assert line.problem == "connection refused"
        assert line.sockets() == []


def test_what_a_standing_link_does_not_take_is_dropped_in_whole_messages():
    offered = 200_000
    with server() as listening:
        # A fixed size: the kernel would let a buffer grow to megabytes by itself.
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 16)
        with closing(open_line(tcp_address(listening))) as line:
            connected(line)
            peer, _ = listening.accept()
            # Nobody reads for as long as the loop takes.
            line.sockets()[0].setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, 0)
            with peer, peer.makefile("rb") as far:
                peer.settimeout(PATIENCE)
                for i in range(offered):
                    line.send(b"%09d\n" % i)
                words = []
                for more in (b"the last\n", b""):
                    while line.congested:
                        words.append(far.readline())
                        line.send(b"")
                    line.send(more)
                line.close()
                words += far.readlines()
    assert words.pop() == b"the last\n"
    assert {len(word) for word in words} == {10}
    numbers = [int(word) for word in words]
    assert numbers[0] == 0
    assert all(a < b for a, b in pairwise(numbers))
    assert len(numbers) < offered / 2


def test_a_host_that_nobody_knows_is_said_at_once():
    with pytest.raises(LinkError, match=r"tcp:nobody\.invalid:5760: host 'nobody\.invalid': "):
        open_line(parse_connect("tcp:nobody.invalid:5760"))


# UDP


def test_a_udpout_line_says_that_nobody_listens_until_somebody_does():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        vehicle.bind((HOST, 0))
        vehicle.connect((HOST, 1))  # so it hears nobody, and keeps its port
        with closing(open_line(parse_connect(f"udpout:{HOST}:{vehicle.getsockname()[1]}"))) as line:

            def refused():
                line.send(b"anybody?")
                return list(line.receive()) or line.problem

            until(refused, "a refusal")
            assert line.problem == "connection refused"
            vehicle.connect(line.sockets()[0].getsockname())
            vehicle.setblocking(False)

            def heard():
                line.send(b"anybody?")
                with suppress(BlockingIOError):
                    return vehicle.recv(100)

            assert until(heard, "a datagram at the vehicle") == b"anybody?"
            vehicle.send(b"yes")
            assert hear(line, 3) == b"yes"
            assert line.problem == ""


def test_a_taken_udp_port_is_an_error_at_once():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind((HOST, 0))
        address = parse_connect(f"udpin:{HOST}:{other.getsockname()[1]}")
        with pytest.raises(LinkError, match="a ground station perhaps"):
            open_line(address)


def test_fifty_vehicles_may_send_to_one_port():
    address = Address(text="any", scheme="udpin", host=HOST, port=0)
    with closing(open_line(address)) as line:
        vehicles = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(50)]
        for sock in vehicles:
            sock.sendto(b"x", (HOST, line.port))
        hear(line, 50)
        assert len(line.links()) == 50
        for sock in vehicles:
            sock.close()


# serial


@contextmanager
def radio():
    """Yield the far end of a serial line, and its device."""
    far, near = pty.openpty()
    tty.setraw(near)
    os.set_blocking(far, False)
    try:
        yield far, os.ttyname(near)
    finally:
        for fd in (far, near):
            with suppress(OSError):
                os.close(fd)


def read_far(far, count):
    got = b""

    def more():
        nonlocal got
        with suppress(BlockingIOError):
            got += os.read(far, 4096)
        return len(got) >= count

    until(more, "bytes at the far end")
    return got


def test_a_serial_line_carries_bytes_both_ways():
    with radio() as (far, device), closing(open_line(parse_connect(f"serial:{device}"))) as line:
        assert line.problem == ""
        assert list(line.receive()) == []
        every_byte = bytes(range(256))
        line.send(every_byte)
        assert read_far(far, 256) == every_byte
        os.write(far, every_byte)
        assert hear(line, 256) == every_byte
        assert line.sockets()[0].fileno() >= 0


def test_a_serial_line_that_takes_nothing_holds_nobody_up():
    with radio() as (far, device), closing(open_line(parse_connect(f"serial:{device}"))) as line:
        for i in range(2000):
            line.send(b"%0100d\n" % i)  # one that blocks never ends
        got = b""

        def has_room():
            nonlocal got
            with suppress(BlockingIOError):
                got += os.read(far, 4096)
            return list(line.receive()) or not line.congested

        until(has_room, "room")
        line.send(b"the last")
        until(lambda: has_room() and got.endswith(b"the last"), "all that was taken")
        *words, _ = got.split(b"\n")
        assert {len(word) for word in words} == {100}
        assert 0 < len(words) < 1000


def test_a_serial_device_that_vanishes_is_reported_and_opened_again(tmp_path):
    device, clock = tmp_path / "ttyUSB0", Clock()
    with closing(SerialLine(parse_connect(f"serial:{device}"), clock)) as line:
        assert line.problem == "no such device (plugged in, and powered?)"
        assert line.sockets() == []
        line.send(b"into the void")
        with radio() as (far, name):
            device.symlink_to(name)
            assert list(line.receive()) == []  # its time has not come
            assert line.problem
            clock.now += 1
            list(line.receive())
            assert line.problem == ""
            os.write(far, b"here")
            assert hear(line, 4) == b"here"
            device.unlink()
        until(lambda: list(line.receive()) or line.problem, "the loss")
        assert "vanished" in line.problem
        assert line.sockets() == []
        with radio() as (far, name):
            device.symlink_to(name)
            clock.now += 6
            list(line.receive())  # opens it, and forgets what came before
            os.write(far, b"back")
            assert hear(line, 4) == b"back"


def test_a_serial_device_that_vanishes_while_it_is_opened_is_a_problem_too(monkeypatch):
    def gone(*_, **__):
        raise termios.error(errno.EIO, "Input/output error")

    monkeypatch.setattr(serial, "Serial", gone)
    with closing(SerialLine(parse_connect("serial:/dev/ttyUSB9"))) as line:
        assert line.problem == "the device has vanished"


def test_a_serial_device_of_another_program_is_not_shared():
    with radio() as (_, device):
        address = parse_connect(f"serial:{device}")
        with closing(open_line(address)), closing(open_line(address)) as second:
            assert second.problem == "in use by another program"


def test_without_pyserial_a_serial_address_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(LinkError, match=r"pip install 'mavherd\[serial\]'"):
        open_line(parse_connect("serial:/dev/ttyUSB0"))
