"""Logs become one recording, and what is wrong with them is told."""

import struct

import pytest

pytest.importorskip("rerun")

from mavherd.gcs.patience import Bar
from mavherd.gcs.recording.outside.convert import convert_logs
from mavherd.gcs.recording.outside.logs import LogError
from mavherd.transport.mavlink import Codec, mav

BEGAN_US = 1_790_000_000_000_000


def log_of(path, desk, seconds, after_s=0.0):
    """Write the log of a vehicle that was heard for a while, from `after_s` on."""
    with path.open("wb") as file:
        for number, data in enumerate(desk.frames(seconds)):
            stamp = struct.pack(">Q", BEGAN_US + round(after_s * 1e6) + 10_000 * number)
            for _, frame in Codec(0).decode_frames(data):
                file.write(stamp + frame)
    return path


@pytest.fixture
def convert(tmp_path, read):
    def run(*logs):
        with Bar("converting") as bar:
            done = convert_logs(logs, tmp_path / "all.rrd", bar)
        return done, read(tmp_path / "all.rrd")

    return run


def test_several_logs_are_shown_together_by_their_stamps(tmp_path, desk, convert):
    one = log_of(tmp_path / "one.tlog", desk("rover", system_id=4), 8.0)
    other = log_of(tmp_path / "two.tlog", desk("rover", system_id=5, east=3.0), 8.0, after_s=5.0)
    done, recording = convert(other, one)
    assert sorted(done.vehicles) == ["sys4", "sys5"]
    assert done.seconds == pytest.approx(13, abs=0.3)
    assert done.remarks == []
    time, place = recording.positions("sys5")
    assert time[0] == pytest.approx(5, abs=0.5)
    assert time[-1] == pytest.approx(13, abs=0.5)
    assert place[-1] == pytest.approx([3, 0, 0], abs=0.05)
    assert recording.positions("sys4")[0][-1] == pytest.approx(8, abs=0.5)


def test_what_is_wrong_with_a_log_is_told_and_the_rest_converted(tmp_path, desk, convert):
    log = log_of(tmp_path / "some.tlog", desk("quadcopter"), 8.0)
    data = log.read_bytes()
    stamps = (struct.pack(">Q", BEGAN_US + 10_000 * number) for number in range(400, 800))
    middle = next(at for stamp in stamps if (at := data.find(stamp)) > 0)
    log.write_bytes(data[:middle] + b"rubbish" + data[middle:-3])
    done, recording = convert(log)
    assert done.vehicles == ["sys1"]
    assert any("cut short" in remark for remark in done.remarks)
    assert any("7 bytes" in remark for remark in done.remarks)
    assert recording.positions("sys1")[0][-1] > 7


def test_a_silence_in_a_log_is_told_where_it_was(tmp_path, desk, convert):
    vehicle, path = desk("rover"), tmp_path / "gap.tlog"
    before = log_of(path, vehicle, 6.0).read_bytes()
    list(vehicle.frames(20.0))
    after = log_of(path, vehicle, 4.0, after_s=26.0).read_bytes()
    path.write_bytes(before + after)
    _, recording = convert(path)
    events = {text[0]: t for t, text in recording.rows("/events", "TextLog:text")}
    (silent,) = (t for text, t in events.items() if "link silent" in text)
    (back,) = (t for text, t in events.items() if "link back after 2" in text)
    assert silent == pytest.approx(9, abs=0.5)
    assert back == pytest.approx(26, abs=0.5)


def test_a_log_without_a_vehicle_is_refused(tmp_path, convert):
    beat = Codec(255, 190).encode([mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)])
    (tmp_path / "ground.tlog").write_bytes(struct.pack(">Q", BEGAN_US) + beat)
    with pytest.raises(LogError, match="no vehicle in it"):
        convert(tmp_path / "ground.tlog")
