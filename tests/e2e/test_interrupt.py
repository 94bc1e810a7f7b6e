"""Ctrl-C at any time: all processes end soon, a report is written, exit code 130."""

import os
import pty
import select
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from xml.etree import ElementTree

import pytest

from mavherd.vehicles.grants import LIVENESS_S

# From the signal to the end of every process but the launcher: 2 s on a machine that has nothing
# else to do, and nobody waits for the frozen as long as in mid-run.
PATIENCE = 0.8 * LIVENESS_S


def interrupt(sandbox, process, how=signal.SIGINT, times=1):
    """Send the signal and return what is left when all is over."""
    for _ in range(times):
        process.send_signal(how)
    sandbox.wait_for(lambda: sandbox.processes().keys() <= {process.pid}, "the end", PATIENCE)
    done = sandbox.finish(process)
    assert done.code == 130
    assert done.complaint == "mavherd: interrupted"
    return done


def long_run(sandbox, *options):
    """Start a run that nobody waits for the end of."""
    return sandbox.start("run", sandbox.scenario(far=2000, duration=3600), *options)


@pytest.mark.parametrize("pace", ["--lockstep", "--speed=1", "--free-run"])
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_during_the_run(sandbox, pace, how):
    process = long_run(sandbox, pace, "--no-record", "--junit", "junit.xml")
    folder = sandbox.wait_for_run()
    done = interrupt(sandbox, process, how)
    (error,) = ElementTree.parse(sandbox.folder / "junit.xml").iter("error")
    assert (error.get("type"), error.text) == ("exit code 130", "interrupted")
    report = done.report
    assert (report["exit_code"], report["error"]) == (130, "interrupted")
    assert not report["passed"]
    assert not report["partial"]
    assert report["duration_s"] > 0
    assert (report["digest"] is None) == (pace == "--free-run")
    assert (folder / "report.html").exists()
    assert not list(folder.rglob("*.part"))


def test_twice_is_no_different(sandbox):
    process = long_run(sandbox)
    part = sandbox.wait_for_run() / "run.rrd.part"
    sandbox.wait_for(lambda: part.exists() and part.stat().st_size > 400_000, "a recording")
    done = interrupt(sandbox, process, times=2)
    assert done.report["exit_code"] == 130
    assert not done.report["partial"]
    assert (done.folder / "run.rrd").exists()


@pytest.mark.parametrize("file", ["scenario.yaml", "events.jsonl", "launcher.txt", "ports.json"])
def test_while_it_starts(sandbox, file):
    process = long_run(sandbox)
    sandbox.wait_for(lambda: list(sandbox.folder.glob(f"runs/*/{file}")), file)
    done = interrupt(sandbox, process)
    assert done.report["exit_code"] == 130


def test_before_there_is_anything_to_report(sandbox):
    process = long_run(sandbox)
    mapped = Path(f"/proc/{process.pid}/maps")
    sandbox.wait_for(lambda: "/_json." in mapped.read_text(), "the command line is imported")
    done = interrupt(sandbox, process)
    assert done.folder is None or done.report["exit_code"] == 130


IN_A_TEXT = """
import sys
from mavherd.gcs import cli

cli._parser = lambda: exec("import os, signal; os.kill(os.getpid(), signal.SIGINT)")
sys.exit(cli.main([]))
"""


def test_while_python_runs_a_text():  # as it does for every dataclass it imports
    done = subprocess.run([sys.executable, "-c", IN_A_TEXT], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (130, "mavherd: interrupted\n")


DROPPED = """
import os, signal, sys
from mavherd.__main__ import main
from mavherd.scenarios import loader

load = loader.load_scenario


def drop_it(*args):
    try:
        os.kill(os.getpid(), signal.SIGINT)
    except KeyboardInterrupt:
        pass
    return load(*args)


loader.load_scenario = drop_it
sys.exit(main())
"""


def test_where_python_drops_the_exception(sandbox):  # as it does in callbacks during imports
    scenario, out = sandbox.scenario(far=2000, duration=3600), str(sandbox.folder / "runs")
    command = [sys.executable, "-c", DROPPED, "run", scenario, "--no-record", "--out", out]
    command += ["--gcs-udp", "0", "--api-udp", "0", "--tcp", "0"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=sandbox.folder, timeout=60)
    assert done.returncode == 130
    assert done.stderr.splitlines()[-1] == "mavherd: interrupted"


BEFORE_THE_PAGE = """
import os, signal, sys
from mavherd.__main__ import main
from mavherd.gcs.report import report

page = report.page


def interrupted_page(*args):
    os.kill(os.getpid(), signal.SIGINT)
    return page(*args)


report.page = interrupted_page
sys.argv[:] = sys.argv[3:]  # the command that this stands in for: python -m mavherd ...
sys.exit(main())
"""


def test_while_the_report_is_written(sandbox):
    stand_in = sys.executable, "-c", BEFORE_THE_PAGE
    done = sandbox.run("run", sandbox.scenario(), "--no-record", prefix=stand_in)
    assert done.code == 130
    assert done.complaint == "mavherd: interrupted"
    assert done.report["passed"]  # the run itself was over
    assert (done.folder / "report.html").exists()
    assert not list(done.folder.rglob("*.part"))


def test_at_a_terminal(sandbox):
    ours, theirs = pty.openpty()
    attach = "setsid", "--ctty", "--wait"
    process = sandbox.start(
        *("run", sandbox.scenario(far=2000, duration=3600), "--no-record"),
        prefix=attach,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
    )
    os.close(theirs)
    shown = b""

    def read():
        nonlocal shown
        with suppress(OSError):  # the other end is closed
            shown += os.read(ours, 65536) if select.select([ours], [], [], 0)[0] else b""
        return shown

    sandbox.wait_for(lambda: b"active" in read(), "the live table")
    os.write(ours, b"\x03")
    sandbox.wait_for(lambda: b"mavherd: interrupted" in read(), "the end")
    done = sandbox.finish(process)
    os.close(ours)
    assert done.code == 130
    assert shown.rfind(b"\x1b[?25h") > shown.rfind(b"\x1b[?25l")  # the cursor is back


def test_with_a_frozen_vehicle(sandbox):
    process = long_run(sandbox, "--speed=1", "--no-record")
    truth = sandbox.wait_for_run() / "vehicles/rover1/truth.bin.part"
    os.kill(sandbox.part("quad1"), signal.SIGSTOP)
    # Everybody waits for it once the others' logs, written four times a second, have stopped.
    sandbox.wait_for(lambda: time.time() - truth.stat().st_mtime > 0.6, "a stand-still")
    interrupt(sandbox, process)


@pytest.mark.parametrize("coordinators", ["central", "per-robot"])
def test_with_everybody_frozen(sandbox, coordinators):
    process = long_run(sandbox, "--speed=1", "--set", f"team.coordinators={coordinators}")
    sandbox.wait_for_run()
    for pid in sandbox.processes().keys() - {process.pid}:
        os.kill(pid, signal.SIGSTOP)
    done = interrupt(sandbox, process)
    assert done.report["partial"]
