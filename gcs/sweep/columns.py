"""The columns of a sweep's table, and the row that a run's report makes."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ...scenarios.schema import Goto, RobotSpec, Scenario
from ...scenarios.source import parse
from ..report.contact import CLASSES
from ..report.outcome import FAILED, PASSED, TIMED_OUT
from .grid import Axis
from .plan import Job, Plan

Row = dict[str, Any]

JUDGED = (PASSED, FAILED, TIMED_OUT)  # exit codes of runs that say something about the robots


class Column(NamedTuple):
    """One column: its name, with the unit, and what it holds."""

    name: str
    kind: str  # int | float | bool | text


def columns(plan: Plan, points: Sequence[Scenario]) -> list[Column]:
    """Return the columns of a sweep: those of every table, then some per class and robot.

    A robot or class that some grid points lack is null there.
    """
    classes = _classes(points)
    return [
        Column("run", "int"),
        Column("seed", "int"),
        *(Column(axis.key, _kind(axis)) for axis in plan.grid),
        Column("passed", "bool"),
        Column("exit_code", "int"),
        Column("error", "text"),
        Column("assertions_failed", "text"),  # their names; null when none has
        Column("collisions", "int"),
        *(Column(f"collisions_{name}", "int") for name in classes),
        Column("min_separation_m", "float"),
        *(Column(f"min_separation_{name}_m", "float") for name in classes),
        Column("all_arrived", "bool"),
        Column("arrived", "int"),  # robots that got where they should
        Column("last_arrival_s", "float"),  # of those with a `goto`; null when one did not arrive
        Column("max_path_ratio", "float"),
        Column("max_rmse_m", "float"),
        Column("ready_s", "float"),
        Column("duration_s", "float"),
        Column("wall_s", "float"),
        Column("digest", "text"),
        *(Column(name, "float") for name in _robot_columns(points)),
    ]


def _classes(points: Sequence[Scenario]) -> list[str]:
    """Return the classes of pairs that any grid point has, as words of a column's name."""
    found = set()
    for scenario in points:
        kinds = [spec.kind for spec in scenario.robots]
        found |= {f"{kind}-{kind}" for kind in kinds if kinds.count(kind) > 1}
        found |= {"mixed"} if len(set(kinds)) > 1 else set()
    return [_word(name) for name in CLASSES if name in found]


def _word(pair_class: str) -> str:
    return pair_class.replace("-", "_")


def _robot_columns(points: Sequence[Scenario]) -> list[str]:
    """Return each robot's columns: when it arrived, or how well it tracked."""
    names = (_robot_column(spec) for scenario in points for spec in scenario.robots)
    return list(dict.fromkeys(names))


def _robot_column(spec: RobotSpec) -> str:
    goes = isinstance(spec.path, Goto)
    return f"arrival_{spec.name}_s" if goes else f"rmse_{spec.name}_m"


def _kind(axis: Axis) -> str:
    """Return what a column of this axis holds: numbers only when all values are numbers."""
    values = [parse(text, axis.key).value for text in axis.values]
    if all(type(value) is int and abs(value) < 2**63 for value in values):
        return "int"
    numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
    return "float" if numbers else "text"


def settings_row(plan: Plan, kinds: Mapping[str, str], job: Job) -> Row:
    """Return what is known of a run before it: its number, seed and settings."""
    settings: Row = {"run": job.number, "seed": job.seed}
    for key, text in plan.settings(job.point).items():
        settings[key] = text if kinds[key] == "text" else _number(text, kinds[key])
    return settings


def _number(text: str, kind: str) -> float:
    value = parse(text, "a number").value
    assert isinstance(value, int | float)  # noqa: S101 - as _kind has seen
    return value if kind == "int" else float(value)


def failed_row(error: str, exit_code: int) -> Row:
    """Return the row of a run that ended without a report."""
    return {"passed": False, "exit_code": exit_code, "error": error}


def result_row(scenario: Scenario, report: Mapping[str, Any]) -> Row:
    """Return what a report says, as far as the table has columns for it.

    Of a run that was not judged (a vehicle was lost) only the error counts.
    """
    if report["exit_code"] not in JUDGED:
        return failed_row(report["error"] or "no reason given", report["exit_code"])
    robots = {robot["name"]: robot for robot in report["robots"]}
    failed = [each["name"] for each in report["assertions"] if not each["passed"]]
    going = [spec.name for spec in scenario.robots if isinstance(spec.path, Goto)]
    row: Row = {
        "passed": report["passed"],
        "exit_code": report["exit_code"],
        "error": report["error"],
        "assertions_failed": ", ".join(failed) or None,
        "collisions": report["collisions"],
        "min_separation_m": report["min_separation_m"],
        "all_arrived": report["all_arrived"],
        "arrived": sum(robot["arrived"] is True for robot in robots.values()),
        "last_arrival_s": _last([robots[name]["arrival_s"] for name in going]),
        "max_path_ratio": _largest(robot["path_ratio"] for robot in robots.values()),
        "max_rmse_m": _largest(robot["tracking_rmse_m"] for robot in robots.values()),
        "ready_s": report["ready_at_s"],
        "duration_s": report["duration_s"],
        "digest": report["digest"],
    }
    for each in report["classes"]:
        name = _word(each["class"])
        row[f"collisions_{name}"] = each["collisions"]
        row[f"min_separation_{name}_m"] = each["min_separation_m"]
    for spec in scenario.robots:
        key = "arrival_s" if isinstance(spec.path, Goto) else "tracking_rmse_m"
        row[_robot_column(spec)] = robots[spec.name][key]
    return row


def _last(times: Sequence[float | None]) -> float | None:
    known = [time for time in times if time is not None]
    return max(known) if known and len(known) == len(times) else None


def _largest(values: Any) -> float | None:
    return max((value for value in values if value is not None), default=None)
