"""The runs that are compared: opened, judged where they left no report of this version, named."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..diff.run_folder import open_run
from ..flown.flown import Flown, open_flown
from ..flown.folder import REPORT_SCHEMA, RunFolderError
from .labels import differing, groups, labels
from .measures import was_cut_short

if TYPE_CHECKING:
    from ..report.truth import Track

MAX_RUNS = 24
_CONDITIONS = "lockstep", "in_process", "version", "compiled", "python", "platform"


@dataclass(frozen=True)
class ComparedRun:
    """One run among others."""

    label: str
    group: str  # runs of one group share a colour: its label, unless there are many runs
    flown: Flown
    report: Mapping[str, Any]  # as the run left it, or judged again

    @cached_property
    def tracks(self) -> "list[Track]":
        """What its robots truly did."""
        return sorted(self.flown.tracks(), key=lambda track: track.system_id)

    @property
    def head(self) -> str:
        """Its label, and until when it is known where something cut it short."""
        if was_cut_short(self.report):
            return f"{self.label} (until {self.report['duration_s']:.1f} s)"
        return f"{self.label} (partial)" if self.flown.partial else self.label

    @property
    def ready_at(self) -> float:
        """The moment from which it counts, s of fleet time: all were ready, or 0."""
        return self.report.get("ready_at_s") or 0.0

    @property
    def done_at(self) -> float:
        """When its work was done, s of fleet time: all had arrived, or else it ended."""
        ended = self.report.get("ended_at_s") or 0.0
        arrivals = [robot.get("arrival_s") for robot in self.report["robots"]]
        known = [arrival for arrival in arrivals if arrival is not None]
        if not (self.report.get("all_arrived") and known):
            return ended
        return min(ended, self.ready_at + max(known))


@dataclass(frozen=True)
class LineUp:
    """All of them, in the order in which they were given."""

    runs: tuple[ComparedRun, ...]
    settings: Mapping[str, tuple[Any, ...]]
    """By key, what each run has of what they do not all have alike; None: it has no such key."""

    @property
    def groups(self) -> list[str]:
        """Their groups, each once."""
        return list(dict.fromkeys(run.group for run in self.runs))

    @property
    def scenarios(self) -> list[str]:
        """The names of their scenarios, each once."""
        return list(dict.fromkeys(run.flown.scenario.name for run in self.runs))


def line_up(folders: Sequence[Path]) -> LineUp:
    """Open and name the runs. Raises MavherdError for fewer than two, or one that is none."""
    _check(folders)
    flown = [open_flown(folder) for folder in folders]
    settings = [open_run(folder).settings for folder in folders]
    reports = [_report(run) for run in flown]
    named = labels(settings, folders)
    runs = tuple(map(ComparedRun, named, groups(settings, named), flown, reports))
    unlike = {key: tuple(run.get(key) for run in settings) for key in differing(settings)}
    for key in _CONDITIONS:
        values = tuple(report.get(key) for report in reports)
        if len(set(values)) > 1:
            unlike[key] = values
    return LineUp(runs, unlike)


def _check(folders: Sequence[Path]) -> None:
    if len(folders) < 2:
        raise RunFolderError(
            "compare needs two runs or more (`mavherd report` and `mavherd view` show one alone)"
        )
    if len(folders) > MAX_RUNS:
        raise RunFolderError(
            f"{len(folders)} runs are too many to tell apart (compare at most {MAX_RUNS};"
            " `mavherd sweep` makes statistics of more)"
        )
    seen: dict[Path, Path] = {}
    for folder in folders:
        if (first := seen.setdefault(folder.resolve(), folder)) is not folder:
            raise RunFolderError(f"{folder}: this run is given twice (first as {first})")


def _report(run: Flown) -> Mapping[str, Any]:
    """Return a run's report; one that is of an older version, or not there, is made in memory."""
    if run.report is not None and run.report.get("schema") == REPORT_SCHEMA:
        return {**run.report, "partial": run.partial}  # a log may be lost since
    from ..flown.again import judge_again

    return judge_again(run).report
