"""Several clients at once, on real sockets: heard by one another, each in its own MAVLink.

Nobody is starved by a flood, and the coordinator's private link takes no part in any of it.
"""

import socket
import threading
import time
from contextlib import closing, contextmanager, suppress

import pytest

from mavherd.transport.links import TcpServer, UdpIn, UdpOut, listen_tcp, socket_pair_udp
from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles import process as process_module
from mavherd.vehicles.attention import Attention
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.process import VehicleProcess
from mavherd.vehicles.vehicle import Vehicle

HOST = "127.0.0.1"
OWN = 3
PATIENCE = 60.0  # s, on a machine that stands still now and then


class Clock:
    """The wall clock, until it is held."""

    held = None

    def __call__(self):
        return time.monotonic() if self.held is None else self.held

    def hold(self):
        self.held = time.monotonic()


@contextmanager
def running(*endpoints, coordinator=None, clock=time.monotonic):
    """Run a vehicle process in a thread, by a clock."""
    control, theirs = socket.socketpair()
    vehicle = Vehicle(VehicleConfig(kind="rover", system_id=OWN, name="r3", seed=4))
    process = VehicleProcess(vehicle, list(endpoints), control=theirs, coordinator=coordinator)
    thread = threading.Thread(target=process.run_free, kwargs={"clock": clock})
    thread.start()
    try:
        yield process
    finally:
        control.close()
        thread.join(PATIENCE)
        process.close()
        theirs.close()
        assert not thread.is_alive()


class Station:
    """A ground station, or another vehicle, on one link of ours."""

    def __init__(self, sock, system, component=190, version=2):
        self.sock = sock
        self.codec = Codec(system, component)
        self.codec.version = version
        self.version = version
        self.heard = []
        self.frames = []

    def send(self, *messages):
        self.codec.version = self.version  # whatever it hears
        frames = self.codec.frames(messages)
        self.sock.sendall(b"".join(frames))
        return frames

    def beat(self):
        return self.send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))

    def hear(self, name, sender=None, seconds=PATIENCE, **fields):
        """Wait for a message; return it, None when it does not come."""
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0:
            self.sock.settimeout(left)
            try:
                data = self.sock.recv(65535)
            except TimeoutError:
                break
            found = None
            for m, frame in self.codec.decode_frames(data):
                self.heard.append(m)
                self.frames.append(frame)
                is_it = m.get_type() == name and sender in (None, m.get_srcSystem())
                if is_it and all(getattr(m, k) == v for k, v in fields.items()):
                    found = m
            if found:
                return found
        return None

    def command(self, number, *params, system=OWN, component=1):
        p = (*params, *(0,) * (7 - len(params)))
        return self.send(mav.MAVLink_command_long_message(system, component, number, 0, *p))

    def ask(self, number, *params, **target):
        """Send a command until it is answered, for datagrams may be lost; return the result."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            self.command(number, *params, **target)
            if ack := self.hear("COMMAND_ACK", seconds=0.5, command=number):
                return ack.result
        raise AssertionError(f"no answer to {number}")

    def has_heard(self, name, sender=None):
        """Return whether such a message came before the vehicle's next answer."""
        self.ask(mav.MAV_CMD_REQUEST_MESSAGE, 0)
        return any(m.get_type() == name and sender in (None, m.get_srcSystem()) for m in self.heard)


@pytest.fixture
def open_later():
    """Close these when the test is over."""
    sockets = []
    yield sockets.append
    for sock in sockets:
        sock.close()


@pytest.fixture
def net(open_later):
    """Return a process with a TCP and a UDP port, and functions that dial them."""

    class Net:
        def __init__(self, process, server, port, clock):
            self.process, self.server, self.port, self.clock = process, server, port, clock

        def tcp(self, *args, **kwargs):
            sock = socket.create_connection((HOST, self.server.port), timeout=PATIENCE)
            open_later(sock)
            return Station(sock, *args, **kwargs)

        def udp(self, *args, **kwargs):
            sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            sock.connect((HOST, self.port.port))
            open_later(sock)
            return Station(sock, *args, **kwargs)

    server, port, clock = TcpServer(listen_tcp(HOST, 0)), UdpIn(HOST, 0), Clock()
    with running(server, port, clock=clock) as process:
        yield Net(process, server, port, clock)


def met(*stations):
    """Have every station heard before anything else is tried."""
    for station in stations:
        assert station.ask(mav.MAV_CMD_REQUEST_MESSAGE, 0) is not None
    for station in stations:
        station.beat()


# Forwarding


def test_two_stations_see_one_anothers_heartbeats(net):
    a, b = net.tcp(255), net.udp(254)
    met(a, b)
    for one, other, system in ((a, b, 255), (b, a, 254)):
        (frame,) = one.beat()
        while frame not in other.frames:  # not a byte of which is changed
            assert other.hear("HEARTBEAT", system)


def test_a_command_reaches_another_vehicle_through_us_and_its_answer_comes_back(net):
    station, vehicle = net.tcp(255), net.udp(77, 1)
    met(station, vehicle)
    (sent,) = station.command(400, 1, system=77)
    heard = vehicle.hear("COMMAND_LONG", 255)
    assert (heard.target_system, heard.command) == (77, 400)
    assert sent in vehicle.frames
    vehicle.send(mav.MAVLink_command_ack_message(400, 2, 0, 0, 255, 190))
    assert station.hear("COMMAND_ACK", 77).result == 2


def test_what_is_meant_for_us_is_not_shown_to_others(net):
    a, b = net.tcp(255), net.udp(254)
    met(a, b)
    for _ in range(5):
        assert a.ask(mav.MAV_CMD_REQUEST_MESSAGE, 0) is not None
    assert not b.has_heard("COMMAND_LONG")


def test_a_camera_of_ours_on_another_link_answers_for_itself(net):
    station, camera = net.tcp(255), net.udp(OWN, 100)
    met(station, camera)
    station.command(521, 1, component=100)
    assert camera.hear("COMMAND_LONG", 255).target_component == 100
    camera.send(mav.MAVLink_command_ack_message(521, 0, 0, 0, 255, 190))
    assert station.hear("COMMAND_ACK", command=521)
    station.ask(mav.MAV_CMD_REQUEST_MESSAGE, 0)
    acks = [m for m in station.heard if m.get_type() == "COMMAND_ACK" and m.command == 521]
    assert [(m.get_srcComponent(), m.result) for m in acks] == [(100, 0)], "and we do not"


def test_a_station_on_two_links_does_not_hear_itself_or_make_a_loop(net):
    a, b, c = net.tcp(255), net.udp(255), net.tcp(254)
    met(a, b, c)
    for _ in range(20):
        a.beat()
        b.beat()
    assert c.hear("HEARTBEAT", 255)
    met(a, b)
    assert not a.has_heard("HEARTBEAT", 255)
    assert not b.has_heard("HEARTBEAT", 255)


def test_two_bridges_between_our_links_make_no_loop(net):
    a, b, c = net.tcp(255), net.udp(201), net.tcp(202)
    net.clock.hold()  # half a second later it is another frame
    met(a, b, c)
    a.beat()
    assert b.hear("HEARTBEAT", 255)
    frame = next(f for f in reversed(b.frames) if Codec(1).decode(f)[0].get_srcSystem() == 255)
    for _ in range(3):  # as somebody does who bridges the two
        c.sock.sendall(frame)
        b.sock.sendall(frame)
    for station in c, b:
        station.ask(mav.MAV_CMD_REQUEST_MESSAGE, 0)
    assert b.frames.count(frame) == 1


def test_the_coordinators_link_takes_no_part_in_forwarding():
    mine, theirs = socket_pair_udp()
    server = TcpServer(listen_tcp(HOST, 0))
    with closing(mine), closing(theirs), running(server, coordinator=theirs):
        coordinator = Station(mine, 254)
        with socket.create_connection((HOST, server.port), timeout=PATIENCE) as sock:
            outside = Station(sock, 255)
            met(coordinator, outside)
            coordinator.command(400, 1, system=255, component=190)
            outside.command(400, 1, system=254, component=190)
            met(coordinator, outside)
            assert not coordinator.has_heard("HEARTBEAT", 255)
            assert not outside.has_heard("HEARTBEAT", 254)
            assert not coordinator.has_heard("COMMAND_LONG")
            assert not outside.has_heard("COMMAND_LONG")


# MAVLink 1


@pytest.mark.parametrize("how", ["tcp", "udp"])
def test_a_mavlink_1_client_is_answered_in_mavlink_1(net, how):
    client = getattr(net, how)(255, version=1)
    met(client)
    client.frames.clear()
    assert client.ask(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION) == 0
    assert client.hear("HEARTBEAT", OWN)
    assert client.hear("LOCAL_POSITION_NED", OWN)
    assert {frame[0] for frame in client.frames} == {0xFE}
    new = net.udp(254)
    met(new)
    assert new.hear("HEARTBEAT", OWN)
    assert {frame[0] for frame in new.frames[-5:]} == {0xFD}, "another one is not concerned"


def test_a_mavlink_1_client_is_shown_no_frames_that_it_cannot_read(net):
    old, new = net.tcp(255, version=1), net.udp(254)
    met(old, new)
    old.frames.clear()
    met(new)
    assert not old.has_heard("HEARTBEAT", 254)
    assert {frame[0] for frame in old.frames} <= {0xFE}
    old.beat()
    assert new.hear("HEARTBEAT", 255), "but the other way round there is no harm"


# Datagrams


def test_many_answers_come_in_short_datagrams(net):
    client = net.udp(255)
    met(client)
    asked = [
        mav.MAVLink_command_long_message(
            OWN, 1, mav.MAV_CMD_REQUEST_MESSAGE, 0, mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION, *[0] * 6
        )
    ] * 40
    client.send(*asked)
    lengths, answers, deadline = [], 0, time.monotonic() + PATIENCE
    client.sock.settimeout(PATIENCE)
    while answers < len(asked) and time.monotonic() < deadline:
        data = client.sock.recv(65535)
        names = [m.get_type() for m in client.codec.decode(data, stream=False)]
        answers += names.count("AUTOPILOT_VERSION")
        if "AUTOPILOT_VERSION" in names:
            lengths.append(len(data))
    assert answers == len(asked)
    assert len(lengths) > 1
    assert max(lengths) <= 1200


def test_udpout_is_spared_long_datagrams_too():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind((HOST, 0))
        with running(UdpOut(HOST, sock.getsockname()[1])):
            sock.settimeout(PATIENCE)
            sock.connect(sock.recvfrom(2000)[1])
            station = Station(sock, 255)
            met(station)


# Floods


def flood_with(station, stop):
    """Commands that are all answered, as fast as they go; answers are thrown away."""
    command = mav.MAVLink_command_long_message(OWN, 1, mav.MAV_CMD_REQUEST_MESSAGE, 0, *[0] * 7)
    data = b"".join(station.codec.frames([command] * 20))
    station.sock.setblocking(False)
    while not stop.is_set():
        for _ in range(20):
            with suppress(OSError):
                station.sock.send(data)
            with suppress(OSError):
                while station.sock.recv(65535):
                    pass
        time.sleep(0.001)


def comes_back(station):
    """Return whether one that has flooded the vehicle is answered again."""
    deadline = time.monotonic() + PATIENCE
    while not (ack := station.hear("COMMAND_ACK", seconds=0.5)) and time.monotonic() < deadline:
        with suppress(OSError):  # there may be no room yet
            station.command(mav.MAV_CMD_REQUEST_MESSAGE, 0)
    return ack


class Meter(Attention):
    """Attention that is measured, of every link."""

    def __init__(self, now):
        super().__init__(now)
        self.since = now
        self.spent = self.most = 0.0

    def spend(self, seconds):
        super().spend(seconds)
        self.spent += seconds
        self.most = max(self.most, seconds)


@pytest.mark.parametrize("how", ["tcp", "udp"])
def test_a_flood_starves_neither_physics_nor_other_clients(net, how, monkeypatch):
    """However little of the processor we get: a link has a quarter of the time and a burst."""
    meters = []
    monkeypatch.setattr(
        process_module, "Attention", lambda now: meters.append(Meter(now)) or meters[-1]
    )
    good = net.tcp(255)
    flooder = getattr(net, how)(254)
    met(good, flooder)
    stop = threading.Event()
    thread = threading.Thread(target=flood_with, args=(flooder, stop))
    thread.start()
    try:
        deadline = time.monotonic() + PATIENCE
        before, answered = net.process.vehicle.now_us, 0
        while answered < 20 or net.process.vehicle.now_us - before < 2e6:
            assert time.monotonic() < deadline
            assert good.ask(mav.MAV_CMD_REQUEST_MESSAGE, 0) is not None
            answered += 1
    finally:
        stop.set()
        thread.join()
    assert len(meters) == 2
    for meter in meters:
        a_pass = 0.003 + meter.most
        assert meter.spent < 0.25 * (time.monotonic() - meter.since) + 0.1 + a_pass
    assert comes_back(flooder)
