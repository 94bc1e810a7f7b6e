"""A sweep does every run once, in whatever pieces it is done."""

import json
import os
import pickle
import signal
from dataclasses import replace

import pyarrow.parquet as pq
import pytest

from mavherd.gcs.run.in_process import simulate
from mavherd.gcs.sweep import folder as folders
from mavherd.gcs.sweep.engine import Ended
from mavherd.gcs.sweep.pool import LocalPool
from mavherd.gcs.sweep.results import ResultStream
from mavherd.gcs.sweep.sweep import Sweep, SweepInterruptedError
from mavherd.gcs.sweep.task import SweepTask
from mavherd.transport.errors import MavherdError


class Notes:
    """A view that keeps what it is told."""

    def __init__(self):
        self.said, self.rows, self.begun_from = [], [], []

    def begun(self, done, runs):
        self.begun_from.append(done)

    def ended(self, rows):
        self.rows += rows

    def refresh(self):
        pass

    def note(self, text):
        self.said.append(text)


@pytest.fixture
def sweep(planned, dash, tmp_path):
    """Begin a sweep of the short scenario: sweep(seeds=..., law=...)."""

    def make(**options):
        plan, points = planned(**options)
        folder = tmp_path / "out"
        folders.begin(folder, plan, points, dash.read_text())
        return Sweep(folder, plan, points)

    return make


@pytest.fixture
def view():
    return Notes()


def task_of(sweep):
    return SweepTask(sweep.points, sweep.plan.mode, sweep.folder / folders.SCRATCH)


def pool_of(sweep, view, workers=2):
    return lambda: LocalPool(task_of(sweep), workers, view.note)


def after(count, view):
    """Return an interruption when so many runs have ended."""
    return lambda: len(view.rows) >= count


def never():
    return False


def table_of(sweep):
    return pq.read_table(sweep.folder / folders.TABLE)


def test_a_sweep_leaves_a_row_for_each_run_that_a_run_alone_repeats(sweep, view):
    s = sweep(seeds=(0, 1, 5), law=("off", "safe"))
    s.conduct(pool_of(s, view), view, never)
    rows = table_of(s).to_pylist()
    assert [(r["run"], r["seed"], r["team.law"]) for r in rows] == [
        (0, 0, "off"),
        (1, 0, "safe"),
        (2, 1, "off"),
        (3, 1, "safe"),
        (4, 5, "off"),
        (5, 5, "safe"),
    ]
    alone = simulate(replace(s.points[1], seed=5)).report
    assert rows[5]["digest"] == alone["digest"]
    assert rows[5]["last_arrival_s"] == max(r["arrival_s"] for r in alone["robots"])
    assert all(r["wall_s"] > 0 for r in rows)
    assert not (s.folder / folders.STREAM).exists()


def test_how_many_workers_do_it_makes_no_difference(sweep, view):
    s = sweep(seeds=tuple(range(6)))
    tables = []
    for workers in (1, 3):
        s.conduct(pool_of(s, view, workers), view, never)
        tables.append(table_of(s).drop_columns("wall_s"))
        (s.folder / folders.TABLE).unlink()
    assert tables[0].equals(tables[1])


def test_an_interrupted_sweep_goes_on_where_it_was(sweep, view):
    s = sweep(seeds=tuple(range(12)))
    with pytest.raises(SweepInterruptedError) as told:
        s.conduct(pool_of(s, view), view, after(4, view))
    done = len(view.rows)
    assert 4 <= done < 12
    assert str(told.value) == (
        f"interrupted: {done} of 12 runs are done (go on with: mavherd sweep --resume {s.folder})"
    )
    s.conduct(pool_of(s, view), view, never)
    assert view.begun_from == [0, done]
    assert sorted(row["run"] for row in view.rows) == list(range(12))  # none lost, none twice
    assert table_of(s)["run"].to_pylist() == list(range(12))


def test_what_fails_while_everybody_is_told_to_end_is_done_again(sweep, view):
    """A signal to the whole group may end a run's vehicles before the run has noticed its own."""
    came = []

    class Group:
        slots = 2

        def __init__(self):
            self.jobs = []

        def submit(self, job):
            self.jobs.append(job)

        def take(self, timeout):
            jobs, self.jobs = self.jobs, []
            if jobs:
                came.append(signal.SIGTERM)
            codes = {0: 1, 1: 3}
            return [Ended(job, {"exit_code": codes[job.number]}) for job in jobs]

        def stop(self):
            pass

    s = sweep(seeds=(0, 1))
    with pytest.raises(SweepInterruptedError, match="1 of 2 runs are done"):
        s.conduct(Group, view, lambda: bool(came))
    assert [(row["run"], row["exit_code"]) for row in view.rows] == [(0, 1)]


def test_an_interruption_after_the_last_row_is_one(sweep, view):
    s = sweep(seeds=(0, 1))
    with pytest.raises(SweepInterruptedError, match="2 of 2 runs are done"):
        s.conduct(pool_of(s, view), view, after(2, view))
    s.conduct(None, view, never)
    assert table_of(s)["run"].to_pylist() == [0, 1]


def test_a_torn_last_row_is_told_and_done_again(sweep, view):
    s = sweep(seeds=tuple(range(6)))
    with pytest.raises(SweepInterruptedError):
        s.conduct(pool_of(s, view, workers=1), view, after(3, view))
    done = len(view.rows)  # 3, or 4: one more may have ended meanwhile
    stream = s.folder / folders.STREAM
    os.truncate(stream, stream.stat().st_size - 7)
    s.conduct(pool_of(s, view), view, never)
    (said,) = view.said
    assert said.endswith("bytes after the last whole row are cut off")
    assert view.begun_from[1] == done - 1
    assert table_of(s)["run"].to_pylist() == list(range(6))


def test_a_complete_sweep_is_not_run_again(sweep, view):
    s = sweep(seeds=(0,))
    s.conduct(pool_of(s, view), view, never)
    (s.folder / folders.STREAM).write_bytes(b"")  # killed before this was removed
    s.conduct(None, view, never)
    assert len(view.rows) == 1
    assert not (s.folder / folders.STREAM).exists()


def test_all_rows_without_a_table_need_no_engine(sweep, view):
    """Killed between the last row and the table."""
    s = sweep(seeds=(0, 1))
    with ResultStream(s.folder / folders.STREAM, columns_of(s)) as stream:
        stream.append([{"run": 1, "exit_code": 0}, {"run": 0, "exit_code": 0}])
    s.conduct(None, view, never)
    assert table_of(s)["run"].to_pylist() == [0, 1]


def columns_of(sweep):
    from mavherd.gcs.sweep.columns import columns

    return columns(sweep.plan, sweep.points)


def test_a_run_that_crashes_is_a_row_and_the_sweep_goes_on(sweep, view):
    s = sweep(seeds=(0, 1, 2))
    real = task_of(s)

    def crashes(job):
        if job.seed == 1:
            os.kill(os.getpid(), signal.SIGKILL)
        return real(job)

    s.conduct(lambda: LocalPool(crashes, 2, view.note), view, never)
    _, told = s.conclude(view.note)
    assert told["failed"] == 1
    (failure,) = told["failures"]
    assert (failure["seed"], failure["runs"]) == (1, 1)
    assert "was killed by signal 9, twice" in failure["why"]
    assert table_of(s)["exit_code"].to_pylist() == [0, 3, 0]
    assert told["points"][0]["rates"]["passed"]["n"] == 2


def test_another_engine_can_stand_where_the_pool_does(sweep, view):
    """One that answers late, in another order, a few at a time."""

    class Backwards:
        slots = 4

        def __init__(self, task):
            self.task, self.jobs, self.stopped = task, [], False

        def submit(self, job):
            assert len(self.jobs) < self.slots
            self.jobs.append(job)

        def take(self, timeout):
            taken, self.jobs = self.jobs[::-1][:3], self.jobs[::-1][3:]
            return [Ended(job, self.task(job)) for job in taken]

        def stop(self):
            self.stopped = True

    s = sweep(seeds=tuple(range(5)))
    engine = Backwards(SweepTask(s.points, s.plan.mode, s.folder))
    s.conduct(lambda: engine, view, never)
    assert engine.stopped
    assert table_of(s)["run"].to_pylist() == list(range(5))


def test_a_task_can_be_sent_elsewhere(sweep):
    s = sweep(seeds=(3,), law=("off", "safe"))
    task = SweepTask(s.points, s.plan.mode, s.folder)
    there = pickle.loads(pickle.dumps(task))
    assert there(s.plan.job(1))["digest"] == task(s.plan.job(1))["digest"]


def test_the_conclusion_is_written_and_can_be_written_again(sweep, view):
    s = sweep(seeds=tuple(range(6)), law=("off", "safe"))
    s.conduct(pool_of(s, view), view, never)
    _, told = s.conclude(view.note)
    assert json.loads((s.folder / folders.SUMMARY).read_text()) == told
    assert told["points"][1]["set"] == {"team.law": "safe"}
    assert {p.name for p in (s.folder / folders.FIGURES).iterdir()} == {
        "rates.png",
        "distributions.png",
    }
    assert s.conclude(view.note)[1] == told


def test_a_table_that_lacks_runs_is_not_summed_up(sweep, view):
    s = sweep(seeds=(0, 1))
    s.conduct(pool_of(s, view), view, never)
    path = s.folder / folders.TABLE
    pq.write_table(pq.read_table(path).slice(1), path)
    with pytest.raises(MavherdError, match="has not the runs of this sweep"):
        s.conclude(view.note)


def test_a_folder_with_another_sweep_is_refused_by_the_difference(sweep, planned, dash):
    s = sweep(seeds=(0, 1))
    plan, points = planned(seeds=(0, 1, 2))
    with pytest.raises(MavherdError, match=r"has another sweep: --seeds is 0:3, not 0,1"):
        folders.begin(s.folder, plan, points, dash.read_text())


def test_a_folder_with_other_files_is_not_written_to(planned, dash, tmp_path):
    plan, points = planned()
    with pytest.raises(MavherdError, match=r"has files that are no sweep's, 'dash.yaml' first"):
        folders.begin(tmp_path, plan, points, "")
    assert not (tmp_path / folders.PLAN).exists()
