"""A stream goes to a file, to viewers, or to both; the file ends before the viewers leave."""

import socket
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("rerun")

import rerun as rr

from mavherd.gcs.recording.stream import RecordingError, Stream
from mavherd.transport.errors import MavherdError

TIME = np.arange(5) / 10


def record(stream):
    stream.name("a run")
    stream.static("plots/a", rr.SeriesLines(names="a"))
    stream.columns("plots/a", TIME, rr.Scalars.columns(scalars=TIME))
    stream.columns("plots/a", TIME[:0], rr.Scalars.columns(scalars=TIME[:0]))
    stream.log("events", 0.25, rr.TextLog("now"))


def test_a_stream_must_go_somewhere():
    with pytest.raises(ValueError, match="file, serve or both"):
        Stream("nowhere")


def test_what_is_recorded_is_read_back_over_sim_time_alone(tmp_path, strict, read_back):
    stream = Stream("one", file=tmp_path / "run.rrd", start=1_700_000_000.0)
    record(stream)
    stream.close()
    seen = read_back(tmp_path / "run.rrd")
    assert [t for t, _ in seen["/plots/a"]["Scalars:scalars"]] == pytest.approx(TIME)
    assert seen["/events"]["TextLog:text"] == [(0.25, ["now"])]
    assert seen["/plots/a"]["SeriesLines:names"] == [(None, ["a"])]
    properties = {c: v[0][1] for e in seen.values() for c, v in e.items() if "RecordingInfo" in c}
    assert ["a run"] in properties.values()
    from rerun.chunk import RrdReader

    names = {n for chunk in RrdReader(tmp_path / "run.rrd").stream() for n in chunk.timeline_names}
    assert names == {"sim_time"}


def test_the_file_is_complete_while_viewers_are_served_on(tmp_path, strict, read_back, hold_port):
    stream = Stream("both", file=tmp_path / "run.rrd", serve=hold_port())
    record(stream)
    stream.end_file()
    from rerun.chunk import RrdReader

    assert RrdReader(tmp_path / "run.rrd").store().summary()  # which only a complete file has
    while not stream.answers():  # its server comes up in its own time
        pass
    stream.log("events", 1.0, rr.TextLog("later"))  # for viewers only
    stream.close()
    assert len(read_back(tmp_path / "run.rrd")["/events"]["TextLog:text"]) == 1


def test_a_port_that_somebody_has_is_told_and_the_file_gets_everything(tmp_path, strict, read_back):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        stream = Stream("file", file=tmp_path / "run.rrd", serve=port)
        with pytest.raises(RecordingError, match=f"^port {port} cannot be served$"):
            stream.answers()  # though somebody does
    record(stream)
    stream.flush_file()
    with pytest.raises(RecordingError):
        stream.flush_served()
    stream.close()
    assert len(read_back(tmp_path / "run.rrd")["/plots/a"]["Scalars:scalars"]) == len(TIME)


def test_who_answers_before_the_server_is_up_is_somebody_else(monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as other:
        stream = Stream("slow", serve=other.getsockname()[1])
        monkeypatch.setattr(Stream, "flush_served", lambda _: False)  # as on a busy machine
        assert not stream.answers()
        stream.close()


@pytest.mark.parametrize(
    ("name", "cause"),
    [
        ("nowhere/run.rrd", "No such file or directory"),
        ("full.rrd", "No space left on device"),
        ("folder", "Is a directory"),
    ],
)
def test_a_file_that_cannot_be_begun_is_one_line_with_the_cause(tmp_path, name, cause):
    (tmp_path / "full.rrd").symlink_to("/dev/full")
    (tmp_path / "folder").mkdir()
    before = sorted(tmp_path.iterdir())
    with pytest.raises(MavherdError) as caught:
        Stream("none", file=tmp_path / name)
    assert str(caught.value) == f"{tmp_path / name}: cannot be written: {cause}"
    assert caught.value.exit_code == 2
    assert sorted(tmp_path.iterdir()) == before


BEYOND = """
import resource
import sys
from pathlib import Path
import numpy as np
import rerun as rr
from mavherd.gcs.recording.stream import RecordingError, Stream

stream = Stream("short", file=Path(sys.argv[1]))
resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, 10_000))
times = np.arange(10_000) / 100
stream.columns("plots/a", times, rr.Scalars.columns(scalars=np.sin(times)))
for end in (stream.flush_file, stream.close):
    try:
        end()
    except RecordingError as error:
        print(error)
"""


def test_a_file_that_takes_no_more_is_told_of_once(tmp_path):
    file = tmp_path / "run.rrd"
    command = [sys.executable, "-c", BEYOND, file]  # the limit is a whole process's
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == f"{file}: cannot be written any more\n"
