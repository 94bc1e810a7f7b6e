"""Mistakes at `mavherd record` and `mavherd convert` are one clear line, before anything starts."""

import os
import socket
import sys
from math import inf

import pytest

from mavherd.gcs import patience
from mavherd.gcs.cli import main
from mavherd.gcs.commands.record import Teller
from mavherd.gcs.recording.outside.lines import listen_address
from mavherd.transport.errors import LinkError
from mavherd.transport.mavlink import Codec, mav


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(patience, "WAIT_S", inf)  # however long it takes, that is not told
    (tmp_path / "is.rrd").write_bytes(b"kept")
    (tmp_path / "log.tlog").write_bytes(b"no log")
    (tmp_path / "some.bin").write_bytes(b"\xa3\x95" + bytes(99))
    return tmp_path


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["record"], "where is the vehicle?"),
        (["record", "--listen", "tcp:127.0.0.1:5760"], "use --connect tcp:127.0.0.1:5760"),
        (["record", "--listen", "udp:70000"], "is no port"),
        (["record", "--connect", "udp:14550"], "did you mean 'udpin:14550'"),
        (["record", "--listen", "udp:14550", "-o", "nowhere/seen.rrd"], "there is no folder"),
        (["record", "--listen", "udp:14550", "-o", "is.rrd"], "exists already (--force"),
        (["record", "--listen", "udp:14550", "-o", "."], "this is a folder"),
        (["record", "--listen", "14550", "-o", "x", "--tlog", "./x"], "the recording, too"),
        (["record", "--listen", "14550", "-o", "x.part", "--tlog", "x"], "the recording, too"),
        (["convert", "none.tlog"], "no such file"),
        (["convert", "log.tlog"], "this is no tlog"),
        (["convert", "some.bin"], "dataflash"),
        (["convert", "log.tlog", "-o", "is.rrd"], "exists already (--force"),
        (["convert", "log.tlog", "-o", "log.tlog"], "this is the input"),
        (["convert", "."], "not the folder of a run"),
        (["convert", ".", "log.tlog"], "converted alone"),
    ],
)
def test_mistakes_are_one_clear_line(folder, capsys, args, words):
    assert main(args) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("mavherd: ")
    assert words in line
    assert (folder / "is.rrd").read_bytes() == b"kept"
    assert not list(folder.glob("*.part"))


@pytest.fixture
def here():
    """A place to listen on a loopback address of our own: nobody else binds it or sends there."""
    pid = os.getpid()
    host = f"127.{1 + (pid >> 16)}.{pid >> 8 & 255}.{pid & 255}"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind((host, 0))
        return f"{host}:{probe.getsockname()[1]}"


@pytest.fixture
def log(folder):
    beat = Codec(1).encode([mav.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3)])
    (folder / "is.tlog").write_bytes((1_790_000_000_000_000).to_bytes(8, "big") + beat)


RECORD = ("record", "--listen", "udp:{here}", "--tlog", "new.tlog", "--duration", "0.3")
KEPT = ["is.rrd", "is.tlog", "log.tlog", "some.bin"]


@pytest.mark.parametrize("args", [RECORD, ("convert", "is.tlog", "-o", "new.rrd")])
@pytest.mark.usefixtures("log")
def test_without_rerun_it_is_said_what_to_install(folder, capsys, monkeypatch, args, here):
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert main([arg.format(here=here) for arg in args]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "pip install 'mavherd[view]'" in line
    assert sorted(path.name for path in folder.iterdir()) == KEPT


@pytest.mark.parametrize(
    "args", [(*RECORD, "-o", "/proc/no.rrd"), ("convert", "is.tlog", "-o", "/proc/no.rrd")]
)
@pytest.mark.usefixtures("log")
def test_what_cannot_be_written_is_one_clear_line(folder, capsys, args, here):
    pytest.importorskip("rerun")
    assert main([arg.format(here=here) for arg in args]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("mavherd: /proc/no.rrd.part: cannot be written: ")
    assert sorted(path.name for path in folder.iterdir()) == KEPT


@pytest.mark.usefixtures("log")
def test_a_tlog_that_cannot_be_written_is_one_clear_line(folder, capsys, here):
    pytest.importorskip("rerun")
    args = ("record", "--listen", f"udp:{here}", "-o", "new.rrd", "--tlog", "/proc/no.tlog")
    assert main(args) == 2
    assert "mavherd: /proc/no.tlog: cannot be written: " in capsys.readouterr().err
    assert sorted(path.name for path in folder.iterdir()) == KEPT


@pytest.mark.usefixtures("log")
def test_where_nobody_is_heard_nothing_is_left(folder, capsys, here):
    pytest.importorskip("rerun")
    assert main([arg.format(here=here) for arg in RECORD]) == 3
    assert "nothing is heard" in capsys.readouterr().err
    assert sorted(path.name for path in folder.iterdir()) == KEPT


def test_a_text_that_is_repeated_is_told_now_and_then(capsys):
    teller = Teller()
    text = {"vehicle": "sys1", "kind": "text", "text": "PreArm: no GPS", "severity": 2}
    for second in range(25):
        teller.tell({"t": float(second), **text})
        teller.tell({"t": float(second), **text, "text": f"Waypoint {second}"})
    told = [line for line in capsys.readouterr().err.splitlines() if "PreArm" in line]
    assert told == [
        "    0.0 s  sys1: PreArm: no GPS",
        "   10.0 s  sys1: PreArm: no GPS (and 9 times before)",
        "   20.0 s  sys1: PreArm: no GPS (and 9 times before)",
    ]


@pytest.mark.parametrize(
    ("text", "host", "port"),
    [
        ("udp:14550", "127.0.0.1", 14550),
        ("14550", "127.0.0.1", 14550),
        ("udp::14550", "127.0.0.1", 14550),
        ("udp:0.0.0.0:14550", "0.0.0.0", 14550),
        ("udpin:192.168.1.7:14551", "192.168.1.7", 14551),
        ("UDP:14550", "127.0.0.1", 14550),
    ],
)
def test_where_to_listen_may_be_written_shortly(text, host, port):
    address = listen_address(text)
    assert (address.scheme, address.host, address.port) == ("udpin", host, port)


def test_what_is_called_is_not_listened_to():
    with pytest.raises(LinkError, match="--connect serial:/dev/ttyUSB0"):
        listen_address("serial:/dev/ttyUSB0")
