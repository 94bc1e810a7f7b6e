"""The report of a run: `report.json` for programs, `report.html` for people, states, figures."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ...scenarios.schema import RobotSpec, Scenario
from .contact import Collision, Pair
from .judge import ClassResult, RobotResult, Verdict
from .page import page
from .plain import plain
from .states import write_states
from .truth import Track

SCHEMA = 1
MAX_PAIRS = 200  # in the report; the nearest ones, of all


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFacts:
    """How a run went, apart from what the robots did."""

    run_id: str
    seed: int
    law: str
    lockstep: bool
    speed: float | None  # asked for; None: as fast as it goes
    duration_s: float  # simulated
    wall_s: float
    real_time_factor: float
    digest: str | None
    outside_clients: int = 0
    partial: bool = False  # something is missing from the run folder
    ticks: int = 0
    late_ticks: int = 0
    error: str | None = None
    exit_code: int = 0
    version: str = ""  # of mavherd
    compiled: str = ""  # whether its hot modules are, for people
    python: str = ""
    platform: str = ""
    ports: Mapping[str, Any] = field(default_factory=dict)


def build_report(scenario: Scenario, verdict: Verdict, facts: RunFacts) -> dict[str, Any]:
    """Return the report as plain data that is valid JSON: what is unknown is None."""
    pairs = sorted(
        verdict.pairs,
        key=lambda p: math.inf if p.min_separation is None else p.min_separation,
    )
    report = {
        "schema": SCHEMA,
        "run_id": facts.run_id,
        "scenario": scenario.name,
        "description": scenario.description,
        "seed": facts.seed,
        "law": facts.law,
        "passed": verdict.passed and facts.error is None and facts.exit_code == 0,
        "exit_code": facts.exit_code,
        "error": facts.error,
        "assertions": [assertion._asdict() for assertion in verdict.assertions],
        "collisions": len(verdict.collisions),
        "collision_events": [_collision(c) for c in verdict.collisions],
        "min_separation_m": verdict.min_separation,
        "all_arrived": verdict.all_arrived,
        "ready_at_s": verdict.ready_at,
        "ended_at_s": verdict.ended_at,
        "robots": [_robot(r) for r in verdict.robots],
        "classes": [_class(c) for c in verdict.classes],
        "pairs": [_pair(p) for p in pairs[:MAX_PAIRS]],
        "pairs_total": len(pairs),
        "lockstep": facts.lockstep,
        "speed": facts.speed,
        "duration_s": facts.duration_s,
        "wall_s": facts.wall_s,
        "real_time_factor": facts.real_time_factor,
        "ticks": facts.ticks,
        "late_ticks": facts.late_ticks,
        "digest": facts.digest,
        "outside_clients": facts.outside_clients,
        "partial": facts.partial,
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
) -> list[str]:
    """Write report.json first, then states, figures and report.html; return lines for the user.

    Every file appears under its name when it is complete.
    """
    _write(folder / "report.json", dump_report(report))
    states = write_states(folder, tracks)
    notes = [] if states.suffix == ".parquet" else ["pyarrow is missing, so states.npz only"]
    pictures: list[Path] = []
    if find_spec("matplotlib") is None:
        notes.append("matplotlib is missing, so no figures")
    elif figures:
        from .figures import draw

        pictures = draw(folder / "figures", scenario, starts, tracks, verdict)
    _write(folder / "report.html", page(report, pictures))
    return [f"{'; '.join(notes)} (pip install 'mavherd[view]')"] if notes else []


def _write(path: Path, text: str) -> None:
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)


def _collision(c: Collision) -> dict[str, Any]:
    east, north, up = c.position
    return {
        "time_s": c.time,
        "robots": list(c.names),
        "class": c.pair_class,
        "east_m": east,
        "north_m": north,
        "up_m": up,
    }


def _pair(p: Pair) -> dict[str, Any]:
    return {
        "robots": list(p.names),
        "class": p.pair_class,
        "min_separation_m": p.min_separation,
        "contact_m": p.contact,
        "time_s": p.time,
    }


def _class(c: ClassResult) -> dict[str, Any]:
    return {
        "class": c.pair_class,
        "pairs": c.pairs,
        "collisions": c.collisions,
        "min_separation_m": c.nearest and c.nearest.min_separation,
        "contact_m": c.contact,
        "robots": list(c.nearest.names) if c.nearest else None,
        "time_s": c.nearest and c.nearest.time,
    }


def _robot(r: RobotResult) -> dict[str, Any]:
    return {
        "name": r.name,
        "kind": r.kind,
        "system_id": r.system_id,
        "goal": r.goal,
        "arrived": r.arrived,
        "arrival_s": r.arrival,
        "miss_m": r.miss,
        "path_ratio": r.path_ratio,
        "tracking_rmse_m": r.rmse,
        "nearest": r.nearest,
        "nearest_separation_m": r.nearest_separation,
        "source": r.source,
    }
