"""A recording is made smaller and shows the same; one that cannot be stays as it is."""

import numpy as np
import pytest

pytest.importorskip("rerun")

from mavherd.gcs.recording.compact import compact
from mavherd.gcs.recording.stream import Stream


def record(path, batches=100):
    """Record a line in many small batches, as a run that lasts is."""
    import rerun as rr

    stream = Stream("run", file=path)
    for batch in range(batches):
        time = np.arange(10) / 10 + batch
        stream.columns("line", time, rr.Scalars.columns(scalars=2 * time))
        stream.flush_file()
    stream.close()


def values(path):
    from rerun.chunk import RrdReader

    rows = [chunk.to_record_batch() for chunk in RrdReader(path).stream()]
    lines = [row for row in rows if "Scalars:scalars" in row.schema.names]
    return sorted(v for row in lines for (v,) in row["Scalars:scalars"].to_pylist())


def test_what_is_recorded_in_many_batches_becomes_small_and_stays_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr("mavherd.gcs.recording.compact._PATIENCE_S", 60.0)
    path = tmp_path / "run.rrd"
    record(path)
    before, size = values(path), path.stat().st_size
    assert compact(path)
    assert path.stat().st_size < size / 3
    assert values(path) == before
    assert [f.name for f in tmp_path.iterdir()] == ["run.rrd"]


def test_what_is_no_recording_stays_as_it_is(tmp_path):
    path = tmp_path / "run.rrd"
    path.write_bytes(b"no recording")
    assert not compact(path)
    assert path.read_bytes() == b"no recording"
    assert [f.name for f in tmp_path.iterdir()] == ["run.rrd"]


def test_where_there_is_no_rerun_program_it_stays_as_it_is(tmp_path, monkeypatch):
    monkeypatch.setenv("MAVHERD_RERUN", str(tmp_path / "nothing"))
    path = tmp_path / "run.rrd"
    path.write_bytes(b"as it is")
    assert not compact(path)
    assert path.read_bytes() == b"as it is"
