"""Runs a scenario: opens it, conducts it to its end, closes it, reports."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Self

from ...scenarios.schema import Scenario
from ...transport.errors import VehicleError, os_reason
from ..ctrl_c import presses
from ..report.outcome import INTERRUPTED, PASSED, TIMED_OUT, Outcome, timed_out
from ..team.coordinator import check_laws
from .conductor import Clock, Died, FreeRun, Interrupted, Lockstep
from .drive import drive, listen
from .head_start import HeadStart
from .keys import Keys
from .open_run import OpenRun, RunOptions
from .showing import Showing, look_at_bus, look_at_teams
from .view import Unseen, View

if TYPE_CHECKING:
    from .in_process_run import InProcessRun
    from .in_process_team import InProcess

__all__ = ["Run", "RunOptions", "Unseen", "View"]


class Run:
    """One run of one scenario; `keys` are the user's, where one sits at a terminal.

    It is shown live, if that was asked for, until the end of the block.
    """

    def __init__(
        self,
        scenario: Scenario,
        options: RunOptions,
        view: View | None = None,
        keys: Keys | None = None,
        head_start: HeadStart | None = None,
    ) -> None:
        check_laws(scenario)
        self.scenario = scenario
        self.options = options
        self._view = view or Unseen()
        self._keys = keys
        self._head_start = head_start
        self._signals = 0
        self._shown: OpenRun | None = None  # to viewers

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._end_show()

    @property
    def page(self) -> str:
        """Where a browser still finds what was shown; empty when nowhere."""
        dashboard = self._shown.dashboard if self._shown else None
        return dashboard.page if dashboard else ""

    def execute(self) -> Outcome:
        """Run from start to report. Raises MavherdError when nothing could be started."""
        with self._interruptible():
            run = self._open()
            exit_code, error = self._live(run)
            if self._interrupted() and error is None:
                exit_code, error = INTERRUPTED, "interrupted"
            try:
                outcome = run.conclude(exit_code, error)
            except OSError as failure:
                first = f"{error}; " if error else ""
                raise VehicleError(
                    f"{first}{run.folder}: cannot write the report: {failure.strerror or failure}"
                ) from None
            if self._interrupted() and error is None:
                raise KeyboardInterrupt  # while the report was written: it is complete
            return outcome

    def _open(self) -> "OpenRun | InProcessRun":
        if not self.options.in_process:
            self._shown = OpenRun(
                self.scenario,
                self.options,
                self._view,
                self._interrupted,
                head_start=self._head_start,
            )
            return self._shown
        from .in_process_run import InProcessRun  # vehicles and all: others start sooner without

        return InProcessRun(self.scenario, self.options, self._view, self._interrupted)

    def _live(self, run: "OpenRun | InProcessRun") -> tuple[int, str | None]:
        """Start the crew, conduct it, end it; return the exit code and what went wrong."""
        exit_code, error = PASSED, None
        try:
            clock = run.start()
            self._conduct(run, clock)
            if not clock.finished:
                exit_code, error = TIMED_OUT, timed_out(self.scenario)
        except Interrupted:
            exit_code, error = INTERRUPTED, "interrupted"
        except Died as died:
            exit_code, error = VehicleError.exit_code, _obituary(run, died)
        except VehicleError as failure:
            exit_code, error = failure.exit_code, str(failure)
        except OSError as failure:  # the disk is full, say
            exit_code, error = VehicleError.exit_code, os_reason(failure)
        finally:
            signals = self._signals
            run.stop(hurry=error is not None, insists=lambda: self._signals > signals)
        return exit_code, error

    def _conduct(self, run: "OpenRun | InProcessRun", clock: "Clock | InProcess") -> None:
        if isinstance(clock, FreeRun) and isinstance(run, OpenRun):
            showing = Showing(self._view, look_at_bus(run.bus, self.scenario))
            listen(run, clock, showing, self._interrupted)
        elif isinstance(clock, Lockstep) or not isinstance(clock, Clock):
            showing = Showing(self._view, look_at_teams(clock.look))
            drive(run, clock, showing, self._interrupted, self._keys)

    def _end_show(self) -> None:
        if self._shown:
            self._shown.end_show(hurry=self._interrupted())
        self._shown = None

    def _interrupted(self) -> bool:
        return self._signals > 0

    @contextmanager
    def _interruptible(self) -> Iterator[None]:
        """Turn Ctrl-C, SIGTERM and SIGHUP into an orderly end, with a report.

        A SIGHUP that somebody has us ignore, as `nohup` does, stays ignored.
        """

        def note(signum: int, frame: FrameType | None) -> None:
            self._signals += 1

        ours = [signal.SIGINT, signal.SIGTERM]
        if signal.getsignal(signal.SIGHUP) is signal.SIG_DFL:
            ours.append(signal.SIGHUP)
        try:
            before = {s: signal.signal(s, note) for s in ours}
            self._signals += presses()
        except ValueError:  # not in the main thread: the caller has its own way to stop
            yield
            return
        try:
            yield
        finally:
            for signum, handler in before.items():
                signal.signal(signum, handler)


def _obituary(run: "OpenRun | InProcessRun", died: Died) -> str:
    return run.crew.obituary(died) if isinstance(run, OpenRun) else str(died)
