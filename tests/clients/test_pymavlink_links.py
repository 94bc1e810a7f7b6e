"""Links: who is addressed, what frames do, and which rates each station gets."""

import random
import socket
from collections import Counter
from contextlib import closing
from itertools import pairwise

import pytest
from pymavlink.dialects.v10 import ardupilotmega as v1
from pymavlink.dialects.v20 import ardupilotmega as mav
from pymavlink.generator.mavcrc import x25crc

ACCEPTED = mav.MAV_RESULT_ACCEPTED
INTERVAL = mav.MAV_CMD_SET_MESSAGE_INTERVAL
ASK = mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES
SYSTEM = 42
UNKNOWN = 31_999  # a command that nobody knows is acknowledged, and can be told from others


@pytest.fixture(scope="module")
def copter(start):
    return start("quadcopter", "--sysid", SYSTEM, speed=5)


@pytest.fixture(params=["tcp", "udp", "udp from vehicle"])
def station(copter, connect, request):
    return connect(copter, request.param)


def unknown(system, component, command=UNKNOWN):
    return mav.MAVLink_command_long_message(system, component, command, 0, *[0.0] * 7)


def acknowledged(messages):
    """Return what has been acknowledged, but for the marker at the end."""
    acks = [m.command for m in messages if m.get_type() == "COMMAND_ACK"]
    assert acks[-1] == mav.MAV_CMD_GET_MESSAGE_INTERVAL
    return acks[:-1]


@pytest.fixture
def answers(station):
    """Send messages; return the commands among them that are acknowledged."""

    def say(*messages):
        station.send(*messages)
        return acknowledged(station.until_answered())

    return say


@pytest.mark.parametrize("target", [(SYSTEM, 1), (SYSTEM, 0), (SYSTEM, 99), (0, 0), (0, 1)])
def test_it_answers_what_is_for_it_or_for_all(answers, target):
    assert answers(unknown(*target)) == [UNKNOWN]


@pytest.mark.parametrize("target", [(43, 1), (43, 0), (1, 1), (255, 190)])
def test_it_is_silent_when_another_is_meant(answers, target):
    assert answers(unknown(*target)) == []


def test_an_answer_is_addressed_to_the_sender(copter, connect):
    for identity in ({"system": 245, "component": 191}, {"system": 255, "component": 0}):
        station = connect(copter, "udp", **identity)
        station.send(unknown(SYSTEM, 1))
        ack = station.wait("COMMAND_ACK")
        assert (ack.target_system, ack.target_component) == tuple(identity.values())
        assert (ack.get_srcSystem(), ack.get_srcComponent()) == (SYSTEM, 1)


def packed(message, seq=0):
    """Return the frame of a message from station 255."""
    packer = mav.MAVLink(None, srcSystem=255, srcComponent=190)
    packer.seq = seq
    return bytearray(message.pack(packer))


def remade(frame):
    """Return the frame with a checksum that fits its contents."""
    crc = x25crc(bytes(frame[1:-2]))
    crc.accumulate(bytes([mav.mavlink_map[frame[7] | frame[8] << 8 | frame[9] << 16].crc_extra]))
    return bytes(frame[:-2]) + crc.crc.to_bytes(2, "little")


def bad_checksum():
    frame = packed(unknown(SYSTEM, 1))
    frame[-1] ^= 0xFF
    return bytes(frame)


def unknown_incompatibility():
    frame = packed(unknown(SYSTEM, 1))
    frame[2] |= 0x40
    return remade(frame)


def unknown_compatibility():
    frame = packed(unknown(SYSTEM, 1))
    frame[3] |= 0x40
    return remade(frame)


def longer_payload():
    """A frame of a later dialect, with a field that we do not know at its end."""
    frame = packed(unknown(SYSTEM, 1))
    payload = bytes(frame[10:-2])
    payload += bytes(33 - len(payload)) + b"\x07\x07"
    return remade(bytes([frame[0], len(payload), *frame[2:10]]) + payload + b"\0\0")


def signed():
    packer = mav.MAVLink(None, srcSystem=255, srcComponent=190)
    packer.signing.secret_key = bytes(range(32))
    packer.signing.sign_outgoing = True
    packer.signing.timestamp = 1
    return bytes(unknown(SYSTEM, 1).pack(packer))


def noise():
    return random.Random(7).randbytes(900).replace(b"\xfd", b"!").replace(b"\xfe", b"!")


def cut_off():
    return bytes(packed(unknown(SYSTEM, 1))[:20])


@pytest.mark.parametrize(
    ("frame", "commands"),
    [
        (noise, []),
        (bad_checksum, []),
        (unknown_incompatibility, []),
        (unknown_compatibility, [UNKNOWN]),
        (longer_payload, [UNKNOWN]),
    ],
)
@pytest.mark.parametrize("how", ["tcp", "udp"])
def test_a_strange_frame_does_no_harm(copter, connect, how, frame, commands):
    station = connect(copter, how)
    station.wait("HEARTBEAT")
    station.link.write(frame())
    assert acknowledged(station.until_answered()) == commands


@pytest.mark.parametrize("frame", [signed, cut_off])
@pytest.mark.parametrize("how", ["tcp", "udp"])
def test_after_a_signed_or_torn_frame_it_still_answers(copter, connect, how, frame):
    station = connect(copter, how)
    station.wait("HEARTBEAT")
    station.link.write(frame())
    if how == "tcp":  # the stream swallows what it takes for the rest of a torn frame
        station.link.write(bytes(300))
    assert station.ask(ASK, 1, to=(SYSTEM, 1)) == ACCEPTED


def spoken_with(vehicle, packer, pieces):
    """Say something in frames of one packer over UDP.

    Return the first bytes of the answers, and of the telemetry for a while, by message type.
    """
    heard = {}
    with closing(socket.socket(type=socket.SOCK_DGRAM)) as sock:
        sock.settimeout(60)
        for message in pieces:
            sock.sendto(message.pack(packer), ("127.0.0.1", vehicle.udpin))
        parser = mav.MAVLink(None)
        while not heard.keys() >= {"COMMAND_ACK", "ATTITUDE", "GPS_RAW_INT"}:
            for m in parser.parse_buffer(sock.recv(65_535)) or []:
                heard.setdefault(m.get_type(), []).append(m.get_msgbuf()[0])
    return heard


@pytest.fixture(scope="module")
def fresh(start):
    """A vehicle that has met nobody: a port that was another client's would be known to it."""
    return start("quadcopter", "--sysid", SYSTEM, speed=5)


def test_a_mavlink_1_client_is_answered_in_mavlink_1(fresh):
    packer = v1.MAVLink(None, srcSystem=255, srcComponent=190)
    heartbeat = v1.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    ask = v1.MAVLink_command_long_message(SYSTEM, 1, UNKNOWN, 0, *[0.0] * 7)
    heard = spoken_with(fresh, packer, [heartbeat, ask])
    heard["HEARTBEAT"].pop(0)  # a hint that MAVLink 2 is spoken here, before anybody is heard
    assert {marker for markers in heard.values() for marker in markers} == {v1.PROTOCOL_MARKER_V1}


def test_a_mavlink_2_client_is_answered_in_mavlink_2(fresh):
    packer = mav.MAVLink(None, srcSystem=255, srcComponent=190)
    heard = spoken_with(fresh, packer, [unknown(SYSTEM, 1)])
    assert {marker for markers in heard.values() for marker in markers} == {mav.PROTOCOL_MARKER_V2}


def rates(station, seconds):
    """Return Hz of vehicle time for each message type heard in so many vehicle seconds.

    In seconds of which nothing was lost: UDP drops what a station that was held up has not read.
    """
    first = last = station.wait("ATTITUDE").time_boot_ms
    lost = station.lost
    station.forget()
    while last < first + seconds * 1e3:
        last = station.wait("ATTITUDE").time_boot_ms
        if station.lost > lost:
            first, lost = last, station.lost
            station.forget()
    counted = Counter(m.get_type() for m in station.seen)
    took = (last - first) / 1e3
    return {name: count / took for name, count in counted.items()}


def set_rate(station, name, hz, to=(SYSTEM, 1)):
    number = getattr(mav, f"MAVLINK_MSG_ID_{name}")
    return station.ask(INTERVAL, number, 1e6 / hz if hz > 0 else hz, to=to)


def test_unasked_rates_are_those_promised(station):
    heard = rates(station, 10)
    for name, hz in {
        "HEARTBEAT": 1,
        "SYS_STATUS": 1,
        "EXTENDED_SYS_STATE": 1,
        "EKF_STATUS_REPORT": 1,
        "ATTITUDE": 10,
        "LOCAL_POSITION_NED": 10,
        "GLOBAL_POSITION_INT": 4,
        "VFR_HUD": 4,
        "GPS_RAW_INT": 2,
        "HOME_POSITION": 0.5,
        "BATTERY_STATUS": 0.5,
    }.items():
        assert heard[name] == pytest.approx(hz, abs=max(0.1 * hz, 0.11)), name


def test_a_message_comes_as_often_as_asked(station):
    asked = {
        "ATTITUDE": 50,
        "ATTITUDE_QUATERNION": 20,
        "LOCAL_POSITION_NED": 12.5,
        "GLOBAL_POSITION_INT": 5,
        "VFR_HUD": 2,
        "GPS_RAW_INT": 1,
    }
    for name, hz in asked.items():
        assert set_rate(station, name, hz) == ACCEPTED
    heard = rates(station, 10)
    for name, hz in asked.items():
        assert heard[name] == pytest.approx(hz, rel=0.1), name


def test_times_in_a_stream_are_evenly_spread(station):
    set_rate(station, "ATTITUDE", 25)
    station.wait("ATTITUDE")
    station.forget()
    lost = station.lost
    while len(station.named("ATTITUDE")) < 50:
        station.wait("ATTITUDE")
        if station.lost > lost:
            lost = station.lost
            station.forget()
    times = [m.time_boot_ms for m in station.named("ATTITUDE")]
    gaps = [b - a for a, b in pairwise(times)]
    assert gaps[1:] == [40] * len(gaps[1:])


def test_a_message_stops_and_gets_its_default_back(station):
    number = mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED
    assert set_rate(station, "LOCAL_POSITION_NED", -1) == ACCEPTED
    assert "LOCAL_POSITION_NED" not in rates(station, 2)
    station.ask(mav.MAV_CMD_GET_MESSAGE_INTERVAL, number, to=(SYSTEM, 1))
    assert station.wait("MESSAGE_INTERVAL").interval_us == -1
    assert set_rate(station, "LOCAL_POSITION_NED", 0) == ACCEPTED
    assert rates(station, 3)["LOCAL_POSITION_NED"] == pytest.approx(10, rel=0.1)


def test_two_stations_have_rates_of_their_own(copter, connect):
    quick, slow = connect(copter, "tcp"), connect(copter, "udp", system=254)
    assert set_rate(quick, "ATTITUDE", 50) == ACCEPTED
    assert set_rate(slow, "ATTITUDE", 5) == ACCEPTED
    assert set_rate(slow, "VFR_HUD", -1) == ACCEPTED
    from_slow, from_quick = rates(slow, 4), rates(quick, 4)
    assert from_quick["ATTITUDE"] == pytest.approx(50, rel=0.1)
    assert from_quick["VFR_HUD"] == pytest.approx(4, rel=0.1)
    assert from_slow["ATTITUDE"] == pytest.approx(5, rel=0.1)
    assert "VFR_HUD" not in from_slow


def test_the_legacy_stream_request_sets_rates_and_stops(station):
    def ask(stream, hz, on=1):
        station.send(mav.MAVLink_request_data_stream_message(0, 0, stream, hz, on))

    ask(mav.MAV_DATA_STREAM_ALL, 8)
    station.until_answered()
    heard = rates(station, 5)
    for name in (
        "ATTITUDE",
        "GLOBAL_POSITION_INT",
        "VFR_HUD",
        "SYS_STATUS",
        "GPS_RAW_INT",
        "RC_CHANNELS",
        "SERVO_OUTPUT_RAW",
        "LOCAL_POSITION_NED",
        "BATTERY_STATUS",
    ):
        assert heard[name] == pytest.approx(8, rel=0.1), name
    assert heard["HEARTBEAT"] == pytest.approx(1, abs=0.25)
    ask(mav.MAV_DATA_STREAM_EXTRA2, 2)
    station.until_answered()
    assert rates(station, 5)["VFR_HUD"] == pytest.approx(2, rel=0.1)
    ask(mav.MAV_DATA_STREAM_POSITION, 0, on=0)
    station.until_answered()
    assert "GLOBAL_POSITION_INT" not in rates(station, 2)


def test_time_is_compared(station):
    station.send(mav.MAVLink_timesync_message(0, 123_456_789))
    reply = station.wait("TIMESYNC", where=lambda m: m.ts1 == 123_456_789)
    assert reply.tc1 > 0


def test_an_ardupilot_does_not_answer_a_ping(station):
    station.send(mav.MAVLink_ping_message(1, 77, 0, 0))
    assert not [m for m in station.until_answered() if m.get_type() == "PING"]


def test_there_is_no_log_to_download(station):
    station.send(mav.MAVLink_log_request_list_message(SYSTEM, 1, 0, 0xFFFF))
    assert station.wait("LOG_ENTRY").num_logs == 0


def test_stations_hear_one_another_through_the_vehicle(copter, connect):
    one, other = connect(copter, "tcp", system=251), connect(copter, "udp", system=252)
    for station in (one, other):  # once answered they are known to the vehicle
        station.until_answered()
    for station in (one, other):
        station.greet(again=True)
    one.wait("HEARTBEAT", where=lambda m: m.get_srcSystem() == 252)
    other.wait("HEARTBEAT", where=lambda m: m.get_srcSystem() == 251)
    one.send(mav.MAVLink_command_long_message(252, 190, 520, 0, *[0.0] * 7))
    heard = other.wait("COMMAND_LONG")
    assert (heard.get_srcSystem(), heard.command) == (251, 520)
