"""The truth log holds what the physics had, in named columns, complete or visibly partial."""

import json
import struct

import pytest

from mavherd.vehicles.truth import POSE_COLUMNS, RATE_HZ, TruthLog


def read(path):
    header, _, data = path.read_bytes().partition(b"\n")
    header = json.loads(header)
    row = struct.Struct(f"<{len(header['columns'])}d")
    return header, list(row.iter_unpack(data[: len(data) // row.size * row.size]))


@pytest.mark.parametrize(("kind", "actuators"), [("quadcopter", 8), ("rover", 4)])
def test_rows_are_the_physics_under_the_headers_names(desk, tmp_path, kind, actuators):
    vehicle = desk(kind, north=3.0, yaw=0.5, system_id=7, name="seven")
    log = TruthLog(tmp_path, vehicle.vehicle.config, vehicle.vehicle.robot)
    vehicle.fly()
    expected = []
    for _ in range(50):
        vehicle.run(0.01)
        log.write(vehicle.now, vehicle.vehicle.robot)
        robot = vehicle.vehicle.robot
        expected.append((vehicle.now, *robot.kinematics(), *robot.actuators()))
    log.close()
    header, rows = read(tmp_path / "truth.bin")
    assert rows == expected
    assert (header["name"], header["kind"], header["system_id"]) == ("seven", kind, 7)
    assert header["rate_hz"] == RATE_HZ == 100
    assert tuple(header["columns"][: len(POSE_COLUMNS)]) == POSE_COLUMNS
    assert len(header["columns"]) == len(POSE_COLUMNS) + actuators


def test_an_unfinished_log_has_another_name_and_can_be_read_after_a_flush(desk, tmp_path):
    vehicle = desk("rover")
    log = TruthLog(tmp_path, vehicle.vehicle.config, vehicle.vehicle.robot)
    for _ in range(3):
        log.write(vehicle.now, vehicle.vehicle.robot)
    log.flush()
    assert [p.name for p in tmp_path.iterdir()] == ["truth.bin.part"]
    assert len(read(tmp_path / "truth.bin.part")[1]) == 3
    log.close()
    assert [p.name for p in tmp_path.iterdir()] == ["truth.bin"]
