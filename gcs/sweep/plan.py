"""What a sweep shall run: the scenario, what is fixed, the grid, the seeds; numbered runs."""

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import prod
from pathlib import Path
from shlex import join
from typing import Any, NamedTuple

from ... import __version__
from ...scenarios.loader import load_scenario, scenario_to_yaml
from ...scenarios.schema import Scenario
from ...transport.errors import MavherdError
from ..safety.permission import external
from ..team.coordinator import check_laws
from .grid import MAX_POINTS, MAX_RUNS, Axis, read_seeds, seeds_text

SCHEMA = 1
IN_PROCESS, PROCESSES = "in-process", "processes"


class Job(NamedTuple):
    """One run of a sweep."""

    number: int
    point: int  # of the grid
    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """Everything that decides what a sweep's runs are; two equal plans give the same rows.

    Run `number` is of grid point `number % points`: every point gets its first seed, then every
    point its second one, so that a sweep under way can be looked at.
    """

    scenario: str  # a shipped name or a file, as typed
    sets: tuple[str, ...] = ()  # KEY=VALUE for all runs
    grid: tuple[Axis, ...] = ()
    seeds: tuple[int, ...]
    mode: str = IN_PROCESS
    version: str = __version__
    fingerprint: str = ""  # of all grid points as resolved

    @property
    def points(self) -> int:
        """Return how many points the grid has."""
        return prod(len(axis.values) for axis in self.grid)

    @property
    def runs(self) -> int:
        """Return how many runs there are."""
        return self.points * len(self.seeds)

    def job(self, number: int) -> Job:
        """Return one of the runs."""
        return Job(number, number % self.points, self.seeds[number // self.points])

    def settings(self, point: int) -> dict[str, str]:
        """Return the values of one grid point by key, in YAML; the last key changes fastest."""
        found: dict[str, str] = {}
        for key, values in reversed(self.grid):
            point, which = divmod(point, len(values))
            found[key] = values[which]
        return dict(reversed(found.items()))

    def overrides(self, point: int) -> list[str]:
        """Return what `--set` says for one grid point."""
        return [*self.sets, *(f"{key}={value}" for key, value in self.settings(point).items())]

    def command(self, point: int, seed: int, source: str) -> str:
        """Return the command line that repeats one run, of the scenario in `source`."""
        sets = [word for text in self.overrides(point) for word in ("--set", text)]
        return join(["mavherd", "run", source, "--seed", str(seed), *sets])


def check_size(plan: Plan) -> None:
    """Refuse what is too large to be meant."""
    if plan.points > MAX_POINTS:
        sizes = " x ".join(str(len(axis.values)) for axis in plan.grid)
        raise MavherdError(f"--set: {sizes} = {plan.points:,} grid points (at most {MAX_POINTS:,})")
    if plan.runs > MAX_RUNS:
        raise MavherdError(
            f"{plan.points:,} grid points x {len(plan.seeds):,} seeds = {plan.runs:,} runs"
            f" (at most {MAX_RUNS:,})"
        )


def load_points(
    plan: Plan, source: str | Path, told: Callable[[int], None] = lambda done: None
) -> tuple[Scenario, ...]:
    """Return the scenario of every grid point; raise MavherdError for the first that cannot run."""
    points: dict[bytes, Scenario] = {}
    for point in range(plan.points):
        scenario = load_scenario(source, plan.overrides(point), plan.seeds[0])
        check_laws(scenario)
        if others := ", ".join(external(scenario)):
            raise MavherdError(
                f"{scenario.name}: {others}: external vehicles follow a clock of their own and"
                " cannot be swept (leave out `connect`)"
            )
        if (digest := _digest(scenario)) in points:
            said = ", ".join(f"{key}={value}" for key, value in plan.settings(point).items())
            raise MavherdError(
                f"--set: {said} is the same scenario as another grid point (leave one out)"
            )
        points[digest] = scenario
        told(point + 1)
    return tuple(points.values())


def fingerprint(points: Sequence[Scenario]) -> str:
    """Return a digest that is another one when any grid point is."""
    return hashlib.sha256(b"".join(map(_digest, points))).hexdigest()


def _digest(scenario: Scenario) -> bytes:
    return hashlib.sha256(repr(scenario).encode()).digest()


def plan_to_json(plan: Plan, points: Sequence[Scenario]) -> str:
    """Return what sweep.json holds."""
    tree = {
        "schema": SCHEMA,
        "version": plan.version,
        "scenario": plan.scenario,
        "mode": plan.mode,
        "set": list(plan.sets),
        "grid": {axis.key: list(axis.values) for axis in plan.grid},
        "seeds": seeds_text(plan.seeds),
        "points": plan.points,
        "runs": plan.runs,
        "fingerprint": plan.fingerprint,
        "resolved": scenario_to_yaml(points[0]),  # the first point, its first seed
    }
    return json.dumps(tree, indent=2) + "\n"


def plan_from_json(text: str, where: Path) -> Plan:
    """Return the plan that sweep.json holds."""
    try:
        tree: dict[str, Any] = json.loads(text)
        if tree["schema"] != SCHEMA:
            raise MavherdError(
                f"{where}: of another version of mavherd, {tree['version']} (we are {__version__})"
            )
        return Plan(
            scenario=tree["scenario"],
            sets=tuple(tree["set"]),
            grid=tuple(Axis(key, tuple(values)) for key, values in tree["grid"].items()),
            seeds=read_seeds(tree["seeds"]),
            mode=tree["mode"],
            version=tree["version"],
            fingerprint=tree["fingerprint"],
        )
    except (ValueError, KeyError, TypeError, AttributeError):
        raise MavherdError(f"{where}: not one of mavherd's plans") from None


def difference(old: Plan, new: Plan) -> str:
    """Return in what a plan is another one than that of a folder, or nothing."""
    return next(_differences(old, new), "")


def _differences(old: Plan, new: Plan) -> Iterator[str]:
    same = old.fingerprint == new.fingerprint  # then it matters not how it was called
    for what, there, here in (
        ("version", old.version, new.version),
        ("scenario", old.scenario, old.scenario if same else new.scenario),
        ("mode", old.mode, new.mode),
        ("--set", " ".join(old.sets) or "nothing", " ".join(new.sets) or "nothing"),
    ):
        if there != here:
            yield f"{what} is {here}, not {there}"
    before, now = dict(old.grid), dict(new.grid)
    for key in [*before, *(k for k in now if k not in before)]:
        there, here = (",".join(grid.get(key, ())) for grid in (before, now))
        if there != here:
            yield f"--set {key} is {here or 'not varied'}, not {there or 'fixed'}"
    if list(before) != list(now):
        yield f"the grid's order is {', '.join(now)}, not {', '.join(before)}"
    if old.seeds != new.seeds:
        yield f"--seeds is {seeds_text(new.seeds)}, not {seeds_text(old.seeds)}"
    if old.fingerprint != new.fingerprint:
        yield "the scenario itself has changed since"
