"""The tables of a run agree with its tracks, and say of every column what docs/data.md says."""

import re
from pathlib import Path

import numpy as np
import pytest

from mavherd.gcs.report import states
from mavherd.gcs.report.columns import EVENTS, QUADCOPTERS, ROVERS, STATES, VERSION, describe
from mavherd.gcs.report.states import write_events, write_states
from mavherd.gcs.report.truth import read_truth
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.truth import TruthLog
from mavherd.vehicles.vehicle import Vehicle

pq = pytest.importorskip("pyarrow.parquet")
DOCS = Path(__file__).parents[3] / "docs" / "data.md"
ALL = (*STATES, *ROVERS, *QUADCOPTERS)


@pytest.fixture
def flown(tmp_path):
    """A rover and a quadcopter as their own logs have them: 0.3 s with motors off."""
    tracks = []
    for system_id, kind in enumerate(("rover", "quadcopter"), 1):
        config = VehicleConfig(kind=kind, system_id=system_id, name=kind)
        robot = Vehicle(config).robot
        log = TruthLog(tmp_path, config, robot)
        for k in range(30):
            log.write(k / 100, robot)
        log.close()
        tracks.append(read_truth(tmp_path / "truth.bin"))
    return tracks


def test_every_column_of_a_real_vehicle_is_described(flown, tmp_path):
    schema = pq.read_schema(write_states(tmp_path, flown))
    assert set(schema.names) == {column.name for column in ALL}
    for field in schema:
        told = {key.decode(): value.decode() for key, value in field.metadata.items()}
        column = describe(field.name)
        assert told["unit"] == column.unit
        assert told.get("frame", "") == column.frame
        assert told["description"] == column.text


def test_the_table_says_what_it_is_and_whether_something_is_missing(flown, tmp_path):
    for partial in (False, True):
        about = pq.read_schema(write_states(tmp_path, flown, partial=partial)).metadata
        assert about[b"mavherd"] == b"states"
        assert about[b"schema"] == str(VERSION).encode()
        assert b"ENU" in about[b"frame"]
        assert about[b"partial"] == (b"true" if partial else b"false")


def test_numbers_that_a_robot_does_not_have_are_null_and_never_nan(flown, tmp_path):
    table = pq.read_table(write_states(tmp_path, flown))
    rover, quadcopter = table.slice(0, 30), table.slice(30, 30)
    assert rover["left_wheel_speed_rad_s"].null_count == 0
    assert rover["rotor1_speed_rad_s"].null_count == 30
    assert quadcopter["left_wheel_speed_rad_s"].null_count == 30
    assert quadcopter["roll_command_rad"].null_count == 30  # motors are off: nothing is commanded
    for name in table.column_names[3:]:
        assert not np.isnan(table[name].drop_null().to_numpy()).any(), name


def test_a_column_that_nobody_has_described_has_the_unit_of_its_name():
    assert describe("winch_speed_rad_s").unit == "rad/s"
    assert describe("mood").unit == "1"


def test_events_are_a_table_too(tmp_path):
    events = [
        {"t": 0.5, "vehicle": "quad1", "kind": "text", "text": "Arming", "severity": 6},
        {"t": 1.0, "vehicle": None, "kind": "ports", "text": "taken", "more": [1]},
    ]
    table = pq.read_table(write_events(tmp_path, events))
    assert table.column_names == [column.name for column in EVENTS]
    assert table.to_pylist() == [
        {"time_s": 0.5, "vehicle": "quad1", "kind": "text", "severity": 6, "text": "Arming"},
        {"time_s": 1.0, "vehicle": None, "kind": "ports", "severity": None, "text": "taken"},
    ]
    assert pq.read_table(write_events(tmp_path, [])).num_rows == 0
    assert not list(tmp_path.glob("*.part"))


def test_pandas_and_polars_load_it_in_one_line(flown, tmp_path):
    path = write_states(tmp_path, flown)
    for package in ("pandas", "polars"):
        states = pytest.importorskip(package).read_parquet(path)
        assert len(states) == 60
        assert set(states["kind"]) == {"rover", "quadcopter"}


def test_the_documentation_has_every_column_with_unit_and_frame():
    rows = re.findall(r"^\| `(\w+)` \| ([^|]*) \| ([^|]*) \| ([^|]*) \|$", DOCS.read_text(), re.M)
    written = {(name, unit, frame.strip(), text) for name, unit, frame, text in rows}
    assert written == {(c.name, c.unit, c.frame, c.text) for c in (*ALL, *EVENTS)}
    assert f"schema {VERSION}" in DOCS.read_text()


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_table_that_was_broken_off_is_not_there(tmp_path, monkeypatch, error):
    def write_a_little(part, *_):
        part.write_bytes(b"PAR1")
        raise error

    monkeypatch.setattr(states, "_write_parquet", write_a_little)
    folder = tmp_path / "out"
    folder.mkdir()
    with pytest.raises(type(error)):
        write_states(folder, [])
    assert not list(folder.iterdir())
