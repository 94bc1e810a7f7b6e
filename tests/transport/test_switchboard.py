"""Frames of external vehicles find their names, answers their vehicles, and mix-ups the user."""

import select
import socket
import threading
import time
from contextlib import ExitStack, closing, contextmanager, suppress

import pytest

from mavherd.transport.connect import Address, parse_connect
from mavherd.transport.errors import LinkError
from mavherd.transport.hail import hail
from mavherd.transport.mavlink import Codec, mav
from mavherd.transport.switchboard import FRESH_S, Switchboard

HOST = "127.0.0.1"
PATIENCE = 60.0
ANY_PORT = Address(text="udpin:any", scheme="udpin", host=HOST, port=0)


class Clock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


class FakeVehicle:
    """A test double: the heartbeats and attitudes of one system id, from one socket."""

    def __init__(self, system_id, component=1, mav_type=2, autopilot=3):
        self.codec = Codec(system_id, component)
        self.kind = mav_type, autopilot
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((HOST, 0))
        self.socket.settimeout(PATIENCE)

    def heartbeat(self):
        mav_type, autopilot = self.kind
        return self.codec.encode([mav.MAVLink_heartbeat_message(mav_type, autopilot, 1, 0, 3, 3)])

    def attitude(self, roll=0.0):
        return self.codec.encode([mav.MAVLink_attitude_message(0, roll, 0, 0, 0, 0, 0)])

    def send(self, port, data):
        self.socket.sendto(data, (HOST, port))

    @property
    def source(self):
        return f"udp:{HOST}:{self.socket.getsockname()[1]}"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()


class Desk:
    """A switchboard with one UDP port, and time of its own."""

    def __init__(self, **system_ids):
        self.clock = Clock()
        wanted = {name: (ANY_PORT, system_id) for name, system_id in system_ids.items()}
        self.board = Switchboard(wanted, self.clock)
        if not wanted:
            self.board.listen(ANY_PORT)
        (self.port,) = (s.getsockname()[1] for s in self.board.sockets())

    def take(self, vehicle, data, seconds=0.0):
        """Let a vehicle send one datagram; return what comes out."""
        self.clock.now += seconds
        vehicle.send(self.port, data)
        assert select.select(self.board.sockets(), [], [], PATIENCE)[0]
        return list(self.board.receive())

    def complaint(self, name="quad1"):
        return self.board.complaint(name)

    def known(self, *vehicles):
        """Have vehicles be known for a while."""
        for seconds in (0, 1, 1, 1):
            self.clock.now += seconds
            for vehicle in vehicles:
                self.take(vehicle, vehicle.heartbeat())


@contextmanager
def desk(*vehicles, **system_ids):
    with ExitStack() as stack:
        d = Desk(**system_ids)
        stack.callback(d.board.close)
        yield (d, *(stack.enter_context(v) for v in vehicles))


def types_of(out, name):
    codec = Codec(254)
    return [m.get_type() for n, data in out if n == name for m in codec.decode(data)]


# sorting


def test_several_vehicles_behind_one_port_are_told_apart():
    with desk(FakeVehicle(1), FakeVehicle(4), quad1=1, rover1=4) as (d, one, four):
        assert d.take(one, one.heartbeat()) == [("quad1", mirrored(one))]
        d.take(four, four.heartbeat())
        assert types_of(d.take(four, four.attitude()), "rover1") == ["ATTITUDE"]
        d.board.send("quad1", b"for one")
        d.board.send("rover1", b"for four")
        assert (one.socket.recv(99), four.socket.recv(99)) == (b"for one", b"for four")
        d.known(one, four)
        assert (d.complaint("quad1"), d.complaint("rover1")) == ("", "")


def mirrored(vehicle):
    """Return the last heartbeat again."""
    twin = Codec(vehicle.codec.system_id, vehicle.codec.component_id)
    return twin.encode([mav.MAVLink_heartbeat_message(*vehicle.kind, 1, 0, 3, 3)])


def test_two_vehicles_in_one_datagram_of_a_router_are_told_apart():
    with desk(FakeVehicle(1), FakeVehicle(4), quad1=1, rover1=4) as (d, one, four):
        d.take(one, one.heartbeat() + four.heartbeat())
        mixed = one.attitude(0.1) + four.attitude() + b"\xfdgarbage" + one.attitude(0.2)
        out = d.take(one, mixed)
        assert types_of(out, "quad1") == ["ATTITUDE", "ATTITUDE"]
        assert types_of(out, "rover1") == ["ATTITUDE"]


def test_nothing_is_believed_of_a_source_before_its_heartbeat_and_nothing_sent_to_it():
    with desk(FakeVehicle(1), quad1=1) as (d, vehicle):
        assert d.take(vehicle, vehicle.attitude()) == []
        d.board.send("quad1", b"arm")
        d.take(vehicle, vehicle.heartbeat())
        d.board.send("quad1", b"hello")
        assert vehicle.socket.recv(99) == b"hello"


def test_ground_stations_gimbals_and_radios_are_no_vehicles():
    ground = FakeVehicle(255, 190, mav_type=mav.MAV_TYPE_GCS, autopilot=mav.MAV_AUTOPILOT_INVALID)
    odd = FakeVehicle(1, 1, mav_type=mav.MAV_TYPE_GCS, autopilot=mav.MAV_AUTOPILOT_INVALID)
    gimbal = FakeVehicle(1, 154, mav_type=26, autopilot=8)
    with desk(ground, odd, gimbal, quad1=1) as (d, *others):
        for other in others:
            assert d.take(other, other.heartbeat()) == []
        assert d.board.found() == []
        assert "MAVLink comes, but no heartbeat of an autopilot" in d.complaint()


def test_other_components_of_a_vehicle_are_heard_from_where_it_is():
    with desk(FakeVehicle(1), FakeVehicle(1, 154, 26, 8), quad1=1) as (d, vehicle, gimbal):
        d.take(vehicle, vehicle.heartbeat())
        assert types_of(d.take(vehicle, gimbal.attitude()), "quad1") == ["ATTITUDE"]
        assert d.take(gimbal, gimbal.attitude()) == []


def test_a_vehicle_that_comes_back_from_another_port_is_followed():
    with desk(FakeVehicle(1), FakeVehicle(1), quad1=1) as (d, before, after):
        d.known(before)
        d.take(after, after.heartbeat(), seconds=FRESH_S + 0.1)
        assert d.complaint() == ""
        d.board.send("quad1", b"hello")
        assert after.socket.recv(99) == b"hello"


def test_a_vehicle_restarted_within_a_second_is_no_double():
    with desk(FakeVehicle(1), FakeVehicle(1), quad1=1) as (d, before, after):
        d.known(before)
        for _ in range(5):
            d.take(after, after.heartbeat(), seconds=0.5)
            assert d.complaint() == ""


# mix-ups


def test_the_wrong_system_id_is_named_and_never_spoken_to():
    with desk(FakeVehicle(7), quad1=4) as (d, seven):
        assert d.take(seven, seven.heartbeat()) == []
        assert d.complaint() == (
            "udpin:any: system 7 answers here, the scenario wants 4 "
            "(system_id: 7, or SYSID_THISMAV/MAV_SYS_ID on the vehicle)"
        )
        assert d.board.strangers == {ANY_PORT: {7: seven.source}}
        d.board.send("quad1", b"arm")
        seven.socket.setblocking(False)
        with pytest.raises(BlockingIOError):
            seven.socket.recv(99)


def test_several_wrong_ones_are_all_named():
    with desk(FakeVehicle(7), FakeVehicle(9), quad1=4) as (d, seven, nine):
        d.take(seven, seven.heartbeat())
        d.take(nine, nine.heartbeat())
        assert "systems 7 and 9 answer here, the scenario wants 4 " in d.complaint()


def test_two_vehicles_with_one_id_are_both_named_and_only_the_first_is_believed():
    with desk(FakeVehicle(1), FakeVehicle(1), quad1=1) as (d, first, second):
        for vehicle in (first, second, first):
            out = d.take(vehicle, vehicle.heartbeat() + vehicle.attitude(), seconds=0.5)
            assert bool(out) == (vehicle is first)
        assert "two vehicles call themselves system 1 (" in d.complaint()
        assert first.source in d.complaint()
        assert second.source in d.complaint()
        assert "SYSID_THISMAV or MAV_SYS_ID" in d.complaint()
        assert d.board.doubles == {ANY_PORT: {1: sorted([first.source, second.source])}}
        d.board.send("quad1", b"hello")
        assert first.socket.recv(99) == b"hello"
        d.take(first, first.heartbeat(), seconds=FRESH_S + 0.1)
        assert d.complaint() == ""  # the other has been switched off


def test_two_vehicles_with_one_id_behind_one_router_are_noticed():
    with desk(FakeVehicle(1), FakeVehicle(1), quad1=1) as (d, router, second):
        for _ in range(20):
            second.attitude()  # it has been up longer
        for _ in range(3):
            assert "two vehicles" not in d.complaint()
            d.take(router, router.heartbeat() + router.attitude() + second.attitude(), seconds=0.2)
        d.take(router, router.attitude(), seconds=0.2)
        assert d.complaint() == (
            "udpin:any: two vehicles call themselves system 1 "
            "(give each its own: SYSID_THISMAV or MAV_SYS_ID)"
        )


def test_lost_late_and_repeated_frames_are_no_second_vehicle():
    with desk(FakeVehicle(1), quad1=1) as (d, vehicle):
        d.known(vehicle)
        for i in range(60):
            early, late = vehicle.attitude(), vehicle.attitude()
            for _ in range(i % 13):
                vehicle.attitude()  # lost
            d.take(vehicle, late + early + early, seconds=0.02)
            assert d.complaint() == ""


def test_silence_is_counted_and_the_vehicle_waited_for():
    with desk(FakeVehicle(1), quad1=1) as (d, vehicle):
        assert d.complaint() == (
            "udpin:any: no vehicle is heard (is it started, and does it send to this address "
            "and port?)"
        )
        d.take(vehicle, vehicle.heartbeat())
        assert d.complaint() == "udpin:any: heard; listening for a second system 1"
        d.known(vehicle)
        assert d.complaint() == ""
        d.clock.now += 5
        assert d.complaint() == "udpin:any: system 1 has been silent for 5 s"
        d.board.send("quad1", b"still there?")  # its link may be back before its heartbeat
        assert vehicle.socket.recv(99) == b"still there?"
        d.take(vehicle, vehicle.heartbeat())
        assert d.complaint() == ""


def test_a_vehicle_whose_place_another_has_taken_is_spoken_to_no_more():
    with desk(FakeVehicle(1), FakeVehicle(2), quad1=1) as (d, vehicle, other):
        d.take(vehicle, vehicle.heartbeat())
        d.take(vehicle, other.heartbeat(), seconds=FRESH_S + 0.1)
        d.board.send("quad1", b"arm")
        vehicle.socket.setblocking(False)
        with pytest.raises(BlockingIOError):
            vehicle.socket.recv(99)
        assert "system 2 answers here, the scenario wants 1" in d.complaint()


def test_a_flood_of_invented_senders_does_not_grow_it():
    with desk(FakeVehicle(1), quad1=1) as (d, vehicle):
        d.take(vehicle, vehicle.heartbeat())
        for _ in range(20):
            with FakeVehicle(1) as liar:
                d.take(liar, liar.heartbeat())
        (trunk,) = d.board._trunks.values()
        assert len(trunk.voices[1]) <= 4
        d.board.send("quad1", b"hello")
        assert vehicle.socket.recv(99) == b"hello"


def test_one_vehicle_cannot_have_two_names():
    with pytest.raises(LinkError, match=r"quad1 and quad2 are the same vehicle, system 1 there"):
        Switchboard({"quad1": (ANY_PORT, 1), "quad2": (ANY_PORT, 1)})


# streams


def test_frames_of_a_stream_are_put_together_and_garbage_is_left_out():
    with socket.socket() as listening:
        listening.bind((HOST, 0))
        listening.listen()
        address = parse_connect(f"tcp:{HOST}:{listening.getsockname()[1]}")
        board = Switchboard({"quad1": (address, 1), "quad2": (address, 2)})
        with closing(board), FakeVehicle(1) as one, FakeVehicle(2) as two:
            vehicle = until(lambda: list(board.receive()) or accepted(listening, board))
            with vehicle:
                wire = one.heartbeat() + b"\xfd\x10\x00noise" + two.heartbeat() + two.attitude()
                out = []
                for i in range(0, len(wire), 5):
                    vehicle.send(wire[i : i + 5])
                    out += board.receive()
                until(lambda: out.extend(board.receive()) or len(types_of(out, "quad2")) == 2)
                assert types_of(out, "quad1") == ["HEARTBEAT"]
                assert types_of(out, "quad2") == ["HEARTBEAT", "ATTITUDE"]
                for name, data in out:
                    assert types_of([(name, data)], name), "a torn frame"
                board.send("quad2", b"hello")
                assert vehicle.recv(99) == b"hello"
            lost = "closed by the other end"
            until(lambda: list(board.receive()) or lost in board.complaint("quad1"))


def test_a_refused_connection_is_the_complaint():
    with socket.socket() as listening:
        listening.bind((HOST, 0))  # it keeps its port, but does not listen
        port = listening.getsockname()[1]
        with closing(Switchboard({"quad1": (parse_connect(f"tcp:{HOST}:{port}"), 1)})) as board:
            until(lambda: list(board.receive()) or "refused" in board.complaint("quad1"))
            assert board.complaint("quad1") == (
                f"tcp:{HOST}:{port}: connection refused (is it started, and does it listen there?)"
            )


def test_bytes_that_are_no_mavlink_suggest_the_baud_rate():
    with socket.socket() as listening:
        listening.bind((HOST, 0))
        listening.listen()
        address = parse_connect(f"tcp:{HOST}:{listening.getsockname()[1]}")
        with closing(Switchboard({"quad1": (address, 1)})) as board:
            vehicle = until(lambda: list(board.receive()) or accepted(listening, board))
            with vehicle:
                vehicle.send(b"\x00\x80\xf8" * 1000)
                until(lambda: list(board.receive()) or "no MAVLink" in board.complaint("quad1"))


def accepted(listening, board):
    if board.sockets():
        return listening.accept()[0]
    return None


def until(condition):
    deadline = time.monotonic() + PATIENCE
    while not (value := condition()):
        assert time.monotonic() < deadline
        time.sleep(0.002)
    return value


# hailing


def test_hailing_finds_who_answers_and_keeps_the_line():
    with FakeVehicle(3, mav_type=10, autopilot=12) as vehicle:
        address = parse_connect(f"udpout:{HOST}:{vehicle.socket.getsockname()[1]}")
        with closing(Switchboard(clock=Clock())) as board:
            with answering(vehicle):
                found = until(lambda: hail([address], 0.1, board)[1])
            ((where, system_id, mav_type, autopilot, _),) = found
            assert (where, system_id, mav_type, autopilot) == (address, 3, 10, 12)
            (sock,) = board.sockets()
            board.want("rover1", address, 3)
            assert board.sockets() == [sock]
            assert "listening for a second" in board.complaint("rover1")
            board.send("rover1", b"hello")
            until(lambda: vehicle.socket.recvfrom(99) == (b"hello", sock.getsockname()))


@contextmanager
def answering(vehicle):
    """Have a vehicle speak when it is spoken to, as behind many firewalls."""
    over = threading.Event()

    def answer():
        while not over.is_set():
            with suppress(TimeoutError):
                data, ground = vehicle.socket.recvfrom(99)
                (message,) = Codec(3).decode(data)
                assert (message.get_type(), message.type) == ("HEARTBEAT", mav.MAV_TYPE_GCS)
                vehicle.socket.sendto(vehicle.heartbeat(), ground)

    vehicle.socket.settimeout(0.02)
    thread = threading.Thread(target=answer)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        vehicle.socket.settimeout(PATIENCE)


def test_hailing_where_nobody_is_finds_nobody():
    board, found = hail([ANY_PORT], 0.1)
    with closing(board):
        assert found == []
        assert len(board.sockets()) == 1
