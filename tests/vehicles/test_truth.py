"""The truth log holds what the physics had, in named columns, complete or visibly partial."""

import json
import struct
from math import isnan

import pytest

from mavherd.vehicles.truth import POSE_COLUMNS, RATE_HZ, TruthLog


def read(path):
    header, _, data = path.read_bytes().partition(b"\n")
    header = json.loads(header)
    row = struct.Struct(f"<{len(header['columns'])}d")
    return header, list(row.iter_unpack(data[: len(data) // row.size * row.size]))


@pytest.mark.parametrize(("kind", "actuators", "commands"), [("quadcopter", 8, 4), ("rover", 4, 2)])
def test_rows_are_the_physics_under_the_headers_names(desk, tmp_path, kind, actuators, commands):
    vehicle = desk(kind, north=3.0, yaw=0.5, system_id=7, name="seven")
    log = TruthLog(tmp_path, vehicle.vehicle.config, vehicle.vehicle.robot)
    vehicle.fly()
    expected = []
    for _ in range(50):
        vehicle.run(0.01)
        log.write(vehicle.now, vehicle.vehicle.robot)
        robot = vehicle.vehicle.robot
        expected.append((vehicle.now, *robot.kinematics(), *robot.actuators(), *robot.commands()))
    log.close()
    header, rows = read(tmp_path / "truth.bin")
    assert rows == expected
    assert (header["name"], header["kind"], header["system_id"]) == ("seven", kind, 7)
    assert header["rate_hz"] == RATE_HZ == 100
    assert tuple(header["columns"][: len(POSE_COLUMNS)]) == POSE_COLUMNS
    assert len(header["columns"]) == len(POSE_COLUMNS) + actuators + commands
    assert header["commands"] == commands
    assert all("_command_" in name for name in header["columns"][-commands:])


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


def test_a_quadcopter_on_the_ground_asks_for_no_attitude_and_one_in_the_air_for_what_it_flies(quad):
    robot = quad.vehicle.robot
    assert all(map(isnan, robot.commands()))
    quad.fly()
    quad.stream(quad.target(0b110111000111, vx=2.0), 1.0)
    asked = []
    for _ in range(50):
        quad.stream(quad.target(0b110111000111, vx=2.0), 0.02, every=0.02)
        asked.append(robot.commands())
    roll, pitch, yaw, thrust = asked[-1]
    assert abs(roll) < 0.02
    assert abs(pitch) < 0.1  # speed is kept: level again
    assert yaw == pytest.approx(quad.yaw, abs=0.05)
    assert thrust == pytest.approx(robot._params.weight, rel=0.05)
    quad.stream(quad.target(0b110111000111, vx=-2.0), 0.1)
    assert robot.commands()[1] > 0.1  # the nose goes up to brake
    quad.mode("LAND")
    quad.run(20)
    assert all(map(isnan, robot.commands()))


def test_what_is_asked_of_a_rovers_wheels_is_a_speed_and_a_turn(rover):
    robot = rover.vehicle.robot
    assert all(map(isnan, robot.commands()))
    rover.fly()
    rover.stream(rover.target(0b010111000111, vx=0.5, yaw_rate=0.4), 1.0)
    speed, turn = robot.commands()
    left, right = robot.actuators()[2:]
    assert turn == pytest.approx(0.4)
    assert speed == pytest.approx(0.0975 * (left + right) / 2)
    assert 0.3 < speed <= 0.5
