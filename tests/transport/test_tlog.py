"""Telemetry logs are what ground stations read, complete or visibly partial."""

import hashlib

import pytest
from pymavlink import mavutil

from mavherd.transport.errors import MavherdError
from mavherd.transport.mavlink import Codec, mav
from mavherd.transport.tlog import TlogWriter, digest, read_tlog, torn_at

EPOCH_US = 1_767_225_600_000_000


def frames(count: int) -> list[bytes]:
    codec = Codec(3)
    return codec.frames(mav.MAVLink_statustext_message(6, b"%d" % i) for i in range(count))


def write(path, count=10, every_us=100_000):
    log = TlogWriter(path)
    for i, frame in enumerate(frames(count)):
        log.write(EPOCH_US + i * every_us, frame)
    log.close()
    return path


def test_pymavlinks_own_reader_reads_it(tmp_path):
    reader = mavutil.mavlogfile(str(write(tmp_path / "a.tlog")))
    try:
        got = []
        while (m := reader.recv_match(type="STATUSTEXT")) is not None:
            got.append((m.text, m._timestamp, m.get_srcSystem()))
    finally:
        reader.close()
    assert [text for text, _, _ in got] == [str(i) for i in range(10)]
    assert got[3][1] == pytest.approx(EPOCH_US * 1e-6 + 0.3, abs=1e-3)
    assert {system for _, _, system in got} == {3}


def test_what_was_written_is_read_back(tmp_path):
    got = list(read_tlog(write(tmp_path / "a.tlog")))
    assert [frame for _, frame in got] == frames(10)
    assert [t for t, _ in got] == [EPOCH_US + i * 100_000 for i in range(10)]


def test_version_1_and_signed_frames_are_logged_whole(tmp_path):
    sender = mav.MAVLink(None, srcSystem=3, srcComponent=1)
    m = mav.MAVLink_heartbeat_message(2, 3, 1, 4, 3, 3)
    old = bytes(m.pack(sender, force_mavlink1=True))
    sender.signing.secret_key, sender.signing.sign_outgoing = b"k" * 32, True
    signed = bytes(m.pack(sender))
    log = TlogWriter(tmp_path / "a.tlog")
    for frame in (old, signed, old):
        log.write(1, frame)
    log.close()
    assert [frame for _, frame in read_tlog(tmp_path / "a.tlog")] == [old, signed, old]


def test_an_unfinished_log_has_another_name(tmp_path):
    log = TlogWriter(tmp_path / "a.tlog")
    log.write(EPOCH_US, frames(1)[0])
    assert not (tmp_path / "a.tlog").exists()
    assert (tmp_path / "a.tlog.part").exists()
    log.close()
    assert [p.name for p in tmp_path.iterdir()] == ["a.tlog"]


def test_a_torn_tail_ends_it_after_the_last_whole_frame(tmp_path):
    whole = write(tmp_path / "a.tlog").read_bytes()
    last = 8 + len(frames(10)[-1])
    torn = tmp_path / "torn.tlog"
    for missing in range(1, last):
        torn.write_bytes(whole[:-missing])
        assert len(list(read_tlog(torn))) == 9
        assert torn_at(torn) == len(whole) - last
    torn.write_bytes(b"")
    assert list(read_tlog(torn)) == []
    assert torn_at(torn) == 0
    torn.write_bytes(whole[:-last])
    assert torn_at(torn) is None


def test_another_kind_of_file_is_named(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("this is not a telemetry log")
    with pytest.raises(MavherdError, match=r"notes\.txt.*not a tlog"):
        list(read_tlog(path))


def test_the_digest_is_over_frames_in_order_without_times(tmp_path):
    a = write(tmp_path / "a.tlog")
    b = write(tmp_path / "b.tlog", 4)
    slower = write(tmp_path / "slower.tlog", every_us=200_000)
    expected = hashlib.sha256(b"".join(frames(10) + frames(4))).hexdigest()
    assert digest([a, b]) == digest([slower, b]) == expected
    assert digest([b, a]) != expected


def test_of_a_log_whose_writer_is_killed_only_the_last_half_second_is_missing(tmp_path):
    log = TlogWriter(tmp_path / "a.tlog")
    for i, frame in enumerate(frames(200)):
        log.write(EPOCH_US + i * 10_000, frame)
    stamps = [time_us for time_us, _ in read_tlog(tmp_path / "a.tlog.part")]
    log.close()
    assert EPOCH_US + 1_990_000 - stamps[-1] <= 500_000
