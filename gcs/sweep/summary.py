"""From a sweep's table to its summary: rates, medians, intervals, and the runs to look at."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ...scenarios.schema import Goto, Scenario
from ..report.outcome import TIMED_OUT
from ..report.plain import plain
from .columns import JUDGED
from .intervals import LEVEL, Median, Rate, median, wilson
from .plan import Plan

if TYPE_CHECKING:
    import pyarrow as pa

SCHEMA = 1
WORST = 10  # runs that the summary names
FAILURES = 20  # reasons

_FIGURES = ("last_arrival_s", "max_path_ratio", "max_rmse_m", "duration_s")
_ASSERTIONS = "assertions_failed"

Column = npt.NDArray[Any]


class Summary:
    """The table of a complete sweep, and what it comes to."""

    def __init__(self, plan: Plan, points: Sequence[Scenario], table: "pa.Table") -> None:
        self.plan = plan
        self._goes = [any(isinstance(s.path, Goto) for s in p.robots) for p in points]
        self._table = table
        self._columns: dict[str, Column] = {}
        self.judged = np.isin(self._column("exit_code"), JUDGED)
        self.metrics = [
            *(n for n in table.column_names if n.startswith("min_separation_")),
            *_FIGURES,
        ]

    @property
    def failed(self) -> int:
        """Return how many runs have no verdict."""
        return int((~self.judged).sum())

    def rates(self, point: int) -> dict[str, Rate]:
        """Return how often what happened, among the runs of a grid point that were judged."""
        what = {
            "passed": self._of(point, "passed").astype(bool),
            "collided": self._of(point, "collisions") > 0,
            "all_arrived": self._of(point, "all_arrived").astype(bool),
            "timed_out": self._of(point, "exit_code") == TIMED_OUT,
        }
        return {name: wilson(int(hits.sum()), len(hits)) for name, hits in what.items()}

    def values(self, point: int, metric: str) -> Column:
        """Return what judged runs of a grid point measured; an arrival that never was is inf."""
        values = self._of(point, metric).astype(float)
        if metric == "last_arrival_s" and self._goes[point]:
            return np.where(np.isnan(values), np.inf, values)
        return values[~np.isnan(values)]

    def medians(self, point: int) -> dict[str, Median]:
        """Return the medians of a grid point by metric, of those that were measured."""
        found = {name: median(self.values(point, name).tolist()) for name in self.metrics}
        return {name: each for name, each in found.items() if each.n}

    def worst(self) -> Iterator[tuple[int, str]]:
        """Yield rows to look at and why: collisions first, then what did not pass.

        Every grid point has its worst before any has its second; of runs that passed only the
        nearest one is named.
        """
        collisions, separation = self._column("collisions"), self._column("min_separation_m")
        nearness = np.where(np.isnan(separation), np.inf, separation)
        passed = self._column("passed").astype(bool)
        order = np.lexsort((nearness, passed, -np.nan_to_num(collisions)))
        order = order[self.judged[order]]
        for row in self._in_turn(order[~passed[order]])[:WORST]:
            if collisions[row] > 0:
                yield row, _count(int(collisions[row]), "collision")
            else:
                yield row, self._text("error", row) or f"failed: {self._text(_ASSERTIONS, row)}"
        near = order[passed[order] & np.isfinite(nearness[order])]
        if len(near):
            row = int(near[np.argmin(nearness[near])])
            yield row, f"nearest of those that passed, {nearness[row]:.3f} m"

    def _in_turn(self, rows: Column) -> list[int]:
        """Return rows with the first of every grid point first, then every second one."""
        seen: Counter[int] = Counter()
        turns = []
        for row in rows.tolist():
            point = row % self.plan.points
            turns.append((seen[point], row))
            seen[point] += 1
        return [row for _, row in sorted(turns, key=lambda turn: turn[0])]

    def as_json(self, source: str) -> dict[str, Any]:
        """Return summary.json; `source` is what `mavherd run` takes to repeat a run."""
        plan = self.plan
        failures = np.flatnonzero(~self.judged)
        tree = {
            "schema": SCHEMA,
            "scenario": plan.scenario,
            "version": plan.version,
            "mode": plan.mode,
            "runs": plan.runs,
            "failed": len(failures),
            "level": LEVEL,
            "intervals": {
                "rates": "Wilson score",
                "medians": "order statistics (sign test), at least the level",
            },
            "grid": {axis.key: list(axis.values) for axis in plan.grid},
            "points": [self._point(point) for point in range(plan.points)],
            "worst": [self._look(row, why, source) for row, why in self.worst()],
            "failures": self._failures(failures.tolist(), source),
            "run_wall_s": float(np.nansum(self._column("wall_s"))),
        }
        return dict(plain(tree))

    def _point(self, point: int) -> dict[str, Any]:
        judged = self.judged[point :: self.plan.points]
        return {
            "set": self.plan.settings(point),
            "runs": len(judged),
            "failed": int((~judged).sum()),
            "rates": {name: rate._asdict() for name, rate in self.rates(point).items()},
            "medians": {
                name: each._asdict() | {"never": int(np.isinf(self.values(point, name)).sum())}
                for name, each in self.medians(point).items()
            },
        }

    def _failures(self, rows: Sequence[int], source: str) -> list[dict[str, Any]]:
        """Return the first run that failed for each reason, and how many did."""
        reasons: dict[str, list[int]] = {}
        for row in rows:
            reasons.setdefault(self._text("error", row), []).append(row)
        return [
            self._look(mine[0], why, source) | {"runs": len(mine)}
            for why, mine in list(reasons.items())[:FAILURES]
        ]

    def _look(self, row: int, why: str, source: str) -> dict[str, Any]:
        job = self.plan.job(row)
        return {
            "run": row,
            "set": self.plan.settings(job.point),
            "seed": job.seed,
            "why": why,
            "digest": self._text("digest", row),
            "command": self.plan.command(job.point, job.seed, source),
        }

    def _text(self, name: str, row: int) -> str:
        """Return a text of the table, empty for null."""
        return self._table[name][row].as_py() or ""

    def _of(self, point: int, name: str) -> Column:
        """Return a column of the judged runs of a grid point: every so many rows is one of them."""
        column: Column = self._column(name)[point :: self.plan.points]
        return column[self.judged[point :: self.plan.points]]

    def _column(self, name: str) -> Column:
        if name not in self._columns:
            self._columns[name] = self._table[name].to_numpy()
        return self._columns[name]


def _count(n: int, word: str) -> str:
    return f"{n} {word}{'s' * (n > 1)}"
