"""Telemetry logs of any ground station become recordings, whatever state they are in."""

import struct

import pytest
from pymavlink import mavutil

from mavherd.gcs.recording.outside.convert import LogClock
from mavherd.gcs.recording.outside.logs import Log, LogError
from mavherd.transport.mavlink import Codec, mav
from mavherd.transport.tlog import TlogWriter

BEGAN_US = 1_790_000_000_000_000


def entry(slice_number, frame):
    return struct.pack(">Q", BEGAN_US + 10_000 * slice_number) + frame


@pytest.fixture(scope="module")
def entries(desk):
    """Entries of a log: a rover on a link in MAVLink 2, and what a ground station sent to it."""
    ground = Codec(255, 190)
    flow = []
    for number, data in enumerate(desk("rover").frames(6.0)):
        for _, frame in Codec(0).decode_frames(data):
            flow.append(entry(number, frame))
        if number % 100 == 0:
            beat = mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
            flow.append(entry(number, ground.encode([beat])))
    return flow


@pytest.fixture
def log(tmp_path):
    """Write bytes and read them as a log."""

    def write(data, name="some.tlog"):
        (tmp_path / name).write_bytes(data)
        return Log(tmp_path / name)

    return write


def test_a_whole_log_is_read_to_its_end(log, entries):
    some = log(b"".join(entries))
    assert len(list(some.entries())) == len(entries)
    assert (some.skipped, some.torn, some.share) == (0, False, 1.0)


def test_a_torn_end_costs_one_message_and_is_told(log, entries):
    some = log(b"".join(entries)[:-5])
    assert len(list(some.entries())) == len(entries) - 1
    assert some.torn


@pytest.mark.parametrize(
    "rubbish", [b"hello world", bytes(range(256)) * 3, b"\xfd" * 40, b"\xfe\x00"]
)
def test_rubbish_between_messages_is_left_out(log, entries, rubbish):
    middle = len(entries) // 2
    some = log(b"".join([*entries[:middle], rubbish, *entries[middle:]]))
    read = list(some.entries())
    assert len(entries) - 1 <= len(read) <= len(entries)  # it may swallow what follows it at once
    assert 0 < some.skipped <= len(rubbish) + 300


def test_a_log_that_begins_in_the_middle_of_a_message_is_read(log, entries):
    some = log(b"".join(entries)[13:])
    assert len(list(some.entries())) == len(entries) - 1


def test_mavlink_1_and_messages_of_other_dialects_are_no_obstacle(log, entries):
    codec = Codec(4)
    codec.version = 1
    old = codec.encode([mav.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3)])
    foreign = bytes([0xFD, 3, 0, 0, 1, 1, 1, 0x21, 0x43, 0x05, 1, 2, 3, 9, 9])
    stamp = entries[9][:8]
    some = log(b"".join([*entries[:10], stamp + old, stamp + foreign, *entries[10:]]))
    read = [e.message for e in some.entries()]
    assert len(read) == len(entries) + 1
    assert [m.get_type() for m in read if m.get_srcSystem() == 4] == ["HEARTBEAT"]
    assert some.skipped == 0


def test_a_log_written_by_pymavlink_is_read(tmp_path):
    path = tmp_path / "pymavlink.tlog"
    link = mavutil.mavlink.MAVLink(None, srcSystem=7, srcComponent=1)
    with path.open("wb") as file:
        for second in range(5):
            frame = link.heartbeat_encode(2, 3, 81, 4, 3).pack(link)
            file.write(struct.pack(">Q", BEGAN_US + second * 1_000_000) + frame)
    read = list(Log(path).entries())
    assert [e.message.get_srcSystem() for e in read] == [7] * 5
    assert read[-1].time_us - read[0].time_us == 4_000_000


def test_a_log_of_ours_is_read(tmp_path):
    writer = TlogWriter(tmp_path / "ours.tlog")
    beat = Codec(3).encode([mav.MAVLink_heartbeat_message(10, 3, 0, 0, 4, 3)])
    writer.write(BEGAN_US, beat)
    writer.close()
    assert [e.time_us for e in Log(tmp_path / "ours.tlog").entries()] == [BEGAN_US]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "empty"),
        (b"\xa3\x95\x80\x80" + bytes(99), "dataflash"),
        (b"ULog\x01\x12\x35" + bytes(99), "ULog"),
        (b"RRF2" + bytes(99), "Rerun recording already"),
        (b"just some text, and more of it\n" * 9, "no MAVLink message with a time stamp"),
        (bytes(3_000_000), "no MAVLink message with a time stamp"),
    ],
)
def test_what_is_no_log_is_told_with_what_it_may_be(log, data, words):
    with pytest.raises(LogError, match=words):
        list(log(data).entries())


def test_mavlink_without_stamps_is_told(log, entries):
    with pytest.raises(LogError, match="without time stamps"):
        log(b"".join(e[8:] for e in entries))


def test_a_log_that_is_not_there_is_told(tmp_path):
    with pytest.raises(LogError, match="no such file"):
        Log(tmp_path / "none.tlog")


def test_the_clock_of_a_log_may_be_set_under_way():
    clock = LogClock()
    stamps = [0, 1.0, 2.0, 2.0 + 3e8, 3.0 + 3e8, 4.0, 5.0]
    read = [clock.read(BEGAN_US + round(s * 1e6)) for s in stamps]
    assert read == pytest.approx([0, 1, 2, 3, 4, 5, 6])
    assert clock.leaps == 2


def test_messages_of_several_links_may_be_a_little_out_of_order():
    clock = LogClock()
    read = [clock.read(BEGAN_US + us) for us in (0, 500_000, 400_000, 600_000)]
    assert read == pytest.approx([0, 0.5, 0.5, 0.6])
    assert clock.leaps == 0
