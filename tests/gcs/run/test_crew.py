"""The crew: what its processes are started with, and what is left when a start breaks off."""

import os
import signal
from contextlib import suppress
from pathlib import Path

import pytest

from mavherd.gcs.run.children import converse
from mavherd.gcs.run.crew import _MORE_S, END_S, Crew
from mavherd.gcs.run.head_start import HeadStart
from mavherd.gcs.run.ports import PortPlan
from mavherd.scenarios.loader import load_scenario
from mavherd.scenarios.starts import draw_starts
from mavherd.transport.errors import VehicleError

NO_PORTS = PortPlan(gcs_udp=0, api_udp=0, tcp=0)


def test_no_socket_stays_open_when_a_start_breaks_off(tmp_path, children):
    scenario = load_scenario("crossing-targets")
    starts = draw_starts(scenario)
    files, processes = open_files(), children()
    with HeadStart(coordinator=False) as ahead:
        (nursery,) = children() - processes
        os.kill(nursery, signal.SIGKILL)
        os.waitid(os.P_PID, nursery, os.WEXITED | os.WNOWAIT)
        crew = Crew(scenario, starts, NO_PORTS, lambda: False, ahead)
        with pytest.raises(VehicleError, match="has died") as broken:
            crew.start(tmp_path, "tcp/-", lockstep=True, started=0.0, record=False)
        crew.stop(hurry=True)
    assert not open_files() - files  # what others had may have been closed meanwhile
    assert broken.tb  # in it, what the start had in hand is alive


@pytest.mark.parametrize(("given", "found"), [(None, "1"), ("2", "2")])
def test_linear_algebra_starts_no_threads_that_spin_unless_somebody_says_so(
    monkeypatch, given, found
):
    name = "OPENBLAS_NUM_THREADS"
    if given:
        monkeypatch.setenv(name, given)
    else:
        monkeypatch.delenv(name, raising=False)
    child, channel = converse("mavherd.vehicles.nursery")
    while not (words := Path(f"/proc/{child.process.pid}/environ").read_text().split("\0")[:-1]):
        assert child.process.poll() is None  # else its exec is still under way
    channel.close()
    child.end(60.0)
    assert [word for word in words if word.startswith(name)] == [f"{name}={found}"]
    assert os.environ.get(name) == given


def open_files():
    """Return what this process has open: file descriptors and what they are."""
    found = set()
    for entry in Path("/proc/self/fd").iterdir():
        with suppress(FileNotFoundError):  # the folder itself, which is read here
            found.add((entry.name, str(entry.readlink())))
    return found


def test_who_hurries_waits_less_than_the_two_seconds_that_are_promised():
    vehicles_nursery_recorder = 3 * _MORE_S
    assert END_S + vehicles_nursery_recorder < 2.0
