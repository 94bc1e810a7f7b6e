"""Truth logs are read whole, torn or growing, and come out in the ground side's frame."""

import numpy as np
import pytest

from mavherd.gcs.report.truth import TruthError, TruthTail, read_all, read_truth, to_places
from mavherd.transport.frames import quaternion_from_euler, quaternion_to_enu, yaw_of
from mavherd.vehicles.truth import POSE_COLUMNS, PlaceLog, TruthLog


def climb_north_east(t):
    return 2 * t, 3 * t, 1 * t


@pytest.fixture
def log(tmp_path, truth_log):
    return truth_log(tmp_path / "truth.bin", "quad1", "quadcopter", 4, climb_north_east, 1.0)


def test_a_track_says_who_it_is_and_what_each_column_holds(log):
    track = read_truth(log)
    assert (track.name, track.kind, track.system_id, len(track)) == ("quad1", "quadcopter", 4, 101)
    assert track.columns[: len(POSE_COLUMNS)] == POSE_COLUMNS
    assert track.actuator_names == tuple(f"rotor{i}_rad_s" for i in (1, 2, 3, 4))
    assert track.actuators.shape == (101, 4)
    assert track.actuators[7].tolist() == [7.0] * 4


def test_positions_and_velocities_come_out_east_north_up(log):
    track = read_truth(log)
    assert track.time[-1] == pytest.approx(1.0)
    assert track.position[-1] == pytest.approx([2, 3, 1])
    assert track.velocity[50] == pytest.approx([2, 3, 1])


def test_body_rates_come_out_about_forward_left_up(log):
    assert read_truth(log).rates[0] == pytest.approx([0.1, -0.2, -0.3])


def test_attitudes_agree_with_the_frames_module(log):
    track = read_truth(log)
    assert np.linalg.norm(track.quaternion, axis=1) == pytest.approx(1.0)
    assert yaw_of(track.quaternion[0]) == pytest.approx(np.pi / 2)  # north is 90 degrees from east
    tilted = quaternion_from_euler(0.2, -0.1, 0.7)
    rows = bytearray(log.read_bytes())
    begin = rows.index(b"\n") + 1 + 7 * 8
    rows[begin : begin + 32] = np.array(tilted).tobytes()
    log.write_bytes(rows)
    assert read_truth(log).quaternion[0] == pytest.approx(quaternion_to_enu(tilted))


def test_a_torn_last_row_is_left_out(log):
    torn = log.rename(log.with_name("truth.bin.part"))
    torn.write_bytes(torn.read_bytes()[:-5])
    assert len(read_truth(torn)) == 100


@pytest.mark.parametrize(
    "content", [b"", b'{"schema": 1', b"hello\n", b"[1]\n", b'{"schema": 9}\n']
)
def test_what_is_no_truth_log_is_named(tmp_path, content):
    path = tmp_path / "truth.bin"
    path.write_bytes(content)
    with pytest.raises(TruthError, match=r"truth\.bin"):
        read_truth(path)


def test_a_log_of_another_schema_is_refused(log):
    log.write_bytes(log.read_bytes().replace(b'"schema": 1', b'"schema": 2', 1))
    with pytest.raises(TruthError, match="schema 2, this program reads 1"):
        read_truth(log)


def test_a_log_that_is_not_there_is_named(tmp_path):
    with pytest.raises(TruthError, match="No such file"):
        read_truth(tmp_path / "truth.bin")


def test_a_tail_reads_each_row_once_across_torn_rows_and_the_rename(log):
    data, part = log.read_bytes(), log.with_name("truth.bin.part")
    log.unlink()
    rows = []
    with TruthTail(log) as tail:
        assert tail.read() is None  # no file yet
        for size in (10, len(data) // 3, 2 * len(data) // 3 + 3):
            part.write_bytes(data[:size]) if size == 10 else append(part, data[:size])
            rows.append(tail.read())
        append(part, data)
        part.rename(log)
        rows += [tail.read(), tail.read()]
    assert rows[0] is None  # only a piece of the header
    times = np.concatenate([track.time for track in rows[1:]])
    assert times == pytest.approx(np.arange(101) / 100)
    assert len(rows[-1]) == 0


def append(path, data):
    with path.open("ab") as file:
        file.write(data[file.tell() :])


def test_a_tail_that_comes_late_finds_the_finished_log(log):
    with TruthTail(log) as tail:
        assert len(tail.read()) == 101


@pytest.mark.parametrize("pieces", [1, 7])
def test_a_tail_may_give_out_fewer_rows_those_of_round_times(tmp_path, truth_log, pieces):
    path = tmp_path / "truth.bin"
    data = truth_log(path, "r", "rover", 1, climb_north_east, 1.0, start=0.01).read_bytes()
    path.unlink()
    header = data.index(b"\n") + 1
    times = []
    with TruthTail(path, 5) as tail:
        for piece in range(1, pieces + 1):
            append(path, data[: header + (len(data) - header) * piece // pieces])
            times.append(tail.read().time)
    assert np.concatenate(times) == pytest.approx(np.arange(1, 21) / 20)


def test_many_tails_read_at_once_say_what_each_says_alone(tmp_path, truth_log):
    kinds = {"one": "rover", "two": "quadcopter", "three": "rover"}
    logs = {name: tmp_path / name / "truth.bin" for name in kinds}
    for number, (name, path) in enumerate(logs.items(), 1):
        truth_log(path, name, kinds[name], number, climb_north_east, number)
    late = TruthTail(tmp_path / "truth.bin")  # of a vehicle that has written nothing yet
    tracks = {t.name: t for t in read_all([late, *map(TruthTail, logs.values())])}
    assert set(tracks) == set(kinds)
    for name, path in logs.items():
        alone, track = read_truth(path), tracks[name]
        assert (track.kind, track.system_id) == (alone.kind, alone.system_id)
        for part in ("time", "position", "velocity", "quaternion", "rates", "actuators"):
            assert np.array_equal(getattr(track, part), getattr(alone, part))


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_places_kept_in_memory_are_those_of_the_log(tmp_path, desk, kind):
    robot = desk(kind, system_id=7, name="seven", north=3.0, east=-1.0, yaw=0.5)
    vehicle = robot.vehicle
    log, kept = TruthLog(tmp_path, vehicle.config, vehicle.robot), PlaceLog()
    robot.fly()
    target = robot.target(0b0000_1111_1111_1000, x=5.0, y=2.0, z=-2.0)
    for _ in range(100):
        robot.stream(target, 0.01, every=0.01)
        for each in (log, kept):
            each.write(robot.now, vehicle.robot)
    log.close()
    track, places = read_truth(tmp_path / "truth.bin"), to_places(vehicle.config, kept.rows)
    assert np.ptp(places.position, axis=0).max() > 0.1  # it moves
    assert places.position.tobytes() == track.position.tobytes()
    assert places.time.tobytes() == track.time.tobytes()
    for name in ("name", "kind", "system_id", "source"):
        assert getattr(places, name) == getattr(track, name)
    assert len(places) == 100


@pytest.mark.parametrize(
    ("kind", "asked", "expected"),
    [
        ("quadcopter", (0.1, 0.2, 0.3, 15.0), (0.1, -0.2, np.pi / 2 - 0.3, 15.0)),
        ("quadcopter", (np.nan,) * 4, (np.nan,) * 4),
        ("rover", (0.5, 0.4), (0.5, -0.4)),
    ],
)
def test_commands_come_out_about_forward_left_up(desk, tmp_path, kind, asked, expected):
    vehicle = desk(kind).vehicle
    log = TruthLog(tmp_path, vehicle.config, vehicle.robot)
    log.write(0.0, vehicle.robot)
    log.close()
    path = tmp_path / "truth.bin"
    path.write_bytes(path.read_bytes()[: -8 * len(asked)] + np.array(asked).tobytes())
    track = read_truth(path)
    assert track.command_names == vehicle.robot.command_names
    assert track.actuator_names == vehicle.robot.actuator_names
    assert track.actuators.shape == (1, len(track.actuator_names))
    assert track.commands[0] == pytest.approx(expected, nan_ok=True)


def test_a_log_from_before_commands_were_kept_is_read(log):
    track = read_truth(log)
    assert track.commands.shape == (101, 0)
    assert track.command_names == ()
