"""What is up while a team runs in this process: its folder, its event log, the view.

It is opened, conducted and closed as an `OpenRun` is; nothing is started that could die.
"""

import json
import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

from ...scenarios.schema import Scenario
from ...scenarios.starts import draw_starts
from ...transport.local_bus import LocalBus
from ..flown.events import open_events
from ..report.costs import Costs
from ..report.outcome import INTERRUPTED, Ending, Outcome, conclude
from .in_process_team import InProcess
from .open_run import RunOptions
from .readiness import Readiness
from .run_folder import make_folder, name_folder
from .view import View


class InProcessRun:
    """Everything around the robots of one run, opened once and closed once."""

    def __init__(
        self,
        scenario: Scenario,
        options: RunOptions,
        view: View,
        interrupted: Callable[[], bool],
    ) -> None:
        self.scenario = scenario
        self.options = options
        self.starts = draw_starts(scenario)
        self.folder = name_folder(options.out, scenario)
        self.bus = LocalBus()
        self.clock: InProcess | None = None
        self.started = 0.0  # on the monotonic clock
        self.wall_s = 0.0
        self._ready = Readiness(len(self.starts))
        self._started_at = time.time()
        self._cpu_before = time.process_time()
        self._view = view
        self._stack = ExitStack()

    def start(self) -> InProcess:
        """Set everybody up and return the clock; call `stop` whatever happens."""
        make_folder(self.folder, self.scenario, self.starts)
        self._log = self._stack.enter_context(open_events(self.folder))
        self._events = self.bus.publisher("events")
        self.clock = clock = InProcess(
            self.scenario, self.starts, self.note, bus=self.bus, folder=self.folder
        )
        self._stack.callback(clock.close)
        self._view.started(self.folder, {})
        self.started = time.monotonic()
        return clock

    def note(self, event: dict[str, Any]) -> None:
        """Write, publish and show one event."""
        line = json.dumps(event)
        self._log.write(line + "\n")
        self._events.put(line.encode())
        self._ready.note(event)
        self._view.event(event)

    def stop(self, *, hurry: bool, insists: Callable[[], bool] = lambda: False) -> None:
        """Finish the logs; that takes no time, so there is nothing to hurry."""
        if self.clock and not self.wall_s:
            self.wall_s = time.monotonic() - self.started
        self._stack.close()

    def conclude(self, exit_code: int, error: str | None) -> Outcome:
        """Judge the run and write the report. Raises OSError when that cannot be."""
        clock, options = self.clock, self.options
        ending = Ending(
            exit_code=exit_code,
            error=error,
            now=clock.now if clock else 0.0,
            wall_s=self.wall_s,
            ready_at=self._ready.at,
            ticks=clock.ticks if clock else 0,
            late_ticks=clock.late if clock else 0,
            started_at=self._started_at,
            costs=Costs(launcher=time.process_time() - self._cpu_before),
        )
        return conclude(
            self.folder,
            self.scenario,
            self.starts,
            ending,
            lockstep=True,
            speed=options.speed,
            in_process=True,
            figures=options.figures and exit_code != INTERRUPTED,
            record=False,
            ports={},
            step=self._view.step,
        )
