"""The report of a run: `report.json` for programs, `report.html` for people, states, figures."""

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ...scenarios.schema import RobotSpec, Scenario
from ..complaint import INSTALL
from ..flown.events import read_events
from ..flown.folder import REPORT_SCHEMA as SCHEMA
from ..new_file import write_text
from .costs import NOTHING, Costs
from .judge import Verdict
from .page import FIGURES, page
from .plain import plain
from .rows import class_row, collision_row, cpu_row, fleet_row, pair_row, robot_row
from .states import write_events, write_states
from .traffic import Traffic
from .truth import Track

MAX_PAIRS = 300  # in the report; the nearest ones, and all of 24 robots


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFacts:
    """How a run went, apart from what the robots did."""

    run_id: str
    seed: int
    law: str
    lockstep: bool
    speed: float | None  # asked for; None: as fast as it goes
    duration_s: float  # of fleet time
    wall_s: float
    real_time_factor: float
    digest: str | None
    outside_clients: int = 0
    script: bool | None = False  # whether one steered; None: not known
    missing: Sequence[str] = ()  # from the run folder, a line for each thing
    ticks: int = 0
    late_ticks: int = 0
    error: str | None = None
    exit_code: int = 0
    version: str = ""  # of mavherd
    compiled: str = ""  # whether its hot modules are, for people
    python: str = ""
    platform: str = ""
    started_at: str | None = None  # UTC, ISO 8601
    in_process: bool = False
    ports: Mapping[str, Any] = field(default_factory=dict)
    traffic: Mapping[str, Traffic] = field(default_factory=dict)  # by robot, of those with a tlog
    costs: Costs = NOTHING


def build_report(scenario: Scenario, verdict: Verdict, facts: RunFacts) -> dict[str, Any]:
    """Return the report as plain data that is valid JSON: what is unknown is None."""
    pairs = sorted(
        verdict.pairs,
        key=lambda p: math.inf if p.min_separation is None else p.min_separation,
    )
    report = {
        "schema": SCHEMA,
        "run_id": facts.run_id,
        "started_at": facts.started_at,
        "scenario": scenario.name,
        "description": scenario.description,
        "seed": facts.seed,
        "law": facts.law,
        "passed": verdict.passed and facts.error is None and facts.exit_code == 0,
        "exit_code": facts.exit_code,
        "error": facts.error,
        "assertions": [assertion._asdict() for assertion in verdict.assertions],
        "collisions": len(verdict.collisions),
        "collision_events": [collision_row(c) for c in verdict.collisions],
        "min_separation_m": verdict.min_separation,
        "all_arrived": verdict.all_arrived,
        "ready_at_s": verdict.ready_at,
        "ended_at_s": verdict.ended_at,
        "fleet": fleet_row(verdict, facts.traffic),
        "robots": [
            robot_row(r, facts.traffic.get(r.name), facts.costs.by_vehicle.get(r.name))
            for r in verdict.robots
        ],
        "classes": [class_row(c) for c in verdict.classes],
        "pairs": [pair_row(p) for p in pairs[:MAX_PAIRS]],
        "pairs_total": len(pairs),
        "lockstep": facts.lockstep,
        "speed": facts.speed,
        "in_process": facts.in_process,
        "duration_s": facts.duration_s,
        "wall_s": facts.wall_s,
        "real_time_factor": facts.real_time_factor,
        "cpu": cpu_row(facts.costs),
        "ticks": facts.ticks,
        "late_ticks": facts.late_ticks,
        "digest": facts.digest,
        "outside_clients": facts.outside_clients,
        "script": facts.script,
        "partial": bool(facts.missing),
        "missing": list(facts.missing),
        "version": facts.version,
        "compiled": facts.compiled,
        "python": facts.python,
        "platform": facts.platform,
        "ports": facts.ports,
    }
    return dict(plain(report))


def dump_report(report: Mapping[str, Any]) -> str:
    """Return the report as strict JSON."""
    return json.dumps(report, indent=2, allow_nan=False) + "\n"


def write_report(
    folder: Path,
    report: Mapping[str, Any],
    scenario: Scenario,
    starts: Sequence[RobotSpec],
    tracks: Sequence[Track],
    verdict: Verdict,
    *,
    figures: bool = True,
    step: Callable[[str], None] = lambda _: None,
) -> list[str]:
    """Write report.json first, then tables, figures and report.html; return lines for the user.

    Every file appears under its name when it is complete. `step` is told what is being done.
    """
    step("writing the tables")
    write_text(folder / "report.json", dump_report(report))
    notes = list(_write_tables(folder, tracks, partial=report["partial"]))
    pictures: list[Path] = []
    about = ""  # the pictures, for readers of the page
    if find_spec("matplotlib") is None:
        pictures = _drawn_before(folder / "figures")
        had = f"figures are those drawn before, {_age(pictures[0])}" if pictures else "no figures"
        notes.append(f"matplotlib is missing, so {had}")
        about = f"Matplotlib is missing, so {had} ({INSTALL}, then mavherd report)."
    notes = [f"{'; '.join(notes)} ({INSTALL})"] if notes else []
    if find_spec("matplotlib") is not None and figures:
        step("drawing the figures")
        from .figures import draw

        pictures = draw(folder / "figures", scenario, starts, tracks, verdict)
        if not pictures:
            about = "None: no robot has a track."
            notes.append("no robot has a track, so no figures")
    step("writing the report")
    write_text(folder / "report.html", page(report, pictures, about))
    return notes


def _write_tables(folder: Path, tracks: Sequence[Track], *, partial: bool) -> Iterator[str]:
    """Write states and events; yield what cannot be had."""
    whole = folder / "states.parquet"
    if find_spec("pyarrow") is None and whole.exists():
        yield f"pyarrow is missing, so the tables stay those written before, {_age(whole)}"
        return
    if write_states(folder, tracks, partial=partial) != whole:
        yield "pyarrow is missing, so states.npz only"
    write_events(folder, read_events(folder).events)


def _drawn_before(folder: Path) -> list[Path]:
    return [path for name in FIGURES if (path := folder / f"{name}.png").exists()]


def _age(path: Path) -> str:
    return datetime.fromtimestamp(path.stat().st_mtime, UTC).strftime("%Y-%m-%d %H:%M UTC")
