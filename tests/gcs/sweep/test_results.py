"""Rows are safe once written: whatever is torn off the end of the stream, the rest is there."""

import os
import subprocess
import sys

import pyarrow as pa
import pytest

from mavherd.gcs.sweep.columns import Column
from mavherd.gcs.sweep.results import ResultStream, read_parquet, write_parquet
from mavherd.transport.errors import MavherdError

COLUMNS = [
    Column("run", "int"),
    Column("passed", "bool"),
    Column("last_arrival_s", "float"),
    Column("error", "text"),
]
ROWS = [
    {"run": 2, "passed": True, "last_arrival_s": 1.25, "error": None},
    {"run": 0, "passed": False, "last_arrival_s": None, "error": "ValueError: é"},
    {"run": 1, "passed": True, "last_arrival_s": 3.0, "error": None},
]


@pytest.fixture
def written(tmp_path):
    """Return the file of a stream of three rows, each its own batch, and where each ends."""
    path = tmp_path / "results.arrows"
    with ResultStream(path, COLUMNS) as stream:
        ends = [path.stat().st_size]
        for row in ROWS:
            stream.append([row])
            ends.append(path.stat().st_size)
    return path, ends


def test_rows_come_back_in_the_order_of_their_runs(written):
    path, _ = written
    with ResultStream(path, COLUMNS) as stream:
        assert (stream.done, stream.cut) == ({0, 1, 2}, 0)
        assert stream.table().to_pylist() == sorted(ROWS, key=lambda row: row["run"])


def test_any_reader_of_arrow_can_follow_the_stream(written):
    path, _ = written
    with path.open("rb") as file:
        assert pa.ipc.open_stream(file).read_all().to_pylist() == ROWS


def test_columns_tell_their_unit(written):
    with ResultStream(written[0], COLUMNS) as stream:
        assert stream.schema.field("last_arrival_s").metadata == {b"unit": b"s"}
        assert stream.schema.field("error").metadata is None


def test_wherever_the_stream_is_torn_whole_rows_stay_and_the_next_one_fits(written):
    path, ends = written
    whole = path.read_bytes()
    for size in range(len(whole)):
        path.write_bytes(whole[:size])
        kept = sum(end <= size for end in ends) - 1  # -1: not even the schema
        with ResultStream(path, COLUMNS) as stream:
            assert stream.done == {row["run"] for row in ROWS[: max(kept, 0)]}, size
            assert stream.cut == size - (ends[kept] if kept >= 0 else 0)
            stream.append([{"run": 7, "passed": True}])
            assert stream.table()["run"].to_pylist()[-1] == 7


@pytest.mark.parametrize("rubbish", [b"\0" * 4096, b"\xff" * 64, b"rubbish" * 9], ids=str)
def test_what_is_no_batch_is_cut_off(written, rubbish):
    path, ends = written
    with path.open("ab") as file:
        file.write(rubbish)
    with ResultStream(path, COLUMNS) as stream:
        assert (stream.done, stream.cut) == ({0, 1, 2}, len(rubbish))
    assert path.stat().st_size == ends[-1]


@pytest.mark.parametrize("rubbish", [b"\0" * 4096, b"rubbish" * 900, b"\xff" * 7], ids=len)
def test_what_is_no_stream_at_all_is_refused_and_stays(tmp_path, rubbish):
    path = tmp_path / "results.arrows"
    path.write_bytes(rubbish)
    with pytest.raises(MavherdError, match=r"results\.arrows: not the results of a sweep"):
        ResultStream(path, COLUMNS)
    assert path.read_bytes() == rubbish


def test_rows_of_other_columns_are_another_sweeps(written):
    with pytest.raises(MavherdError, match="its columns are not those"):
        ResultStream(written[0], COLUMNS[:-1])
    with ResultStream(written[0], COLUMNS) as stream:
        assert stream.done == {0, 1, 2}  # nothing was done to them


def test_one_process_at_a_time(written):
    path, ends = written
    code = (
        "import sys; from pathlib import Path\n"
        "from mavherd.gcs.sweep.results import ResultStream\n"
        "ResultStream(Path(sys.argv[1]), [])"
    )
    command = [sys.executable, "-c", code, str(path)]
    with ResultStream(path, COLUMNS) as held:
        said = subprocess.run(command, capture_output=True, text=True, check=False).stderr
        assert "another process writes this sweep" in said
        held.append([{"run": 3, "passed": True}])
    assert path.stat().st_size > ends[-1]


def test_parquet_has_its_name_only_when_it_is_complete(tmp_path, written, monkeypatch):
    with ResultStream(written[0], COLUMNS) as stream:
        table = stream.table()
    path = tmp_path / "results.parquet"

    def fails(fd):
        assert not path.exists()
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", fails)
        with pytest.raises(OSError, match="No space"):
            write_parquet(path, table)
    assert not path.exists()
    write_parquet(path, table)
    assert read_parquet(path).equals(table)


def test_what_is_no_parquet_is_named(tmp_path):
    path = tmp_path / "results.parquet"
    path.write_bytes(b"PAR1")
    with pytest.raises(MavherdError, match=r"results\.parquet: not a sweep's table"):
        read_parquet(path)
