"""Who records is killed, frozen or left alone: the run goes on, and what was recorded is kept."""

import json
import os
import signal
import warnings
from contextlib import suppress

import pytest

pytest.importorskip("rerun")

from mavherd.gcs.recording.replay import Recording, mend
from mavherd.gcs.report.truth import TruthError, read_truth
from mavherd.transport.tlog import read_tlog
from mavherd.vehicles.config import SIMULATED_EPOCH_US

FAR = 10  # m
MOMENT_S = 3.0  # at which time stands still until the recorder has come so far
BEHIND_S = 1.0  # of what may be lost


def recorded_until(part):
    """Return the last moment that a recording shows of rover1, -1 when there is none."""
    from rerun.chunk import RrdReader

    last = -1.0
    with warnings.catch_warnings(), suppress(RuntimeError, ValueError):
        warnings.simplefilter("ignore")  # it has no end
        for chunk in RrdReader(part).stream():
            if "rover1" in chunk.entity_path and "sim_time" in chunk.timeline_names:
                times = chunk.to_record_batch()["sim_time"]
                last = max(last, *(t.value * 1e-9 for t in times))
    return last


def true_until(log):
    with suppress(TruthError):  # no header yet
        track = read_truth(log)
        return track.time[-1] if len(track) else -1.0
    return -1.0


def start(sandbox, far=FAR, **scenario):
    """Start a run; return its process and folder when time stands still and has been recorded."""
    process = sandbox.start("run", sandbox.scenario(far=far, **scenario), "--paused")
    (ports,) = sandbox.wait_for(lambda: list(sandbox.folder.glob("runs/*/ports.json")), "ports")
    folder = ports.parent
    sandbox.wait_for(lambda: sandbox.clock("status"), "the clock")
    assert sandbox.clock("step", 60)
    assert true_until(folder / "vehicles/rover1/truth.bin.part") == pytest.approx(MOMENT_S)
    part = folder / "run.rrd.part"
    wanted = MOMENT_S - BEHIND_S
    sandbox.wait_for(lambda: part.exists() and recorded_until(part) > wanted, "a recording")
    return process, folder


def test_a_recorder_that_is_killed_is_told_of_at_once_and_changes_nothing(sandbox):
    process, folder = start(sandbox)
    os.kill(sandbox.part("recorder"), signal.SIGKILL)
    log = folder / "events.jsonl"
    sandbox.wait_for(lambda: '"problem"' in log.read_text(), "word of it")
    assert sandbox.clock("resume")
    done = sandbox.finish(process)
    report = done.report
    assert (done.code, report["passed"], report["partial"]) == (0, True, True)
    text = "the recorder was killed by SIGKILL: run.rrd.part holds what came before"
    assert report["missing"] == [text]
    assert text in done.err
    events = [json.loads(line) for line in log.read_text().splitlines()]
    (told,) = (event for event in events if event["kind"] == "problem")
    assert (told["text"], told["vehicle"]) == (text, None)
    assert told["t"] == pytest.approx(MOMENT_S)
    assert told["t"] < report["duration_s"]
    mended = folder / "mended.rrd"
    mend(Recording(folder / "run.rrd.part", folder), mended)
    assert MOMENT_S - BEHIND_S < recorded_until(mended) <= MOMENT_S + 1e-6
    assert not (folder / "run.rrd").exists()
    quiet = sandbox.run("run", sandbox.scenario(far=FAR), "--no-record")
    assert report["digest"] == quiet.report["digest"]


def test_a_frozen_recorder_holds_up_nobody_and_goes_on_when_it_thaws(sandbox):
    process, folder = start(sandbox)
    recorder = sandbox.part("recorder")
    os.kill(recorder, signal.SIGSTOP)
    assert sandbox.clock("resume")
    log = folder / "events.jsonl"
    sandbox.wait_for(lambda: '"done"' in log.read_text(), "the end of the vehicles")
    os.kill(recorder, signal.SIGCONT)
    done = sandbox.finish(process)
    assert (done.code, done.report["passed"], done.report["missing"]) == (0, True, [])
    last = recorded_until(done.folder / "run.rrd")
    assert last == pytest.approx(done.report["duration_s"], abs=0.1)


def test_who_does_not_wait_for_a_frozen_recorder_at_the_end_is_told_what_is_missing(sandbox):
    process, folder = start(sandbox)
    os.kill(sandbox.part("recorder"), signal.SIGSTOP)
    assert sandbox.clock("resume")
    logs = [folder / f"vehicles/{name}/truth.bin" for name in ("rover1", "quad1")]
    sandbox.wait_for(lambda: all(log.exists() for log in logs), "the end of the vehicles")
    process.send_signal(signal.SIGINT)
    done = sandbox.finish(process)
    text = "the recorder was cut short by the interrupt: run.rrd.part holds what came before"
    assert done.report["missing"] == [text]


def test_when_all_is_killed_at_once_logs_and_recording_hold_all_but_the_last_second(sandbox):
    process, folder = start(sandbox, far=10_000, duration=3600)  # it has not arrived by then
    logs = {name: folder / f"vehicles/{name}/truth.bin.part" for name in ("rover1", "quad1")}
    part = folder / "run.rrd.part"

    def kept_up():
        now = true_until(logs["rover1"])
        return now if now > MOMENT_S and recorded_until(part) >= now - BEHIND_S else None

    assert sandbox.clock("speed", 1)
    assert sandbox.clock("resume")
    seen = sandbox.wait_for(kept_up, "a recording of what is going on")
    for signum in (signal.SIGSTOP, signal.SIGKILL):  # so that nobody sees another's end
        for pid in sandbox.processes():
            os.kill(pid, signum)
    sandbox.wait_for(lambda: not sandbox.processes(), "the end of all")
    sandbox.finish(process)
    now = true_until(logs["rover1"])
    for name, log in logs.items():
        assert true_until(log) >= now - BEHIND_S
        stamps = [us for us, _ in read_tlog(log.with_name(f"{name}.tlog.part"))]
        assert (stamps[-1] - SIMULATED_EPOCH_US) * 1e-6 >= now - BEHIND_S
    mended = folder / "mended.rrd"  # who is killed while he writes leaves half a word
    mend(Recording(part, folder), mended)
    assert recorded_until(mended) >= seen - BEHIND_S
    assert not (folder / "report.json").exists()
