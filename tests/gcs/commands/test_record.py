"""Mistakes at `mavherd record` and `mavherd convert` are one clear line, before anything starts."""

import socket
import sys

import pytest

from mavherd.gcs.cli import main
from mavherd.gcs.recording.outside.lines import listen_address
from mavherd.transport.errors import LinkError
from mavherd.transport.mavlink import Codec, mav


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
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


@pytest.mark.parametrize(
    "args", [["record", "--listen", "udp:{port}"], ["convert", "is.tlog", "-o", "new.rrd"]]
)
def test_without_rerun_it_is_said_what_to_install(folder, capsys, monkeypatch, args):
    monkeypatch.setitem(sys.modules, "rerun", None)
    beat = Codec(1).encode([mav.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3)])
    (folder / "is.tlog").write_bytes((1_790_000_000_000_000).to_bytes(8, "big") + beat)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    assert main([arg.format(port=port) for arg in args]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "pip install 'mavherd[view]'" in line
    assert sorted(path.name for path in folder.glob("is.*")) == ["is.rrd", "is.tlog"]


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
