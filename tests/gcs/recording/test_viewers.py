"""Viewers are started on loopback, told of when they fail, and ended when nobody needs them."""

import os
import select
import signal
import socket

import pytest

from mavherd.gcs.recording.dashboard import Dashboard
from mavherd.gcs.recording.served import prepare
from mavherd.gcs.recording.viewers import (
    OTHER_BINARY,
    Viewer,
    ViewerError,
    Viewing,
    check_display,
)


@pytest.fixture
def taken():
    """A port that somebody listens on."""
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        sock.listen()
        yield sock.getsockname()[1]


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """Have a shell script take the place of the viewer."""

    def write(text):
        script = tmp_path / "stand-in"
        script.write_text(f"#!/bin/sh\n{text}\n")
        script.chmod(0o755)
        monkeypatch.setenv(OTHER_BINARY, str(script))

    return write


def test_a_port_set_by_hand_is_had_or_refused(taken):
    with pytest.raises(ViewerError, match=rf"--view-port {taken}: the port is taken"):
        prepare(Viewing(web=True, view_port=taken))
    with pytest.raises(ViewerError, match=rf"--web-port {taken}: the port is taken"):
        prepare(Viewing(web=True, web_port=taken))
    with pytest.raises(ViewerError, match="--web-port 9999: --view-port has it"):
        prepare(Viewing(web=True, web_port=9999, view_port=9999))


def test_without_a_wish_the_ports_are_the_standard_ones_or_the_next_free():
    first = prepare(Viewing(web=True))
    assert 9876 <= first.data < 9976
    assert 9090 <= first.page < 9190
    assert first.source == f"rerun+http://127.0.0.1:{first.data}/proxy"
    assert first.url.startswith(f"http://127.0.0.1:{first.page}/?url=rerun%2Bhttp%3A%2F%2F127")
    first.release()


def test_a_port_is_held_before_anybody_listens_and_had_by_who_does():
    held = prepare(Viewing(web=True, view_port=0, web_port=0))  # the first free, others want too
    with pytest.raises(ViewerError, match=rf"--view-port {held.data}: the port is taken"):
        prepare(Viewing(web=True, view_port=held.data))
    others = prepare(Viewing(web=True))
    assert len({held.data, held.page, others.data, others.page}) == 4
    others.release()
    with socket.create_server(("127.0.0.1", held.data)):
        pass
    held.release()
    again = prepare(Viewing(view_port=held.data))
    assert again.data == held.data
    again.release()


def test_port_0_is_any_but_a_standard_one():
    ports = prepare(Viewing(web=True, view_port=0, web_port=0))
    assert not {ports.data, ports.page} & {*range(9876, 9976), *range(9090, 9190)}
    ports.release()


@pytest.mark.parametrize("name", ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"])
def test_a_window_needs_a_display(name):
    check_display({name: ":0"})
    with pytest.raises(ViewerError, match=r"there is no display .*--web"):
        check_display({name: "", "HOME": "/"})


def test_another_viewer_that_is_not_there_is_named(monkeypatch):
    monkeypatch.setenv(OTHER_BINARY, "/nowhere/rerun")
    with pytest.raises(ViewerError, match="MAVHERD_RERUN=/nowhere/rerun: there is no such program"):
        prepare(Viewing(web=True))


@pytest.mark.parametrize("leash", [True, False])
def test_a_viewer_that_fails_is_told_once_with_its_best_words(stand_in, tmp_path, leash):
    stand_in("echo starting\necho 'Error: \x1b[31mno adapter\x1b[0m found'\necho 'bye'\nexit 4")
    log = tmp_path / "log.txt"
    log.write_text("Error: of another time\n")
    viewer = Viewer("viewer", ["--headless"], log, leash=leash)
    viewer.wait()
    assert viewer.death() == "the viewer ended with exit code 4: no adapter found"
    assert viewer.death() == ""
    viewer.end()


@pytest.mark.parametrize("leash", [True, False])
def test_a_viewer_that_the_user_closes_is_no_matter(stand_in, tmp_path, leash):
    stand_in("exit 0")
    viewer = Viewer("viewer", [], tmp_path / "log.txt", leash=leash)
    viewer.wait()
    assert viewer.ended
    assert viewer.death() == ""
    viewer.end()


def test_a_viewer_on_a_leash_ends_with_us_even_if_it_is_frozen(stand_in, tmp_path):
    stand_in(f"echo $$ > {tmp_path}/pid.part; mv {tmp_path}/pid.part {tmp_path}/pid; exec sleep 60")
    viewer = Viewer("viewer", [], tmp_path / "log.txt", leash=True)
    while not (tmp_path / "pid").exists():
        assert not viewer.ended
    pid = int((tmp_path / "pid").read_text())
    process = os.pidfd_open(pid)  # readable when it has ended, whoever collects it
    os.kill(pid, signal.SIGSTOP)
    viewer.end()
    assert viewer.death() == "", "it was we who ended it"
    assert select.select([process], [], [], 60)[0]
    os.close(process)


def test_a_window_stays_where_it_shall_and_the_page_goes(stand_in, tmp_path, monkeypatch):
    monkeypatch.setenv("DISPLAY", ":0")
    stand_in("exec sleep 60")
    dashboard = Dashboard(Viewing(native=True, web=True), stays=True)
    (told,) = dashboard.open(tmp_path / "log.txt")
    assert told == f"to see it in a browser: {dashboard.ports.url}"
    assert dashboard.page == dashboard.ports.url
    assert dashboard.open(tmp_path / "log.txt") == [], "once is enough"
    window = dashboard.window
    dashboard.close()
    assert dashboard.page == ""
    os.kill(window.process.pid, signal.SIGTERM)  # it is still there
    os.waitpid(window.process.pid, 0)
