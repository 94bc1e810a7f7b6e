"""A scenario from start to verdict in this process: for sweeps and for tests."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...scenarios.schema import Scenario
from ...scenarios.starts import draw_starts
from ...transport.errors import VehicleError
from ..report.costs import Costs
from ..report.outcome import INTERRUPTED, PASSED, TIMED_OUT, Ending, assess, timed_out
from .in_process_run import InProcessRun
from .in_process_team import InProcess
from .open_run import RunOptions
from .readiness import Readiness
from .view import Unseen


@dataclass(frozen=True, slots=True)
class Result:
    """What became of a run."""

    exit_code: int
    report: dict[str, Any]  # what report.json holds
    folder: Path | None = None  # of the run, when it was to be kept
    notes: tuple[str, ...] = ()  # for the user: what is missing from it and what to install


def simulate(
    scenario: Scenario,
    *,
    keep: Path | None = None,
    figures: bool = False,
    interrupted: Callable[[], bool] = lambda: False,
) -> Result:
    """Run a scenario as fast as it goes; with `keep` its run folder is made there.

    `interrupted` is asked every tick. Raises MavherdError for what cannot be run in process.
    """
    if keep is not None:
        options = RunOptions(out=keep, figures=figures, record=False)
        run = InProcessRun(scenario, options, Unseen(), interrupted)
        try:
            team = run.start()
            exit_code, error = _drive(team, scenario, interrupted)
        finally:
            run.stop(hurry=False)
        outcome = run.conclude(exit_code, error)
        return Result(outcome.exit_code, outcome.report, outcome.folder, tuple(outcome.notes))
    starts = draw_starts(scenario)
    ready = Readiness(len(starts))
    team = InProcess(scenario, starts, ready.note)
    begun, started_at, cpu_before = time.monotonic(), time.time(), time.process_time()
    exit_code, error = _drive(team, scenario, interrupted)
    ending = Ending(
        exit_code=exit_code,
        error=error,
        now=team.now,
        wall_s=time.monotonic() - begun,
        ready_at=ready.at,
        ticks=team.ticks,
        started_at=started_at,
        costs=Costs(launcher=time.process_time() - cpu_before),
    )
    report, _ = assess(
        scenario,
        starts,
        [places for places in team.places if len(places)],
        ending,
        run_id=scenario.name,
        digest=team.digest if team.ticks else None,
    )
    return Result(report["exit_code"], report)


def _drive(
    team: InProcess, scenario: Scenario, interrupted: Callable[[], bool]
) -> tuple[int, str | None]:
    """Tick to the end; return the exit code so far and what went wrong."""
    period_us = scenario.team.period_us
    try:
        while not team.finished and not team.expired(scenario.duration):
            if interrupted():
                return INTERRUPTED, "interrupted"
            team.tick(period_us)
    except VehicleError as failure:
        return failure.exit_code, str(failure)
    if not team.finished:
        return TIMED_OUT, timed_out(scenario)
    return PASSED, None
