"""What a tlog tells of a link: counted by hand, for both versions of MAVLink and torn logs."""

import pytest

from mavherd.gcs.report.traffic import read_traffic
from mavherd.transport.mavlink import Codec, mav
from mavherd.transport.tlog import TlogWriter

EPOCH_US = 1_700_000_000_000_000
POSITION = mav.MAVLink_local_position_ned_message(0, 1, 2, 3, 0, 0, 0)
SETPOINT = mav.MAVLink_set_position_target_local_ned_message(
    0, 7, 1, 1, 0, 1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0
)
HEARTBEAT = mav.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3)


@pytest.fixture
def log(tmp_path):
    """Write a log of (time in s, codec, message); return its path and the bytes of each sender."""

    def write(*entries):
        path = tmp_path / "vehicle.tlog"
        writer, sizes = TlogWriter(path), {}
        for seconds, codec, message in entries:
            frame = codec.encode([message])
            writer.write(EPOCH_US + round(seconds * 1e6), frame)
            sizes[codec.system_id] = sizes.get(codec.system_id, 0) + len(frame)
        writer.close()
        return path, sizes

    return write


def test_setpoints_have_a_rate_an_age_and_a_longest_gap(log):
    ground = Codec(254)
    times = (2.0, 2.1, 2.2, 2.8, 3.0)
    path, _ = log((0.0, ground, HEARTBEAT), *((t, ground, SETPOINT) for t in times))
    setpoints = read_traffic(path, 7).setpoints
    assert setpoints.number == 5
    assert setpoints.window == pytest.approx(1.0)
    assert setpoints.rate == pytest.approx(4.0)
    assert setpoints.longest_gap == pytest.approx(0.6)
    # A setpoint ages from 0 to the gap, so each gap counts half its length, as long as it is.
    assert setpoints.mean_age == pytest.approx((0.1**2 + 0.1**2 + 0.6**2 + 0.2**2) / 2)


@pytest.mark.parametrize("version", [1, 2])
def test_frames_bytes_and_losses_are_counted_by_sender(log, version):
    ground, vehicle, stranger = Codec(254), Codec(7), Codec(255)
    for codec in (ground, vehicle, stranger):
        codec.version = version
    vehicle.sequence = 254  # it wraps on the way

    def told(seconds):
        return seconds, vehicle, POSITION

    entries = [told(0.0), told(0.1), told(0.2), (0.25, ground, SETPOINT), (0.3, stranger, POSITION)]
    path, sizes = log(*entries)
    link = read_traffic(path, 7).link
    assert (link.to_frames, link.to_bytes) == (1, sizes[254])
    assert (link.from_frames, link.from_bytes) == (3, sizes[7])
    assert link.position_rate == pytest.approx(10)
    assert link.lost == 0


def test_missing_sequence_numbers_are_lost_frames_and_a_repeated_one_is_none(log):
    vehicle, camera = Codec(7), Codec(7, 100)
    path, _ = log((0, vehicle, POSITION), (0, camera, HEARTBEAT))
    whole = path.read_bytes()
    vehicle.sequence += 3
    gap, _ = log((1, vehicle, POSITION), (1, camera, HEARTBEAT))
    path.write_bytes(whole + gap.read_bytes() + gap.read_bytes())
    assert read_traffic(path, 7).link.lost == 3


@pytest.mark.parametrize(
    ("numbers", "lost"),
    [
        ((1, 2, 4, 3, 5), 0),
        ((1, 2, 4, 3, 3, 7), 2),
        ((254, 255, 1, 0, 2), 0),
        ((2, 5, 3, 9), 4),
        ((1, 4, 4, 0, 6), 3),  # one comes even before the first
    ],
)
def test_frames_that_overtake_one_another_are_not_lost(log, numbers, lost):
    told = []
    for k, number in enumerate(numbers):
        vehicle = Codec(7)
        vehicle.sequence = number
        told.append((0.1 * k, vehicle, POSITION))
    path, _ = log(*told)
    assert read_traffic(path, 7).link.lost == lost


def test_more_than_half_the_numbers_may_be_lost_in_a_silence(log):
    vehicle, later = Codec(7), Codec(7)
    later.sequence = 200
    path, _ = log((0.0, vehicle, POSITION), (5.0, later, POSITION))
    assert read_traffic(path, 7).link.lost == 199


@pytest.mark.parametrize("version", [1, 2])
def test_a_vehicle_that_starts_anew_has_lost_nothing(log, version):
    before, after = Codec(7), Codec(7)
    before.version = after.version = version
    before.sequence, after.sequence = 200, 0

    def position(seconds):
        return mav.MAVLink_local_position_ned_message(round(1e3 * seconds), 0, 0, 0, 0, 0, 0)

    path, _ = log(
        (100.0, before, position(80.0)),
        (100.1, before, position(80.1)),
        (103.0, after, HEARTBEAT),
        (103.2, after, position(0.3)),
        (103.3, after, position(0.4)),
    )
    assert read_traffic(path, 7).link.lost == 0


def test_the_longest_silence_may_be_the_last(log):
    ground, vehicle = Codec(254), Codec(7)
    times = (0.0, 0.5, 1.0)
    path, _ = log(*((t, vehicle, POSITION) for t in times), (4.0, ground, HEARTBEAT))
    assert read_traffic(path, 7).link.longest_silence == pytest.approx(3.0)
    path, _ = log((0.0, ground, HEARTBEAT))
    assert read_traffic(path, 7).link.longest_silence is None


def test_the_oldest_state_is_the_one_that_a_setpoint_was_made_of(log):
    ground, vehicle = Codec(254), Codec(7)
    path, _ = log(
        (0.0, ground, SETPOINT),  # of nothing that it has told
        (1.0, vehicle, POSITION),
        (1.0, ground, SETPOINT),
        (1.4, ground, SETPOINT),
        (2.0, vehicle, POSITION),
        (2.1, ground, SETPOINT),
        (9.0, vehicle, POSITION),
    )
    assert read_traffic(path, 7).link.oldest_position == pytest.approx(0.4)


def test_of_a_torn_log_what_is_whole_counts_and_of_none_nothing(log, tmp_path):
    ground = Codec(254)
    path, _ = log(*((0.1 * k, ground, SETPOINT) for k in range(4)))
    path.write_bytes(path.read_bytes()[:-5])
    assert read_traffic(path, 7).setpoints.number == 3
    for content in (b"", b"\x00" * 8, b"this is not a log of anything"):
        path.write_bytes(content)
        assert read_traffic(path, 7) is None
    assert read_traffic(tmp_path / "elsewhere.tlog", 7) is None


def test_a_single_setpoint_has_no_rate(log):
    path, _ = log((0.0, Codec(254), SETPOINT))
    assert read_traffic(path, 7).setpoints == (1, None, None, None, None)
