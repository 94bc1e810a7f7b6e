"""What a run leaves that is killed as a whole can be reported, and says that it is partial."""

import os
import re
import signal

import pytest

from mavherd.gcs.flown.flown import open_flown
from mavherd.transport.tlog import read_tlog
from mavherd.vehicles.config import SIMULATED_EPOCH_US

LOST_S = 1.0  # at most, before the kill


@pytest.fixture(scope="module")
def killed(shared_sandbox):
    """Kill every process of a run at a moment of fleet time that is known; return both."""
    sandbox = shared_sandbox
    scenario = sandbox.scenario("killed", far=1000, duration=3600)  # it goes on till then
    process = sandbox.start("run", scenario, "--speed=4", "--no-record")
    folder = sandbox.wait_for_run()
    sandbox.wait_for(lambda: len(open_flown(folder).tracks()) == 2, "truth")
    asked = sandbox.start("clock", folder, "pause").communicate(timeout=60)[0]
    now = float(re.match(r"([\d.]+) s, paused", asked)[1])
    for signum in (signal.SIGSTOP, signal.SIGKILL):  # so that nobody sees another's end
        for pid in sandbox.processes():
            os.kill(pid, signum)
    process.communicate(timeout=60)
    sandbox.wait_for(lambda: not sandbox.processes(), "the end of all")
    return folder, now


def test_its_folder_opens_and_says_what_has_no_end(killed):
    folder, _ = killed
    flown = open_flown(folder)
    assert flown.report is None
    assert flown.missing[0].startswith("report.json: none")
    assert flown.partial
    assert not flown.goes_on()


def test_truth_and_tlogs_hold_all_but_the_last_second(killed):
    folder, now = killed
    flown = open_flown(folder)
    tracks = {track.name: track for track in flown.tracks()}
    for spec in flown.starts:
        assert tracks[spec.name].time[-1] >= now - LOST_S
        *_, (last_us, _) = read_tlog(flown.tlog(spec.name))
        assert (last_us - SIMULATED_EPOCH_US) * 1e-6 >= now - LOST_S


def test_its_report_and_its_states_can_be_had(killed, shared_sandbox):
    pq = pytest.importorskip("pyarrow.parquet")
    folder, now = killed
    done = shared_sandbox.run("report", folder)
    assert done.code == 3
    assert done.complaint == "mavherd: the run was killed: it left no report"
    assert done.report["partial"]
    assert any("without its end" in text for text in done.report["missing"])
    states = pq.read_table(folder / "states.parquet")
    assert states.schema.metadata[b"partial"] == b"true"
    for name in ("rover1", "quad1"):
        mine = states["robot"].to_numpy() == name
        assert states["time_s"].to_numpy()[mine].max() >= now - LOST_S


def test_a_run_that_goes_on_is_not_reported(sandbox):
    scenario = sandbox.scenario(far=1000, duration=3600)  # it does not arrive meanwhile
    process = sandbox.start("run", scenario, "--speed=2", "--no-record")
    folder = sandbox.wait_for_run()
    refused = sandbox.start("report", folder)
    _, complaint = refused.communicate(timeout=60)
    assert refused.returncode == 2
    assert complaint.rstrip().endswith("this run still goes on (it reports when it ends)")
    process.send_signal(signal.SIGINT)
    assert sandbox.finish(process).code == 130
