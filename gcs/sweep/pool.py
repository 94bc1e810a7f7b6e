"""Runs in processes on this machine: forked once, fed one job at a time, replaced when they die."""

import gc
import os
import signal
import time
from collections import Counter, deque
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from queue import SimpleQueue
from threading import Thread
from traceback import extract_tb
from warnings import catch_warnings, simplefilter

from ...transport.child import GC_THRESHOLD
from ...transport.errors import MavherdError, VehicleError
from ..report.outcome import INTERRUPTED
from .columns import Row, failed_row
from .engine import Ended, Task
from .plan import Job

ATTEMPTS = 2
_PATIENCE_S = 3.0  # for a worker to end its vehicles, before it is killed
_FORK = get_context("fork")  # workers have the scenarios and all modules from the start


class _Worker:
    """One process at the other end of a pipe, and the job that it has."""

    def __init__(self, task: Task, others: list["_Worker"]) -> None:
        self.pipe, end = _FORK.Pipe()
        self.job: Job | None = None
        # A pipe is only seen to end when nobody else holds this side of it.
        ours = [self.pipe, *(other.pipe for other in others)]
        self.process = _FORK.Process(target=_work, args=(task, end, ours), daemon=True)
        try:
            with catch_warnings():
                # Python 3.12 warns of any thread, such as numpy's; workers use nothing they hold.
                simplefilter("ignore", DeprecationWarning)
                self.process.start()
        except OSError as error:
            raise VehicleError(f"cannot start a worker: {error.strerror}") from None
        end.close()

    def give(self, job: Job) -> None:
        self.job = job
        with suppress(OSError):  # it is dead: seen when its pipe is read
            self.pipe.send(job)

    def obituary(self) -> str:
        """Return how it ended."""
        self.process.join()
        code = self.process.exitcode or 0
        cause = f"was killed by signal {-code}" if code < 0 else f"ended with exit code {code}"
        return f"worker {self.process.pid} {cause}"


class LocalPool:
    """An `Engine` of `workers` processes; `told` gets a line for each that died.

    Once `interrupted` says so, what has ended can still be taken, and nothing is begun any more:
    who interrupts us may have ended the workers, too.
    """

    def __init__(
        self,
        task: Task,
        workers: int,
        told: Callable[[str], None],
        interrupted: Callable[[], bool] = lambda: False,
    ) -> None:
        self._task = task
        self._told = told
        self._interrupted = interrupted
        self._backlog: deque[Job] = deque()
        self._deaths: Counter[int] = Counter()
        self._workers: list[_Worker] = []
        for _ in range(workers):
            self._workers.append(_Worker(task, self._workers))

    @property
    def slots(self) -> int:
        """Return how many jobs it wants: each worker's and the next one's."""
        return 2 * len(self._workers)

    def submit(self, job: Job) -> None:
        """Take one job."""
        self._backlog.append(job)
        self._feed()

    def take(self, timeout: float) -> list[Ended]:
        """Return what has ended; a worker that is done gets its next job before that."""
        pipes = {worker.pipe: worker for worker in self._workers}
        ended = []
        for pipe in wait(list(pipes), timeout):
            assert isinstance(pipe, Connection)  # noqa: S101 - nothing else was given
            worker = pipes[pipe]
            try:
                row: Row = pipe.recv()
            except (OSError, EOFError):
                ended += self._bury(worker)
            else:
                job, worker.job = worker.job, None
                assert job is not None  # noqa: S101 - a worker only answers
                ended.append(Ended(job, row))
        self._feed()
        return ended

    def stop(self) -> None:
        """End all workers with what they do; those that do not end in time are killed."""
        for worker in self._workers:
            worker.pipe.close()
        deadline = time.monotonic() + _PATIENCE_S
        for worker in self._workers:
            worker.process.join(max(0.0, deadline - time.monotonic()))
            if worker.process.is_alive():
                worker.process.kill()
                worker.process.join()
        self._workers.clear()

    def _feed(self) -> None:
        if self._interrupted():
            return
        for worker in self._workers:
            if worker.job is None and self._backlog:
                worker.give(self._backlog.popleft())

    def _bury(self, worker: _Worker) -> list[Ended]:
        """Replace a dead worker; return its job as ended when that was its last attempt."""
        cause = worker.obituary()
        if self._interrupted():  # a signal to all of us has come to us, too, when it has ended one
            return []
        worker.pipe.close()
        self._workers.remove(worker)
        self._workers.append(_Worker(self._task, self._workers))
        job = worker.job
        if job is None:
            self._told(f"{cause} while it had nothing to do")
            return []
        if worker.process.exitcode != INTERRUPTED:  # else somebody ended it: no fault of the run
            self._deaths[job.number] += 1
        if self._deaths[job.number] < ATTEMPTS:
            self._told(f"{cause} in run {job.number} (seed {job.seed}); the run is done again")
            self._backlog.appendleft(job)
            return []
        self._told(f"{cause} in run {job.number} (seed {job.seed}), not for the first time")
        return [Ended(job, failed_row(f"{cause}, twice", VehicleError.exit_code))]


def _work(task: Task, pipe: Connection, others: list[Connection]) -> None:
    """Do jobs as they come; end at once when the pipe ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all: the sweep decides
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    for other in others:
        other.close()
    gc.freeze()
    gc.set_threshold(GC_THRESHOLD)
    jobs: SimpleQueue[Job] = SimpleQueue()
    Thread(target=_listen, args=(pipe, jobs), daemon=True).start()
    with suppress(OSError, KeyboardInterrupt):  # the sweep is gone
        while (row := _done(task, jobs.get()))["exit_code"] != INTERRUPTED:
            pipe.send(row)
    os._exit(INTERRUPTED)  # somebody wants us to end: this is no result


def _listen(pipe: Connection, jobs: "SimpleQueue[Job]") -> None:
    """Pass on jobs; when the sweep is gone or stops, end this process in the middle of its run."""
    with suppress(OSError, EOFError):
        while True:
            jobs.put(pipe.recv())
    os.kill(os.getpid(), signal.SIGTERM)  # a run with processes of its own ends these


def _done(task: Task, job: Job) -> Row:
    """Return the row of a job, also when the code fails: the sweep goes on."""
    try:
        return task(job)
    except MavherdError as error:
        return failed_row(str(error), error.exit_code)
    except Exception as error:
        at = extract_tb(error.__traceback__)[-1]
        what = f"{type(error).__name__}: {error}".splitlines()[0]
        return failed_row(f"{what} ({at.filename}:{at.lineno})", VehicleError.exit_code)
