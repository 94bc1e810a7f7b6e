"""Same scenario, same seed, same bytes: whatever the machine does, and however the team is run."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from mavherd.transport.tlog import read_tlog

# Six robots that arm, take off and begin to cross in gusts. It needs longer than that: exit code 4.
FLIGHT = ("crossing-targets", "--seed", 11, "--set", "disturbance=held", "--set", "duration=5")
TIMED_OUT = 4
CORES = sorted(os.sched_getaffinity(0))
PYTHONS = os.environ.get("MAVHERD_PYTHONS", "").split()
"""Other interpreters in which this mavherd can be imported, for the proof across Pythons."""


@pytest.fixture(scope="module")
def fly(make_sandbox):
    """Run the flight in some other way, in a folder of its own."""
    flown = 0

    def run(*options, prefix=()):
        nonlocal flown
        flown += 1
        sandbox = make_sandbox(f"flight{flown}")
        done = sandbox.finish(sandbox.start("run", *FLIGHT, "--no-record", *options, prefix=prefix))
        assert done.code == TIMED_OUT, done.err
        return done.folder

    return run


@pytest.fixture(scope="module")
def straight(fly):
    """The flight as everybody runs it, to compare others with."""
    folder = fly()
    logs = sorted(folder.glob("vehicles/*/*.tlog"))
    names = [log.stem for log in logs]
    assert names == ["quad1", "quad2", "quad3", "rover1", "rover2", "rover3"]
    assert all(len(list(read_tlog(log))) > 200 for log in logs)
    return folder


def difference(a, b):
    """Return what `mavherd diff` says of two run folders, "" when it calls them equal."""
    command = [sys.executable, "-m", "mavherd", "diff", str(a), str(b)]
    told = subprocess.run(command, capture_output=True, text=True, check=False)
    assert told.returncode in (0, 1), told.stderr
    return told.stdout if told.returncode else ""


def assert_same_bytes(run, straight):
    """Fail with the first message that differs."""
    assert difference(straight, run) == ""
    digests = [json.loads((run / "report.json").read_text())["digest"] for run in (run, straight)]
    assert digests[0] == digests[1]
    assert len(digests[0]) == 64


@contextmanager
def busy_cores() -> Iterator[None]:
    """Have more to do on every core than it can."""
    loops = [
        subprocess.Popen([sys.executable, "-c", "while True: pass"], start_new_session=True)
        for _ in range(2 * len(CORES))
    ]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()


@pytest.mark.parametrize("repeat", [1, 2])
def test_repeats_are_equal(fly, straight, repeat):
    """Each process draws another order for sets of strings, too: PYTHONHASHSEED is not given."""
    assert_same_bytes(fly(), straight)


def test_a_loaded_machine_changes_nothing(fly, straight):
    with busy_cores():
        run = fly()
    assert_same_bytes(run, straight)


def test_one_core_is_as_good_as_many(fly, straight):
    stay = f"os.sched_setaffinity(0, [{CORES[0]}])"
    prefix = sys.executable, "-c", f"import os, sys; {stay}; os.execv(sys.argv[1], sys.argv[1:])"
    assert_same_bytes(fly(prefix=prefix), straight)


def test_pace_changes_nothing(fly, straight):
    run = fly("--speed", 3)
    assert json.loads((run / "report.json").read_text())["wall_s"] > 1.6
    assert_same_bytes(run, straight)


def test_a_coordinator_for_each_robot_changes_nothing(fly, straight):
    """All but the key that says so."""
    assert_same_bytes(fly("--set", "team.coordinators=per-robot"), straight)


@pytest.mark.parametrize("coordinators", ["central", "per-robot"])
def test_one_process_is_as_good_as_many(fly, straight, coordinators):
    run = fly("--in-process", "--set", f"team.coordinators={coordinators}")
    assert_same_bytes(run, straight)


@pytest.mark.parametrize("python", PYTHONS)
def test_other_pythons_fly_the_same_bytes(straight, python, tmp_path):
    command = [python, "-m", "mavherd", "run", *map(str, FLIGHT), "--no-record"]
    ports = [word for option in ("--gcs-udp", "--api-udp", "--tcp") for word in (option, "0")]
    done = subprocess.run([*command, *ports], cwd=tmp_path, capture_output=True, check=False)
    assert done.returncode == TIMED_OUT, done.stderr
    (folder,) = tmp_path.glob("runs/*")
    assert_same_bytes(folder, straight)


def test_where_runs_part_is_named(fly, straight):
    """A heavier quadcopter leaves the ground later: that is the first thing that anybody sees."""
    run = fly("--set", "robots.quad2.params.mass=1.5")
    told = difference(straight, run).splitlines()
    assert "  robots.quad2.params.mass: - | 1.5" in told
    first = next(line for line in told if " at " in line)
    assert first.startswith("quad2 at 0.")
    assert " (vehicle to ground): " in first
    assert "then part:" in told


def test_a_run_of_another_place_is_no_run(straight):
    command = [sys.executable, "-m", "mavherd", "diff", str(straight), str(Path(__file__))]
    told = subprocess.run(command, capture_output=True, text=True, check=False)
    assert told.returncode == 2
    assert told.stderr.startswith("mavherd: ")
