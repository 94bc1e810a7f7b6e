"""The numbers that runs are compared by, out of their reports."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from ..report.outcome import broken_off

Report = Mapping[str, Any]
LOW, HIGH = "low", "high"


class Measure(NamedTuple):
    """One number of a run: what it is called, its unit, and which end of it is the better one."""

    key: str
    head: str
    unit: str
    digits: int
    better: str  # low | high | "" where neither is
    of: Callable[[Report], float | None]
    is_cost: bool = False  # of the work: who does not do it, or collides, does it cheaply


class Standing(NamedTuple):
    """A measure of all runs, and the places of the best and the worst among them."""

    measure: Measure
    values: tuple[float | None, ...]
    best: frozenset[int]
    worst: frozenset[int]


def standings(reports: Sequence[Report], *, alike: bool = True) -> list[Standing]:
    """Return every measure that at least one run has; nobody is best where runs are not alike.

    Ranked are whole runs that came to their end, and the best is one in which all arrived. By
    what the work has cost, only runs are ranked in which all arrived without a collision.
    """
    fair = (not (r["partial"] or was_cut_short(r)) for r in reports)
    whole = frozenset(k for k, is_fair in enumerate(fair) if alike and is_fair)
    done = frozenset(k for k in whole if reports[k]["all_arrived"])
    clean = frozenset(k for k in done if not reports[k]["collisions"])
    found = []
    for measure in MEASURES:
        values = tuple(measure.of(report) for report in reports)
        if any(value is not None for value in values):
            among = (clean, clean) if measure.is_cost else (whole, done)
            found.append(Standing(measure, values, *_ends(values, measure, *among)))
    return found


def was_cut_short(report: Report) -> bool:
    """Return whether a run has not come to its own end: somebody ended it, or it died."""
    return broken_off(report["error"], report["exit_code"])


def _ends(
    values: Sequence[float | None], measure: Measure, ranked: frozenset[int], done: frozenset[int]
) -> tuple[frozenset[int], frozenset[int]]:
    """Return who of `done` is best and who of `ranked` is worst, as far as the digits shown tell.

    What more than half of them are is nothing to be marked.
    """
    known = {k: round(v, measure.digits) for k in ranked if (v := values[k]) is not None}
    ends = set(known.values())
    if not measure.better or len(ends) < 2:
        return frozenset(), frozenset()
    first, last = (min, max) if measure.better == LOW else (max, min)
    end = last(ends)
    worst = frozenset(k for k, value in known.items() if value == end)
    top = first((known[k] for k in done & known.keys()), default=end)
    best = frozenset(k for k in done & known.keys() if known[k] == top != end)
    few = [who if 2 * len(who) <= len(known) else frozenset[int]() for who in (best, worst)]
    return few[0], few[1] if len(known) > 2 else frozenset()


def _top(key: str) -> Callable[[Report], float | None]:
    return lambda report: report.get(key)


def _fleet(key: str) -> Callable[[Report], float | None]:
    return lambda report: (report.get("fleet") or {}).get(key)


def _cpu(key: str) -> Callable[[Report], float | None]:
    return lambda report: (report.get("cpu") or {}).get(key)


def _nearest(label: str) -> Callable[[Report], float | None]:
    def of(report: Report) -> float | None:
        mine = [c["min_separation_m"] for c in report["classes"] if c["class"] == label]
        return min((m for m in mine if m is not None), default=None)

    return of


def _arrived(report: Report) -> float | None:
    """Return how many robots have come where they should; None when none had to."""
    told = [robot["arrived"] for robot in report["robots"] if robot["arrived"] is not None]
    return float(sum(told)) if told else None


def _last_arrival(report: Report) -> float | None:
    """Return when the last robot had arrived; None when not all did."""
    return _fleet("last_arrival_s")(report) if report.get("all_arrived") else None


MEASURES = (
    Measure("collisions", "collisions", "", 0, LOW, _top("collisions")),
    Measure("nearest_rovers", "nearest two rovers", "m", 2, HIGH, _nearest("rover-rover")),
    Measure("nearest_quads", "nearest two quads", "m", 2, HIGH, _nearest("quadcopter-quadcopter")),
    Measure("nearest_mixed", "nearest rover to quad", "m", 2, HIGH, _nearest("mixed")),
    Measure("arrived", "arrived", "", 0, HIGH, _arrived),
    Measure("last_arrival_s", "last arrival", "s", 1, LOW, _last_arrival, is_cost=True),
    Measure("path_ratio", "path-length ratio", "", 2, LOW, _fleet("path_ratio_mean"), is_cost=True),
    Measure(
        "tracking_rmse_m", "worst RMSE", "m", 3, LOW, _fleet("tracking_rmse_max_m"), is_cost=True
    ),
    Measure(
        "control_effort",
        "control effort",
        "m²/s³",
        1,
        LOW,
        _fleet("control_effort_m2_s3"),
        is_cost=True,
    ),
    Measure("deadlock_s", "deadlock", "s", 1, LOW, _fleet("deadlock_any_s")),
    Measure(
        "setpoint_gap_s", "longest setpoint gap", "s", 2, LOW, _fleet("setpoint_longest_gap_s")
    ),
    Measure("lost_frames", "lost frames", "", 0, LOW, _fleet("lost_frames")),
    Measure("duration_s", "fleet time", "s", 1, "", _top("duration_s")),
    Measure("late_ticks", "late ticks", "", 0, LOW, _top("late_ticks")),
    Measure("cpu_s", "CPU", "s", 1, "", _cpu("total_s")),
    Measure("real_time_factor", "real-time factor", "x", 1, "", _top("real_time_factor")),
)
