"""The table that a run ends with: how it went, and where to look further."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from shlex import quote
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

MAX_ROBOTS = 24  # lines; the report has all


def summary_table(report: Mapping[str, Any], folder: Path | None = None) -> RenderableType:
    """Return the verdict, what was asserted, a line per robot, the numbers, where to look."""
    return Group(*_verdict(report), *_robots(report), *_numbers(report), *_look(report, folder))


def _verdict(r: Mapping[str, Any]) -> Iterator[RenderableType]:
    word = Text(" PASS " if r["passed"] else " FAIL ", style="bold reverse " + _tone(r["passed"]))
    yield Text.assemble(word, f" {r['scenario']}  ", (f"law {r['law']}, seed {r['seed']}", "dim"))
    for a in r["assertions"]:
        mark = Text("  ok   " if a["passed"] else "  FAIL ", style=_tone(a["passed"]))
        yield Text.assemble(mark, a["text"])


def _robots(r: Mapping[str, Any]) -> Iterator[RenderableType]:
    robots = r["robots"]
    if len(robots) > MAX_ROBOTS:  # first those for whom it went worst
        robots = sorted(
            robots,
            key=lambda x: (x["arrived"] is not False, _or(x["nearest_separation_m"], 1e9)),
        )
    table = _table()
    table.add_column("robot", no_wrap=True)
    for head in ("arrived s", "miss m", "RMSE m", "nearest m"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("to", no_wrap=True)
    for x in robots[:MAX_ROBOTS]:
        table.add_row(
            x["name"] + ("*" if x["source"] == "telemetry" else ""),
            _arrival(x),
            _number(x["miss_m"], 2),
            _number(x["tracking_rmse_m"], 3),
            _number(x["nearest_separation_m"], 2),
            x["nearest"] or "-",
        )
    yield table
    if len(robots) > MAX_ROBOTS:
        yield Text(f"and {len(robots) - MAX_ROBOTS} more, in report.json", style="dim")
    if any(x["source"] == "telemetry" for x in robots):
        yield Text("* external: judged by its own telemetry, not by truth", style="dim")


def _arrival(x: Mapping[str, Any]) -> Text:
    if x["arrived"] is False:
        return Text("no", style="red")
    if x["arrival_s"] is not None:
        return Text(f"{x['arrival_s']:.1f}")
    return Text("yes" if x["arrived"] else "-")


def _numbers(r: Mapping[str, Any]) -> Iterator[RenderableType]:
    collisions = Text(f"{r['collisions']}", style=_tone(not r["collisions"]))
    near = _number(r["min_separation_m"], 2)
    yield Text.assemble(
        "collisions ",
        collisions,
        f"  nearest {near} m  {r['duration_s']:.1f} s simulated in {r['wall_s']:.1f} s ",
        f"({r['real_time_factor']:.1f}x)" if r["real_time_factor"] is not None else "",
    )
    if r["late_ticks"]:
        yield Text(f"{r['late_ticks']} of {r['ticks']} ticks late", style="yellow")
    if r["outside_clients"]:
        n = r["outside_clients"]
        yield Text(f"{n} outside client{'s' * (n > 1)} took part", style="yellow")
    if r["partial"]:
        yield Text("partial: some files are missing or incomplete", style="yellow")
    if r["digest"]:
        yield Text(f"digest {r['digest'][:16]}", style="dim")


def _look(r: Mapping[str, Any], folder: Path | None) -> Iterator[RenderableType]:
    where = folder or Path(r["run_id"])
    yield Text(f"report     {where / 'report.html'}", no_wrap=True, overflow="ignore")
    if folder is None or (folder / "run.rrd").exists():
        yield Text(
            f"recording  rerun {quote(str(where / 'run.rrd'))}", no_wrap=True, overflow="ignore"
        )


def _table() -> Table:
    return Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="dim")


def _tone(good: bool) -> str:
    return "green" if good else "red"


def _or(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
