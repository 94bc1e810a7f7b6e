"""A pool does each job once in real processes, whatever happens to them."""

import os
import signal
import time
from pathlib import Path
from warnings import catch_warnings, simplefilter

import pytest

from mavherd.gcs.sweep.plan import Job
from mavherd.gcs.sweep.pool import LocalPool
from mavherd.scenarios.errors import ScenarioError

PATIENCE_S = 60.0


def answer(job):
    return {"exit_code": 0, "seed": job.seed, "pid": os.getpid()}


@pytest.fixture
def pool():
    """Make pools: pool(task, workers); `said` has what they told."""
    made = []

    def make(task, workers=2, interrupted=lambda: False):
        said = []
        each = LocalPool(task, workers, said.append, interrupted)
        each.said = said
        made.append(each)
        return each

    yield make
    for each in made:
        each.stop()


def all_of(pool, jobs):
    """Submit jobs and return their rows by number when all have ended, each once."""
    for job in jobs:
        pool.submit(job)
    rows = {}
    deadline = time.monotonic() + PATIENCE_S
    while len(rows) < len(jobs):
        assert time.monotonic() < deadline, rows
        for ended, row in pool.take(0.1):
            assert ended.number not in rows
            rows[ended.number] = row
    assert pool.take(0) == []
    return rows


def jobs(count):
    return [Job(number, 0, 100 + number) for number in range(count)]


def alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):  # it may end while it is read of
        return False


def wait_for(condition):
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_every_job_is_done_once_by_workers_that_stay(pool):
    rows = all_of(pool(answer), jobs(50))
    assert {number: row["seed"] for number, row in rows.items()} == {k: 100 + k for k in range(50)}
    pids = {row["pid"] for row in rows.values()}
    assert os.getpid() not in pids
    assert len(pids) <= 2


def test_workers_work_at_the_same_time(pool, tmp_path):
    """Each waits for the other's file: one alone would never be done."""

    def meet(job):
        (tmp_path / str(job.number)).touch()
        wait_for(lambda: (tmp_path / str(1 - job.number)).exists())
        return answer(job)

    assert len(all_of(pool(meet), jobs(2))) == 2


def test_code_that_fails_makes_a_row_and_the_worker_goes_on(pool):
    def fails(job):
        if job.number == 1:
            raise ZeroDivisionError("no\nsense")
        if job.number == 2:
            raise ScenarioError("dash", "no room")
        return answer(job)

    each = pool(fails, workers=1)
    rows = all_of(each, jobs(4))
    here = Path(__file__).name
    assert rows[1]["exit_code"] == 3
    assert rows[1]["error"].startswith("ZeroDivisionError: no (")
    assert here in rows[1]["error"]
    assert (rows[2]["exit_code"], rows[2]["error"]) == (2, "dash: no room")
    assert rows[0]["pid"] == rows[3]["pid"]
    assert each.said == []


def test_a_run_whose_worker_dies_is_done_again(pool, tmp_path):
    def dies_once(job):
        mark = tmp_path / str(job.number)
        if job.number == 3 and not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return answer(job)

    each = pool(dies_once)
    rows = all_of(each, jobs(8))
    assert all(row["exit_code"] == 0 for row in rows.values())
    (said,) = each.said
    assert "was killed by signal 9 in run 3 (seed 103); the run is done again" in said


def test_a_run_that_kills_two_workers_has_failed(pool):
    def dies(job):
        if job.number == 3:
            os._exit(7)
        return answer(job)

    each = pool(dies)
    rows = all_of(each, jobs(8))
    assert rows.pop(3)["exit_code"] == 3
    assert all(row["exit_code"] == 0 for row in rows.values())
    assert len(each.said) == 2
    assert "ended with exit code 7 in run 3 (seed 103), not for the first time" in each.said[1]


def test_an_idle_worker_that_is_killed_is_replaced(pool):
    each = pool(answer, workers=1)
    (row,) = all_of(each, jobs(1)).values()
    os.kill(row["pid"], signal.SIGKILL)
    wait_for(lambda: not alive(row["pid"]))
    (again,) = all_of(each, jobs(1)).values()
    assert again["pid"] != row["pid"]
    assert len(each.said) == 1


def test_an_interrupted_run_is_no_result(pool, tmp_path):
    def interrupted(job):
        mark = tmp_path / "once"
        if not mark.exists():
            mark.touch()
            return {"exit_code": 130, "error": "interrupted"}
        return answer(job)

    each = pool(interrupted, workers=1)
    assert all_of(each, jobs(1))[0]["exit_code"] == 0
    assert len(each.said) == 1


def test_an_interrupted_run_is_no_attempt(pool, tmp_path):
    """It is done again although its worker has died before."""

    def killed_then_interrupted(job):
        if not (tmp_path / "killed").exists():
            (tmp_path / "killed").touch()
            os.kill(os.getpid(), signal.SIGKILL)
        if not (tmp_path / "interrupted").exists():
            (tmp_path / "interrupted").touch()
            return {"exit_code": 130, "error": "interrupted"}
        return answer(job)

    assert all_of(pool(killed_then_interrupted), jobs(1))[0]["exit_code"] == 0


@pytest.mark.parametrize("end", [130, -signal.SIGTERM], ids=str)
def test_once_interrupted_rows_are_taken_and_nothing_is_begun(pool, tmp_path, end):
    """Job 1 ends its worker as a signal to the whole group may; job 2 would be the next."""
    came = []

    def ends(job):
        (tmp_path / str(job.number)).touch()
        if job.number != 1:
            return answer(job)
        wait_for((tmp_path / "end").exists)
        if end < 0:
            os.kill(os.getpid(), -end)
        os._exit(end)

    each = pool(ends, interrupted=lambda: bool(came))
    for job in jobs(3):
        each.submit(job)
    wait_for(lambda: (tmp_path / "0").exists() and (tmp_path / "1").exists())
    before = {worker.process.pid for worker in each._workers}
    came.append(signal.SIGINT)
    (tmp_path / "end").touch()
    wait_for(lambda: not all(map(alive, before)))
    ended = []
    wait_for(lambda: ended.extend(each.take(0.1)) or ended)
    ended += each.take(0)
    assert [job.number for job, _ in ended] == [0]
    assert each.said == []
    assert {worker.process.pid for worker in each._workers} == before
    assert not (tmp_path / "2").exists()


def test_ctrl_c_is_not_for_workers(pool):
    def interrupts_itself(job):
        os.kill(os.getpid(), signal.SIGINT)
        return answer(job)

    each = pool(interrupts_itself, workers=1)
    assert all_of(each, jobs(2))[1]["exit_code"] == 0
    assert each.said == []


def forever(job):
    path = Path(f"{job.seed}.pid")
    path.with_suffix(".part").write_text(str(os.getpid()))
    path.with_suffix(".part").replace(path)
    while True:
        time.sleep(60)


def test_stop_ends_workers_in_the_middle_of_a_run(pool, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    each = pool(forever)
    for job in jobs(2):
        each.submit(job)
    wait_for(lambda: len(list(tmp_path.glob("*.pid"))) == 2)
    pids = [int(path.read_text()) for path in tmp_path.glob("*.pid")]
    each.stop()
    assert not any(alive(pid) for pid in pids)


def test_workers_end_with_the_process_that_forked_them(tmp_path, monkeypatch):
    """Also with one that is killed, and those that were forked later for others."""
    monkeypatch.chdir(tmp_path)
    with catch_warnings():
        simplefilter("ignore", DeprecationWarning)  # of threads, which the child does not need
        child = os.fork()
    if not child:
        try:
            pool = LocalPool(forever, 3, lambda text: None)
            for job in jobs(3):
                pool.submit(job)
            while True:
                pool.take(60)
        finally:
            os._exit(1)  # two test runs would go on from here
    wait_for(lambda: len(list(tmp_path.glob("*.pid"))) == 3)
    pids = [int(path.read_text()) for path in tmp_path.glob("*.pid")]
    assert all(alive(pid) for pid in pids)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    wait_for(lambda: not any(alive(pid) for pid in pids))
