"""Runs a scenario: opens it, conducts it to its end, closes it, reports."""

import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from ...scenarios.schema import Scenario
from ...transport.bus import Bus, Mailbox
from ...transport.errors import VehicleError, os_reason
from ...transport.wire import VehicleState, unpack_state, unpack_team
from ..report.outcome import INTERRUPTED, PASSED, TIMED_OUT, Outcome
from ..team.coordinator import check_laws
from .conductor import Clock, Died, FreeRun, Interrupted, Lockstep, Pacer
from .open_run import OpenRun, RunOptions, Unseen, View

__all__ = ["Run", "RunOptions", "Unseen", "View"]

_VIEW_PERIOD_S = 0.1


class Run:
    """One run of one scenario."""

    def __init__(self, scenario: Scenario, options: RunOptions, view: View | None = None) -> None:
        check_laws(scenario)
        self.scenario = scenario
        self.options = options
        self._view = view or Unseen()
        self._signals = 0

    def execute(self) -> Outcome:
        """Run from start to report. Raises MavherdError when nothing could be started."""
        with self._interruptible():
            run = OpenRun(self.scenario, self.options, self._view, self._interrupted)
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

    def _live(self, run: OpenRun) -> tuple[int, str | None]:
        """Start the crew, conduct it, end it; return the exit code and what went wrong."""
        exit_code, error = PASSED, None
        try:
            clock = run.start()
            self._conduct(run, clock, run.bus)
            if not clock.finished:
                limit = f"{self.scenario.duration:g} s of simulated time"
                exit_code, error = TIMED_OUT, f"timed out: not done after {limit}"
        except Interrupted:
            exit_code, error = INTERRUPTED, "interrupted"
        except Died as died:
            exit_code, error = VehicleError.exit_code, run.crew.obituary(died)
        except VehicleError as failure:
            exit_code, error = failure.exit_code, str(failure)
        except OSError as failure:  # the disk is full, say
            exit_code, error = VehicleError.exit_code, os_reason(failure)
        finally:
            signals = self._signals
            run.stop(hurry=error is not None, insists=lambda: self._signals > signals)
        return exit_code, error

    def _conduct(self, run: OpenRun, clock: Clock, bus: Bus) -> None:
        scenario, speed = self.scenario, self.options.speed
        period = 1.0 / scenario.team.rate_hz
        # Of several coordinators each publishes its own vehicles only.
        key = "team" if scenario.team.coordinators == "central" else "vehicle/*/state"
        heard, ticks = bus.latest(key), bus.publisher("clock")
        begun = time.monotonic() if self.options.lockstep else run.started
        shown = begun
        pacer = Pacer(speed, period) if speed and isinstance(clock, Lockstep) else None
        try:
            while not clock.finished and not clock.expired(scenario.duration):
                if self._interrupted():
                    raise Interrupted
                if isinstance(clock, Lockstep):
                    clock.tick(round(period * 1e6))
                    ticks.put(f"{clock.now:.6f}".encode())
                elif isinstance(clock, FreeRun):
                    clock.listen(run.started, _VIEW_PERIOD_S)
                wall = time.monotonic()
                if wall - shown > _VIEW_PERIOD_S:
                    shown = wall
                    self._view.update(clock.now, _known(heard), clock.now / (wall - begun))
                if pacer:
                    pacer.wait()
        finally:
            run.wall_s = time.monotonic() - begun
            if pacer:
                clock.late = pacer.late

    def _interrupted(self) -> bool:
        return self._signals > 0

    @contextmanager
    def _interruptible(self) -> Iterator[None]:
        """Turn Ctrl-C and SIGTERM into an orderly end; processes are ended, the report written."""

        def note(signum: int, frame: FrameType | None) -> None:
            self._signals += 1

        try:
            before = {s: signal.signal(s, note) for s in (signal.SIGINT, signal.SIGTERM)}
        except ValueError:  # not in the main thread: the caller has its own way to stop
            yield
            return
        try:
            yield
        finally:
            for signum, handler in before.items():
                signal.signal(signum, handler)


def _known(heard: Mailbox) -> list[VehicleState]:
    """Return the newest states, in order of system id."""
    if data := heard.latest.get("team"):
        return unpack_team(data)[1]
    states = [unpack_state(data) for data in list(heard.latest.values())]
    return sorted((s for s in states if s.time >= 0), key=lambda state: state.system_id)
