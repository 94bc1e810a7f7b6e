"""FTP serves the virtual files, answers all requests at once, and lets nobody out of its tree."""

import json
import zlib
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.protocol.ftp import FtpService, Packet
from mavherd.vehicles.protocol.ftp_tree import (
    GENERAL,
    PARAMETER,
    PARAMETER_PACK,
    FileTree,
    file_crc,
    vehicle_files,
)

TERMINATE, RESET, LIST, OPEN, READ, CRC, BURST = 1, 2, 3, 4, 5, 14, 15
ACK, NAK = 128, 129
FAIL, DATA_SIZE, SESSION, NO_SESSION, EOF, UNKNOWN, PROTECTED, NOT_FOUND = 1, 3, 4, 5, 6, 7, 9, 10

LONG = Random(1).randbytes(239 * 70 + 11)
FILES = {
    "long.bin": LONG,
    "even.bin": LONG[: 239 * 3],
    "empty": b"",
    "@PARAM/param.pck": b"packed",
    **{f"many/{n:03}.txt": b"x" * n for n in range(60)},
}


class Client:
    """One ground station: numbers its requests and reads the answers off the wire."""

    def __init__(self, service, address=(255, 190)):
        self.service = service
        self.address = address
        self.codec = Codec(*address)
        self.sequence = 500
        self.now = 0.0

    def request(self, opcode, data=b"", *, session=7, offset=0, size=None):
        self.sequence = (self.sequence + 1) & 0xFFFF
        size = len(data) if size is None else size
        return Packet(self.sequence, session, opcode, size, offset=offset, data=data)

    def send(self, request):
        return self.send_raw(request.pack())

    def send_raw(self, payload):
        """Return the one answer, which comes at once."""
        message = mav.MAVLink_file_transfer_protocol_message(0, 1, 1, payload)
        (m,) = Codec(1).decode(self.codec.encode([message]))
        (reply,) = self.service.handlers["FILE_TRANSFER_PROTOCOL"](m)
        return self.read(reply)

    def read(self, reply):
        assert (reply.target_system, reply.target_component) == self.address
        return Packet.unpack(bytes(Codec(255).decode(Codec(1).encode([reply]))[0].payload))

    def ask(self, opcode, data=b"", **fields):
        request = self.request(opcode, data, **fields)
        reply = self.send(request)
        assert reply.sequence == (request.sequence + 1) & 0xFFFF
        assert (reply.session, reply.req_opcode) == (request.session, opcode)
        assert reply.opcode in (ACK, NAK)
        assert not any(reply.data[reply.size :]), "no old bytes"
        return reply

    def refusal(self, opcode, data=b"", **fields):
        reply = self.ask(opcode, data, **fields)
        assert (reply.opcode, reply.size) == (NAK, 1)
        return reply.data[0]

    def granted(self, opcode, data=b"", **fields):
        reply = self.ask(opcode, data, **fields)
        assert reply.opcode == ACK, reply
        return reply.data[: reply.size]

    def wait(self, seconds=0.01):
        """Let time pass; return what the server sends meanwhile."""
        out = []
        for _ in range(round(seconds / 0.01)):
            self.now += 0.01
            out += [self.read(m) for m in self.service.due(self.now)]
        return out


@pytest.fixture
def service():
    return FtpService(tree())


@pytest.fixture
def client(service):
    return Client(service)


def tree():
    return FileTree({path: lambda query, c=content: c for path, content in FILES.items()})


# Reading


def test_a_file_is_opened_read_and_closed(client):
    assert client.granted(OPEN, b"long.bin") == len(LONG).to_bytes(4, "little")
    got = b""
    while (reply := client.ask(READ, size=239, offset=len(got))).opcode == ACK:
        assert reply.offset == len(got)
        got += reply.data[: reply.size]
    assert reply.data[0] == EOF
    assert got == LONG
    client.granted(TERMINATE)
    assert client.refusal(READ, size=239) == SESSION


def test_any_part_can_be_read(client):
    client.granted(OPEN, b"/long.bin")
    assert client.granted(READ, size=10, offset=1000) == LONG[1000:1010]
    assert client.granted(READ, size=255, offset=0) == LONG[:239]
    assert client.granted(READ, size=239, offset=len(LONG) - 3) == LONG[-3:]
    for offset in (len(LONG), len(LONG) + 1, 2**32 - 1):
        assert client.refusal(READ, size=239, offset=offset) == EOF


@pytest.mark.parametrize("name", ["long.bin", "even.bin"])
@pytest.mark.parametrize("size", [0, 239, 80])
def test_a_burst_brings_the_rest_of_the_file_and_then_its_end(client, name, size):
    client.granted(OPEN, name.encode())
    packets = [client.ask(BURST, size=size)]
    packets += client.wait(3)
    *parts, end = packets
    assert b"".join(p.data[: p.size] for p in parts) == FILES[name]
    assert {len(p.data[: p.size]) for p in parts[:-1]} == {size or 239}
    assert (end.opcode, end.data[0], end.burst_complete) == (NAK, EOF, 1)
    assert [p.sequence for p in packets] == list(
        range(packets[0].sequence, packets[0].sequence + len(packets))
    )
    assert all(p.req_opcode == BURST and not p.burst_complete for p in parts)
    assert client.wait(1) == []


def test_bursts_are_paced(client):
    client.granted(OPEN, b"long.bin")
    client.ask(BURST)
    assert len(client.wait(0.01)) == 20
    assert len(client.wait(0.01)) == 20


def test_a_burst_begins_where_it_is_asked_to_and_a_new_one_replaces_it(client):
    client.granted(OPEN, b"long.bin")
    client.ask(BURST, offset=239)
    client.wait(0.01)
    first = client.ask(BURST, offset=16000)
    packets = [first, *client.wait(1)]
    assert b"".join(p.data[: p.size] for p in packets[:-1]) == LONG[16000:]


@pytest.mark.parametrize("stop", [TERMINATE, RESET])
def test_closing_ends_a_burst(client, stop):
    client.granted(OPEN, b"long.bin")
    client.ask(BURST)
    client.granted(stop)
    assert client.wait(1) == []


def test_an_empty_file_is_only_its_end(client):
    assert client.granted(OPEN, b"empty") == bytes(4)
    assert client.refusal(BURST) == EOF
    assert client.refusal(READ, size=239) == EOF
    assert client.wait(1) == []


def test_a_file_stays_as_it_was_when_it_was_opened():
    versions = iter([b"first", b"second"])
    client = Client(FtpService(FileTree({"f": lambda query: next(versions)})))
    client.granted(OPEN, b"f")
    client.granted(OPEN, b"f", session=8)
    assert client.granted(READ, size=239) == b"first"
    assert client.granted(READ, size=239, session=8) == b"second"


def test_whoever_opens_a_file_is_told_about():
    opened = []
    client = Client(FtpService(tree(), opened.append))
    client.granted(OPEN, b"@PARAM/param.pck?withdefaults=1")
    client.refusal(OPEN, b"nothing")
    client.ask(LIST, b"@PARAM")
    assert opened == ["@PARAM/param.pck?withdefaults=1"]


# Repeated requests


def test_a_repeated_request_gets_the_same_answer(client):
    for request in (
        client.request(OPEN, b"long.bin"),
        client.request(READ, size=100, offset=50),
        client.request(BURST, size=239, offset=LONG.index(LONG[-20:])),
        client.request(LIST, b"many", offset=3),
        client.request(CRC, b"long.bin"),
        client.request(TERMINATE),
        client.request(RESET),
        client.request(READ, size=100),
    ):
        assert client.send(request) == client.send(request)


def test_a_lost_open_that_is_repeated_leaves_one_session(client):
    request = client.request(OPEN, b"long.bin")
    for _ in range(20):
        assert client.send(request).opcode == ACK


# Directories


def listing(client, path):
    out = []
    while (reply := client.ask(LIST, path, offset=len(out))).opcode == ACK:
        assert reply.size <= 239
        lines = reply.data[: reply.size].split(b"\0")
        assert lines.pop() == b""
        out += lines
    assert reply.data[0] == EOF
    return out


@pytest.mark.parametrize("path", [b"/", b".", b"./", b"//"])
def test_the_root_is_listed(client, path):
    assert listing(client, path) == [
        b"D@PARAM",
        b"Fempty\t0",
        b"Feven.bin\t717",
        b"Flong.bin\t16741",
        b"Dmany",
    ]


@pytest.mark.parametrize("path", [b"many", b"/many", b"many/"])
def test_a_long_directory_comes_in_pages(client, path):
    assert listing(client, path) == [f"F{n:03}.txt\t{n}".encode() for n in range(60)]


def test_there_is_nothing_beyond_the_end_of_a_directory(client):
    assert client.refusal(LIST, b"many", offset=60) == EOF
    assert client.refusal(LIST, b"many", offset=2**32 - 1) == EOF


# Checksums


def test_the_checksum_is_mavlinks(client):
    """The polynomial of zlib, from zero and not inverted (mavlink.io/en/guide/crc.html)."""
    crc = 0
    for byte in LONG:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xEDB88320 if crc & 1 else 0)
    assert int.from_bytes(client.granted(CRC, b"long.bin"), "little") == crc
    assert crc == file_crc(LONG) != zlib.crc32(LONG)


# Refusals


@pytest.mark.parametrize("opcode", [6, 7, 8, 9, 10, 11, 12, 13])
def test_nothing_can_be_written(client, opcode):
    assert client.refusal(opcode, b"long.bin") == PROTECTED


@pytest.mark.parametrize("opcode", [16, 17, 99, 127, 130, 255])
def test_other_commands_are_unknown(client, opcode):
    assert client.refusal(opcode, b"long.bin") == UNKNOWN


def test_the_command_that_does_nothing_is_acknowledged(client):
    assert client.granted(0) == b""


@pytest.mark.parametrize("opcode", [OPEN, CRC, LIST])
@pytest.mark.parametrize(
    "path",
    [
        b"nothing",
        b"/etc/passwd",
        b"../../etc/passwd",
        b"many/../../../etc/passwd",
        b"many/..",
        b"~",
        b"long.bin/x",
        b"LONG.BIN",
        b"\xff\xfe",
        b"many\\000.txt",
        b"x" * 239,
    ],
)
def test_there_is_no_way_out_of_the_tree(client, opcode, path):
    assert client.refusal(opcode, path) == NOT_FOUND


@pytest.mark.parametrize("opcode", [OPEN, CRC, LIST])
def test_a_path_must_have_a_length(client, opcode):
    assert client.refusal(opcode, b"") == DATA_SIZE
    assert client.refusal(opcode, b"long.bin", size=240) == DATA_SIZE
    assert client.refusal(opcode, b"long.bin", size=255) == DATA_SIZE


def test_a_directory_is_no_file(client):
    assert client.refusal(OPEN, b"many") == NOT_FOUND
    assert client.refusal(OPEN, b"/") == NOT_FOUND


def test_a_file_is_no_directory(client):
    assert client.refusal(LIST, b"long.bin") == NOT_FOUND


def test_a_name_may_end_with_zeros(client):
    client.granted(OPEN, b"empty\0\0\0")


@pytest.mark.parametrize("opcode", [READ, BURST])
def test_what_is_not_open_cannot_be_read(client, opcode):
    assert client.refusal(opcode, size=239) == SESSION


def test_closing_what_is_not_open_is_done_already(client):
    client.granted(TERMINATE)
    client.granted(RESET)


def test_answers_are_not_answered(service):
    for opcode in (ACK, NAK):
        message = mav.MAVLink_file_transfer_protocol_message(
            0, 1, 1, Packet(1, 0, opcode, 0).pack()
        )
        (m,) = Codec(1).decode(Codec(9).encode([message]))
        assert service.handlers["FILE_TRANSFER_PROTOCOL"](m) == []


@given(st.lists(st.binary(max_size=251), max_size=8))
def test_garbage_is_answered_and_never_raises(payloads):
    client = Client(FtpService(tree()))
    for payload in payloads:
        if len(payload) > 3 and payload[3] in (ACK, NAK):
            continue
        assert client.send_raw(payload.ljust(251, b"\0")).opcode in (ACK, NAK)
        client.wait(0.01)


# Sessions


def test_each_client_has_its_own_sessions(service):
    one, two = Client(service), Client(service, (254, 1))
    one.granted(OPEN, b"long.bin")
    two.granted(OPEN, b"even.bin")
    two.granted(RESET)
    assert one.granted(READ, size=4) == LONG[:4]
    assert two.refusal(READ, size=4) == SESSION


def test_sessions_are_bounded_and_idle_ones_make_room(client):
    for session in range(8):
        client.granted(OPEN, b"long.bin", session=session)
    assert client.refusal(OPEN, b"long.bin", session=8) == NO_SESSION
    client.wait(3.1)
    client.granted(READ, size=1, session=0)
    client.granted(OPEN, b"long.bin", session=8)
    client.granted(READ, size=1, session=0)
    assert client.refusal(READ, size=1, session=1) == SESSION
    assert len(client.service._sessions) == 8


def test_a_client_that_vanished_is_forgotten(client):
    client.granted(OPEN, b"long.bin")
    client.wait(19)
    client.granted(READ, size=1)
    client.wait(19)
    client.granted(READ, size=1)
    client.wait(21)
    assert client.refusal(READ, size=1) == SESSION
    assert not client.service._sessions


# The files of a vehicle


def test_the_parameter_pack_is_asked_for_with_its_query():
    asked = []

    def pack(query):
        asked.append(dict(query))
        return b"p"

    files = vehicle_files(pack, lambda: b"{}")
    for path in (
        "@PARAM/param.pck",
        "@PARAM/param.pck?withdefaults=1",
        "/@PARAM/param.pck?start=10&count=20",
        "@PARAM/param.pck?withdefaults=x&count=-1&&=&start=٣",
    ):
        assert files.read(path) == b"p"
    assert asked == [{}, {"withdefaults": 1}, {"start": 10, "count": 20}, {}]


def test_a_ground_station_finds_the_parameter_metadata():
    made = []
    document = json.dumps({"version": 1, "parameters": []}).encode()

    def metadata():
        made.append(1)
        return document

    files = vehicle_files(lambda query: b"", metadata)
    assert not made, "not before somebody asks"
    general = json.loads(files.read(GENERAL))
    assert general["version"] == 1
    (entry,) = general["metadataTypes"]
    assert entry["type"] == 1
    assert entry["uri"].removeprefix("mftp://") == f"/{PARAMETER}"
    assert files.read(f"/{PARAMETER}") == document
    assert entry["fileCrc"] == file_crc(document)
    assert len(made) == 1, "and once only"
    assert files.read(PARAMETER_PACK) == b""
    assert [name for name, _ in files.list("/")] == ["@PARAM", "component_metadata"]
