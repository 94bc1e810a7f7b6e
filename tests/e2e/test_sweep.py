"""`mavherd sweep` in processes of its own: killed, interrupted, resumed, and never twice."""

import json
import os
import shlex
import signal
from pathlib import Path
from shutil import rmtree

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

DASH = """
name: dash
robots:
  - {name: r1, kind: rover, start: {east: 0, north: 0}, goto: {east: 1, north: 0}, dwell_s: 0}
  - {name: r2, kind: rover, start: {east: 0, north: 3}, goto: {east: 1, north: 3}, dwell_s: 0}
expect: {collisions: 0}
"""


@pytest.fixture
def dash(sandbox):
    """Return the file of a scenario whose runs take no time."""
    (sandbox.folder / "dash.yaml").write_text(DASH)
    return "dash.yaml"


@pytest.fixture
def sweep(sandbox, dash):
    """Start a sweep of the short scenario into `out`."""

    def start(*options):
        return sandbox.start("sweep", dash, "--out", "out", "--jobs", 2, *options)

    return start


def rows_so_far(sandbox):
    """Return the runs whose rows are on disk, as another reader sees them."""
    path = sandbox.folder / "out" / "results.arrows"
    if not path.exists():
        return []
    found = []
    try:
        with path.open("rb") as file:
            for batch in pa.ipc.open_stream(file):
                found += batch.to_pylist()
    except (pa.ArrowException, OSError):
        pass  # it is being written
    return found


def wait_for_rows(sandbox, process, count):
    def there():
        assert process.poll() is None, process.communicate()
        rows = rows_so_far(sandbox)
        return rows if len(rows) >= count else None

    return sandbox.wait_for(there, f"{count} rows")


def stopped(process):
    """Stop a process that nobody has waited for; return whether it was still there."""
    os.kill(process.pid, signal.SIGSTOP)  # Popen would wait for one that has ended
    became = os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WEXITED | os.WNOWAIT)
    return became.si_code == os.CLD_STOPPED


@pytest.fixture
def halfway(sandbox, sweep):
    """Start a sweep and stop it within its first half; return its process and how many runs it has.

    How quick runs are depends on the machine: where they are over too soon, more are begun.
    """

    def caught(rows, *options, seeds=50):
        process = sweep("--seeds", f"0:{seeds}", *options)
        sandbox.wait_for(
            lambda: process.poll() is not None or len(rows_so_far(sandbox)) >= rows, f"{rows} rows"
        )
        if process.poll() is None and stopped(process):
            if len(rows_so_far(sandbox)) < seeds / 2:
                return process, seeds
            process.send_signal(signal.SIGCONT)
        assert sandbox.finish(process).code == 0
        rmtree(sandbox.folder / "out")
        return caught(rows, *options, seeds=4 * seeds)

    return caught


def table(sandbox):
    return pq.read_table(sandbox.folder / "out" / "results.parquet").to_pylist()


def without_wall_clock(rows):
    return [{key: value for key, value in row.items() if key != "wall_s"} for row in rows]


@pytest.fixture
def whole(sandbox, dash):
    """Return the rows of the sweep that nobody disturbs."""

    def run(*options):
        done = sandbox.run("sweep", dash, "--out", "whole", "--jobs", 2, *options)
        assert done.code == 0, done.err
        return pq.read_table(sandbox.folder / "whole" / "results.parquet").to_pylist()

    return run


def test_a_sweep_that_is_killed_goes_on_without_losing_or_repeating_a_run(sandbox, halfway, whole):
    killed, seeds = halfway(5)
    killed.kill()
    killed.wait()
    sandbox.wait_for(lambda: not sandbox.processes(), "the end of the workers")
    assert killed.returncode == -signal.SIGKILL
    kept = rows_so_far(sandbox)

    done = sandbox.run("sweep", "--resume", "out", "--jobs", 2)
    assert done.code == 0, done.err
    assert f"{len(kept)} of {seeds} runs are done already" in done.err
    rows = table(sandbox)
    by_run = {row["run"]: row for row in rows}
    assert [by_run[row["run"]] for row in kept] == kept  # wall_s too: nobody did them again
    assert without_wall_clock(rows) == without_wall_clock(whole("--seeds", f"0:{seeds}"))


def test_a_worker_that_is_killed_is_replaced_and_its_run_done_again(sandbox, halfway):
    process, seeds = halfway(2)
    worker = next(pid for pid in sandbox.processes() if pid != process.pid)
    os.kill(worker, signal.SIGKILL)
    process.send_signal(signal.SIGCONT)
    done = sandbox.finish(process)
    assert done.code == 0, done.err
    assert f"worker {worker} was killed by signal 9" in done.err
    assert [row["seed"] for row in table(sandbox)] == list(range(seeds))


@pytest.mark.parametrize(
    "how", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP], ids=lambda s: s.name
)
def test_an_interrupted_sweep_says_how_to_go_on(sandbox, halfway, how):
    process, seeds = halfway(2)
    process.send_signal(how)
    process.send_signal(signal.SIGCONT)
    done = sandbox.finish(process)
    assert done.code == 130
    count = len(rows_so_far(sandbox))
    how_on = "mavherd sweep --resume out"
    assert done.complaint.endswith(f"{count} of {seeds} runs are done (go on with: {how_on})")
    assert not (sandbox.folder / "out" / "results.parquet").exists()
    assert sandbox.run(*shlex.split(how_on)[1:]).code == 0
    assert len(table(sandbox)) == seeds


@pytest.mark.parametrize("mode", [(), ("--processes",)], ids=["in-process", "processes"])
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
def test_what_interrupts_everybody_is_nobodys_death_and_nothing_is_lost(sandbox, dash, how, mode):
    """The terminal sends SIGINT to the whole process group, to workers and vehicles too."""
    options = "--seeds", "0:9999", "--out", "out", "--jobs", 2, *mode
    process = sandbox.start("sweep", dash, *options, start_new_session=True)
    wait_for_rows(sandbox, process, 1)
    os.killpg(process.pid, how)
    done = sandbox.finish(process)
    assert done.code == 130
    assert "worker" not in done.err
    assert "done again" not in done.err
    assert all(row["exit_code"] == 0 for row in rows_so_far(sandbox))
    assert not (sandbox.folder / "out" / "underway").exists()


def test_vehicles_do_not_outlive_a_sweep_that_is_killed(sandbox, halfway):
    process, seeds = halfway(1, "--processes", seeds=6)
    process.kill()
    sandbox.wait_for(lambda: not sandbox.processes(), "the end of workers and vehicles")
    assert sandbox.run("sweep", "--resume", "out").code == 0
    assert [row["exit_code"] for row in table(sandbox)] == [0] * seeds
    assert not (sandbox.folder / "out" / "underway").exists()


def test_two_cannot_write_one_sweep(sandbox, sweep):
    process = sweep("--seeds", "0:9999")
    wait_for_rows(sandbox, process, 1)
    theirs = sandbox.folder / "out" / "underway"
    theirs.mkdir()
    second = sandbox.start("sweep", "--resume", "out")
    _, said = second.communicate(timeout=60)
    assert second.returncode == 2
    assert "another process writes this sweep" in said
    assert theirs.exists()
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    assert sandbox.finish(process).code == 130


def test_through_processes_the_rows_are_the_same(sandbox, dash, whole):
    options = "--seeds", "0,7", "--set", "team.law=safe,off"
    inside = whole(*options)
    done = sandbox.run("sweep", dash, "--out", "apart", "--jobs", 2, "--processes", *options)
    assert done.code == 0, done.err
    assert sorted(path.name for path in (sandbox.folder / "apart").iterdir()) == [
        "figures",
        "results.parquet",
        "scenario.yaml",
        "summary.json",
        "sweep.json",
    ]
    through = pq.read_table(sandbox.folder / "apart" / "results.parquet").to_pylist()
    assert without_wall_clock(through) == without_wall_clock(inside)


def test_only_the_summary_is_on_stdout_and_its_commands_repeat_runs(sandbox, dash):
    apart = "expect.min_separation_m=30"
    done = sandbox.run("sweep", dash, "--seeds", "1,2", "--set", apart, "--json", "--jobs", 2)
    assert done.code == 0
    looks = json.loads(done.out)["worst"]
    assert len(looks) == 2
    again = sandbox.run(*shlex.split(looks[0]["command"])[1:], "--no-record")
    assert again.code == 1
    assert again.report["digest"] == looks[0]["digest"]


def test_a_full_disk_is_told_and_nothing_written_is_lost(sandbox, dash):
    """A limit on the size of files stands for the disk."""
    import resource

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    options = "--seeds", "0:60", "--out", "out", "--jobs", 2
    done = sandbox.finish(sandbox.start("sweep", dash, *options, preexec_fn=limit))
    assert done.code == 2
    assert "File too large: the results cannot be written" in done.complaint
    assert "mavherd sweep --resume out" in done.complaint
    kept = rows_so_far(sandbox)
    assert kept
    again = sandbox.run("sweep", "--resume", "out", "--jobs", 2)
    assert again.code == 0, again.err
    assert Path(sandbox.folder / "out" / "results.parquet").exists()
    assert len(table(sandbox)) == 60
