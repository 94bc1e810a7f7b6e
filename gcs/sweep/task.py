"""What a worker does: one run of one grid point, in this process or through processes."""

import time
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ...scenarios.schema import Scenario
from .columns import Row, result_row
from .plan import PROCESSES, Job


@dataclass(frozen=True, slots=True)
class SweepTask:
    """All that any run of a sweep needs; `scratch` is for run folders that nobody keeps."""

    points: tuple[Scenario, ...]
    mode: str
    scratch: Path

    def __call__(self, job: Job) -> Row:
        """Do one run."""
        begun = time.perf_counter()
        scenario = replace(self.points[job.point], seed=job.seed)
        processes = self.mode == PROCESSES
        report = through_processes(scenario, self.scratch) if processes else in_process(scenario)
        row = result_row(scenario, report)
        return row | {"wall_s": time.perf_counter() - begun}  # start and judgement included


def in_process(scenario: Scenario) -> dict[str, Any]:
    """Return the report of a run in this process."""
    from ..run.in_process import simulate

    return simulate(scenario).report


def through_processes(scenario: Scenario, scratch: Path) -> dict[str, Any]:
    """Return the report of a run by `mavherd run`'s own launcher, without ports or recording."""
    from ..run.launcher import Run, RunOptions
    from ..run.ports import PortPlan

    scratch.mkdir(exist_ok=True)
    with TemporaryDirectory(dir=scratch) as out:
        options = RunOptions(
            record=False,
            figures=False,
            out=Path(out),
            ports=PortPlan(gcs_udp=0, api_udp=0, tcp=0),
        )
        return Run(scenario, options).execute().report


def warm_up(mode: str) -> None:
    """Import what runs need, before workers are forked that share it."""
    if mode == PROCESSES:
        from ..run import launcher  # noqa: F401
    else:
        from ..run import in_process  # noqa: F401
