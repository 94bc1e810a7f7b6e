"""Time is paused, stepped and hurried while a run goes on, and nothing in the run knows."""

import json
import os
import pty
import select
import signal
import termios
import threading
import time
from contextlib import contextmanager, suppress

import pytest

QUIET = ("--no-record",)


def clock(sandbox, where, *order):
    """Order something of a run's clock; return the command's end."""
    return sandbox.finish_command(sandbox.start("clock", where, *order))


@pytest.fixture
def sandbox(sandbox):
    """One that can run commands beside a run that goes on."""

    def finish_command(process):
        out, err = process.communicate(timeout=60)
        assert "Traceback" not in err
        return process.returncode, out.strip(), err.strip()

    sandbox.finish_command = finish_command
    return sandbox


def start_paused(sandbox, *options, far=2):
    process = sandbox.start("run", sandbox.scenario(far=far), "--paused", *QUIET, *options)
    folders = sandbox.wait_for(lambda: list(sandbox.folder.glob("runs/*/ports.json")), "ports")
    (ports,) = folders
    sandbox.wait_for(lambda: clock(sandbox, ports.parent, "status")[0] == 0, "the clock")
    return process, ports.parent


def test_a_run_that_was_paused_stepped_and_hurried_has_the_bytes_of_a_straight_one(
    sandbox, make_sandbox
):
    straight = make_sandbox("straight")
    plain = straight.run("run", straight.scenario(), *QUIET)
    began = time.monotonic()
    process, folder = start_paused(sandbox, "--speed", 0.5)
    assert clock(sandbox, folder, "step") == (0, "0.05 s, paused, speed 0.5", "")
    stood = time.monotonic()
    endpoint = json.loads((folder / "ports.json").read_text())["zenoh"]
    assert clock(sandbox, endpoint, "speed", "max") == (0, "0.05 s, paused, max speed", "")
    stood = time.monotonic() - stood
    assert clock(sandbox, folder, "step", 19) == (0, "1.00 s, paused, max speed", "")
    assert clock(sandbox, folder, "speed", "20") == (0, "1.00 s, paused, speed 20", "")
    code, out, _ = clock(sandbox, folder, "resume")
    assert (code, out.split(", ")[1:]) == (0, ["running", "speed 20"])
    done = sandbox.finish(process)
    assert done.code == plain.code == 0
    assert done.report["digest"] == plain.report["digest"] is not None
    for name in ("rover1", "quad1"):
        tlogs = [f / "vehicles" / name / f"{name}.tlog" for f in (folder, plain.folder)]
        assert tlogs[0].read_bytes() == tlogs[1].read_bytes()
    assert done.report["wall_s"] < time.monotonic() - began - stood  # pauses are no part of it
    assert done.report["outside_clients"] == 0
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    assert [e["text"] for e in events if e["kind"] == "clock"] == [
        *("step", "speed max", "step 19", "speed 20", "resume")
    ]


def test_who_watches_a_paused_run_hears_heartbeats_and_is_answered(sandbox):
    tcp = sandbox.free_port()
    process, folder = start_paused(sandbox, "--tcp", tcp)
    client = sandbox.connect(f"tcp:127.0.0.1:{tcp}")
    for _ in range(3):
        sandbox.greet(client)
        assert client.recv_match(type="HEARTBEAT", blocking=True, timeout=60)
    assert clock(sandbox, folder, "status")[1] == "0.00 s, paused, max speed"
    client.close()
    process.send_signal(signal.SIGINT)
    done = sandbox.finish(process)
    assert (done.code, done.complaint) == (130, "mavherd: interrupted")
    assert done.report["duration_s"] == 0
    assert done.report["outside_clients"] == 1


def test_what_the_clock_refuses_is_said_in_one_line(sandbox):
    process, folder = start_paused(sandbox)
    for order in ("jump", "step 0", "speed fast"):
        code, out, err = clock(sandbox, folder, *order.split())
        assert (code, out) == (2, "")
        assert err.startswith("mavherd: ")
        assert len(err.splitlines()) == 1
    process.terminate()
    assert sandbox.finish(process).code == 130
    nobodys = {"zenoh": f"tcp/127.0.0.1:{sandbox.free_port()}"}  # others may have its port by now
    (folder / "ports.json").write_text(json.dumps(nobodys))
    code, _, err = clock(sandbox, folder, "resume")
    assert code == 2
    assert err == f"mavherd: {folder}: its clock is gone: the run has ended"
    code, _, err = clock(sandbox, sandbox.folder / "nowhere", "resume")
    assert code == 2
    assert "is" in err
    assert "the folder of a run?" in err


def test_a_free_running_team_refuses_all(sandbox):
    process = sandbox.start("run", sandbox.scenario(far=2000), "--free-run", *QUIET)
    folder = sandbox.wait_for_run()
    code, _, err = clock(sandbox, folder, "pause")
    assert code == 2
    assert "on the wall clock" in err
    process.terminate()
    assert sandbox.finish(process).code == 130


@contextmanager
def at_terminal(sandbox, *options, far=2000):
    """A run at a terminal: the process, a way to type, what was shown, the mode before."""
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, 80))
    before = termios.tcgetattr(theirs)
    process = sandbox.start(
        *("run", sandbox.scenario(far=far, duration=3600), *QUIET, *options),
        prefix=("setsid", "--ctty", "--wait"),
        **dict.fromkeys(("stdin", "stdout", "stderr"), theirs),
    )
    shown = bytearray()
    over = threading.Event()

    def read():
        with suppress(OSError):
            while not over.is_set():
                if select.select([ours], [], [], 0.02)[0]:
                    shown.extend(os.read(ours, 65536))

    reader = threading.Thread(target=read)
    reader.start()
    try:
        yield process, ours, shown, lambda: termios.tcgetattr(theirs) == before
    finally:
        over.set()
        reader.join()
        os.close(ours)
        os.close(theirs)


def test_keys_at_a_terminal(sandbox):
    with at_terminal(sandbox, "--paused") as (process, keyboard, shown, restored):
        sandbox.wait_for(lambda: b"paused" in shown, "the live view")
        sandbox.wait_for(lambda: b"space pause/resume" in shown, "the keys")
        for key, event in (
            (b".", '"step"'),
            (b"\x1b[C", '"step"'),
            (b"-", '"slower"'),
            (b"1", '"speed 1"'),
            (b" ", '"resume"'),
            (b"m", '"speed max"'),
        ):
            os.write(keyboard, key)
            sandbox.wait_for_run(event)
        sandbox.wait_for(lambda: b"GUIDED" in shown, "the robots")
        assert not restored()
        os.write(keyboard, b"z\x1b[Aq")  # what means nothing does nothing
        sandbox.wait_for(lambda: b"mavherd: interrupted" in shown, "the end")
        assert sandbox.finish(process).code == 130
        assert restored()


@pytest.mark.parametrize(
    ("pace", "how"),
    [
        ("--paused", signal.SIGTERM),
        ("--paused", signal.SIGHUP),
        ("--speed=0.01", signal.SIGINT),
        ("--speed=1", signal.SIGTERM),
    ],
)
def test_a_signal_ends_a_run_at_a_terminal_and_leaves_that_as_it_was(sandbox, pace, how):
    with at_terminal(sandbox, pace) as (process, _, shown, restored):
        sandbox.wait_for(lambda: b"q quit" in shown, "the live view")
        sandbox.wait_for(lambda: not restored(), "the keys")
        process.send_signal(how)  # setsid has become the run
        assert sandbox.finish(process).code == 130
        assert restored()


def test_a_run_that_breaks_off_leaves_the_terminal_as_it_was(sandbox):
    with at_terminal(sandbox, "--speed=1") as (process, _, shown, restored):
        sandbox.wait_for(lambda: b"q quit" in shown and not restored(), "the live view")
        os.kill(sandbox.part("quad1"), signal.SIGKILL)
        assert sandbox.finish(process).code == 3
        assert restored()


def test_keys_are_nothing_without_a_terminal(sandbox):
    ours, theirs = os.pipe()
    os.write(theirs, b"q   q")
    process = sandbox.start("run", sandbox.scenario(), *QUIET, stdin=ours)
    os.close(ours)
    done = sandbox.finish(process)
    os.close(theirs)
    assert done.code == 0
    assert "space" not in done.err
