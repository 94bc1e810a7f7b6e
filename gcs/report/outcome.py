"""From a run that has ended to its report: read the truth, judge it, write everything down."""

import platform
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ... import __version__
from ...scenarios.schema import RobotSpec, Scenario
from ...transport.tlog import digest
from ..compiled import state
from ..complaint import INSTALL
from ..flown.flown import lacking_logs
from ..flown.folder import whole_or_part
from .costs import NOTHING, Costs

if TYPE_CHECKING:  # numpy is needed at the end only: a run is under way sooner without
    from .judge import Verdict
    from .traffic import Traffic
    from .truth import Track, Trail

PASSED, FAILED, TIMED_OUT, INTERRUPTED = 0, 1, 4, 130


@dataclass(frozen=True, slots=True, kw_only=True)
class Ending:
    """How a run has ended, as far as the launcher knows; the judge has the last word."""

    exit_code: int = PASSED
    error: str | None = None
    now: float = 0.0  # s of fleet time
    wall_s: float = 0.0
    ready_at: float | None = None  # s, when all were ready
    ticks: int = 0
    late_ticks: int = 0
    outside_clients: int = 0
    script: bool | None = False  # whether one steered; None: not known
    missing: tuple[str, ...] = ()  # from the run folder, a line for each thing
    started_at: float | None = None  # s, UTC
    costs: Costs = NOTHING


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a run."""

    exit_code: int
    folder: Path
    report: dict[str, Any]
    notes: list[str]  # for the user: what is missing and what to install


def broken_off(error: str | None, exit_code: int) -> bool:
    """Return whether a run did not end by itself: what it had not decided stays open."""
    return error is not None and exit_code != TIMED_OUT


def timed_out(scenario: Scenario) -> str:
    """Return what is said of a run that was not done in its time."""
    return f"timed out: not done after {scenario.duration:g} s of fleet time"


def conclude(
    folder: Path,
    scenario: Scenario,
    starts: tuple[RobotSpec, ...],
    ending: Ending,
    *,
    lockstep: bool,
    speed: float | None,
    in_process: bool = False,
    figures: bool,
    record: bool,
    ports: dict[str, Any],
    step: Callable[[str], None] = lambda _: None,
) -> Outcome:
    """Judge the run in `folder` and write its report. Raises OSError when that cannot be.

    `step` is told what is being done.
    """
    step("reading the logs")
    tracks = _tracks(folder, starts)
    lacking = lacking_logs(folder, [spec.name for spec in starts])
    ending = replace(ending, missing=(*ending.missing, *lacking))
    tlogs = [
        folder / "vehicles" / spec.name / f"{spec.name}.tlog"
        for spec in sorted(starts, key=lambda spec: spec.system_id)
    ]
    whole = all(log.exists() for log in tlogs)
    traffic = traffic_of(folder, starts)
    step("judging")
    report, verdict = assess(
        scenario,
        starts,
        tracks,
        ending,
        run_id=folder.name,
        digest=digest(tlogs) if lockstep and whole and ending.ticks else None,
        lockstep=lockstep,
        speed=speed,
        in_process=in_process,
        ports=ports,
        traffic=traffic,
    )
    from .report import write_report

    notes = write_report(
        folder, report, scenario, starts, tracks, verdict, figures=figures, step=step
    )
    if record and find_spec("rerun") is None:
        notes.append(f"rerun-sdk is missing, so no recording ({INSTALL})")
    return Outcome(report["exit_code"], folder, report, notes)


def assess(
    scenario: Scenario,
    starts: tuple[RobotSpec, ...],
    tracks: "Sequence[Trail]",
    ending: Ending,
    *,
    run_id: str,
    digest: str | None,
    lockstep: bool = True,
    speed: float | None = None,
    in_process: bool = True,
    ports: Mapping[str, Any] | None = None,
    traffic: "Mapping[str, Traffic] | None" = None,
) -> "tuple[dict[str, Any], Verdict]":
    """Judge a run by its `tracks`; return the report and the verdict that is in it."""
    from .judge import judge
    from .report import RunFacts, build_report

    cut_short = broken_off(ending.error, ending.exit_code)
    verdict = judge(scenario, starts, tracks, ending.ready_at, ending.now, broken_off=cut_short)
    exit_code = ending.exit_code
    if exit_code == PASSED and not verdict.passed:
        exit_code = FAILED
    facts = RunFacts(
        run_id=run_id,
        seed=scenario.seed,
        law=scenario.team.law,
        lockstep=lockstep,
        speed=speed or (None if lockstep else 1.0),
        duration_s=ending.now,
        wall_s=ending.wall_s,
        real_time_factor=ending.now / ending.wall_s if ending.wall_s else 0.0,
        digest=digest,
        outside_clients=ending.outside_clients,
        script=ending.script,
        missing=ending.missing,
        started_at=_utc(ending.started_at),
        in_process=in_process,
        ticks=ending.ticks,
        late_ticks=ending.late_ticks,
        error=ending.error,
        exit_code=exit_code,
        version=__version__,
        compiled=state(),
        python=platform.python_version(),
        platform=platform.platform(),
        ports=ports or {},
        traffic=traffic or {},
        costs=ending.costs,
    )
    return build_report(scenario, verdict, facts), verdict


def _tracks(folder: Path, starts: tuple[RobotSpec, ...]) -> "list[Track]":
    """Return the truth of every vehicle that wrote any, of one that was killed too."""
    from .truth import TruthError, read_truth

    tracks = []
    for spec in starts:
        path = folder / "vehicles" / spec.name / "truth.bin"
        if not path.exists():
            path = path.with_name("truth.bin.part")
        if path.exists():
            with suppress(TruthError):  # killed before it wrote its header
                track = read_truth(path)
                tracks += [track] if len(track) else []
    return tracks


def traffic_of(folder: Path, starts: tuple[RobotSpec, ...]) -> "dict[str, Traffic]":
    """Return what went over the link of every vehicle that has a log."""
    from .traffic import read_traffic

    traffic = {}
    for spec in starts:
        log = whole_or_part(folder / "vehicles" / spec.name / f"{spec.name}.tlog")
        if log and (told := read_traffic(log, spec.system_id)):
            traffic[spec.name] = told
    return traffic


def _utc(seconds: float | None) -> str | None:
    if seconds is None:
        return None
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
