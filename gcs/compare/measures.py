"""The numbers that runs are compared by, out of their reports."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

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


class Standing(NamedTuple):
    """A measure of all runs, and the places of the best and the worst among them."""

    measure: Measure
    values: tuple[float | None, ...]
    best: frozenset[int]
    worst: frozenset[int]


def standings(reports: Sequence[Report], *, alike: bool = True) -> list[Standing]:
    """Return every measure that at least one run has; nobody is best where runs are not alike."""
    found = []
    for measure in MEASURES:
        values = tuple(measure.of(report) for report in reports)
        if any(value is not None for value in values):
            ends = _ends(values, measure) if alike else (frozenset[int](), frozenset[int]())
            found.append(Standing(measure, values, *ends))
    return found


def _ends(
    values: Sequence[float | None], measure: Measure
) -> tuple[frozenset[int], frozenset[int]]:
    """Return who is best and who is worst, as far as the digits that are shown tell them apart.

    What more than half of them are is nothing to be marked.
    """
    shown = [None if value is None else round(value, measure.digits) for value in values]
    known = [value for value in shown if value is not None]
    if not measure.better or len(set(known)) < 2:
        return frozenset(), frozenset()
    low, high = min(known), max(known)
    best, worst = (low, high) if measure.better == LOW else (high, low)
    ends = [frozenset(k for k, v in enumerate(shown) if v == end) for end in (best, worst)]
    few = [who if 2 * len(who) <= len(known) else frozenset[int]() for who in ends]
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
    Measure("last_arrival_s", "last arrival", "s", 1, LOW, _last_arrival),
    Measure("path_ratio", "way, of planned", "", 2, LOW, _fleet("path_ratio_mean")),
    Measure("tracking_rmse_m", "worst RMSE", "m", 3, LOW, _fleet("tracking_rmse_max_m")),
    Measure("control_effort", "control effort", "m²/s³", 1, LOW, _fleet("control_effort_m2_s3")),
    Measure("deadlock_s", "deadlock", "s", 1, LOW, _fleet("deadlock_any_s")),
    Measure(
        "setpoint_gap_s", "longest setpoint gap", "s", 2, LOW, _fleet("setpoint_longest_gap_s")
    ),
    Measure("lost_frames", "lost frames", "", 0, LOW, _fleet("lost_frames")),
    Measure("duration_s", "simulated", "s", 1, "", _top("duration_s")),
    Measure("late_ticks", "late ticks", "", 0, LOW, _top("late_ticks")),
    Measure("cpu_s", "CPU", "s", 1, "", _cpu("total_s")),
    Measure("real_time_factor", "real-time factor", "x", 1, "", _top("real_time_factor")),
)
