"""The table that a run ends with: how it went, and where to look further."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from shlex import quote
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

MAX_ROBOTS = 12  # lines, so that all fits on a screen; the report has all
MAX_MISSING = 4  # likewise
INTERRUPTED = 130  # exit code
LONG_GAP_S = 0.5  # after so long without a setpoint a vehicle stops by itself
_MARKS = {
    True: Text("  ok   ", style="green"),
    False: Text("  FAIL ", style="red"),
    None: Text("  open ", style="yellow"),  # not decided
}
_RECORDINGS = "run.rrd", "run.rrd.part"


def summary_table(report: Mapping[str, Any], folder: Path | None = None) -> RenderableType:
    """Return the verdict, what was asserted, a line per robot, the numbers, where to look."""
    return Group(*_verdict(report), *_robots(report), *_numbers(report), *_look(report, folder))


def _verdict(r: Mapping[str, Any]) -> Iterator[RenderableType]:
    word, tone = "FAIL", "red"
    if r["passed"]:
        word, tone = "PASS", "green"
    elif r["exit_code"] == INTERRUPTED:
        word, tone = "INTERRUPTED", "yellow"
    settings = f"law {r['law']}, seed {r['seed']}"
    yield Text.assemble(
        (f" {word} ", f"bold reverse {tone}"), f" {r['scenario']}  ", (settings, "dim")
    )
    for a in r["assertions"]:
        mark = _MARKS[a["passed"]]
        yield Text.assemble(mark, a["text"])


def _robots(r: Mapping[str, Any]) -> Iterator[RenderableType]:
    robots = r["robots"]
    if len(robots) > MAX_ROBOTS:  # first those for whom it went worst
        robots = sorted(
            robots,
            key=lambda x: (x["arrived"] is not False, _or(x["nearest_separation_m"], 1e9)),
        )
    table = _table()
    shown = robots[:MAX_ROBOTS]
    wide = max((len(x["name"]) for x in shown), default=0)  # names stay whole, whatever does not
    tracked = any(x["tracking_rmse_m"] is not None for x in shown)
    table.add_column("robot", no_wrap=True, min_width=wide)
    for head in ("arrived s", "miss m", *(["RMSE m"] if tracked else []), "nearest m"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column(
        "to", no_wrap=True, min_width=max((len(x["nearest"] or "-") for x in shown), default=0)
    )
    for x in shown:
        table.add_row(
            x["name"] + ("*" if x["source"] == "telemetry" else ""),
            _arrival(x),
            _number(x["miss_m"], 2),
            *([_number(x["tracking_rmse_m"], 3)] if tracked else []),
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


def _time(r: Mapping[str, Any]) -> str:
    if not r["lockstep"]:
        return f"{r['duration_s']:.1f} s"
    wall = f" in {r['wall_s']:.1f} s" if r["wall_s"] is not None else ""
    factor = f" ({r['real_time_factor']:.1f}x)" if r["real_time_factor"] is not None else ""
    return f"{r['duration_s']:.1f} s simulated{wall}{factor}"


def _numbers(r: Mapping[str, Any]) -> Iterator[RenderableType]:
    collisions = Text(f"{r['collisions']}", style=_tone(not r["collisions"]))
    near = r["min_separation_m"]
    yield Text.assemble(
        "collisions ",
        collisions,
        f"  nearest {near:.2f} m" if near is not None else "",
        f"  {_time(r)}",
    )
    for line in _warnings(r):
        yield Text(line, style="yellow")
    if r["digest"]:
        yield Text(f"digest {r['digest'][:16]}", style="dim")


def _warnings(r: Mapping[str, Any]) -> Iterator[str]:
    """Yield what one should know before one trusts the numbers."""
    fleet = r.get("fleet") or {}
    if fleet.get("deadlock_all_s"):
        yield f"deadlock: for {fleet['deadlock_all_s']:.1f} s nobody moved who had somewhere to go"
    elif fleet.get("deadlock_any_s"):
        yield f"deadlock: for {fleet['deadlock_any_s']:.1f} s some stood who had somewhere to go"
    gap = fleet.get("setpoint_longest_gap_s") or 0.0
    if gap > LONG_GAP_S:
        yield f"setpoints: none for {gap:.2f} s at the longest"
    if lost := fleet.get("lost_frames"):
        yield f"links: {lost} frame{'s' * (lost > 1)} lost"
    if r["late_ticks"]:
        yield f"{r['late_ticks']} of {r['ticks']} ticks late"
    if n := r["outside_clients"]:
        yield f"{n} outside client{'s' * (n > 1)} took part"
    if r["partial"]:
        missing = r.get("missing") or ["some files are missing or incomplete"]
        for line in missing[:MAX_MISSING]:
            yield f"partial: {line}"
        if len(missing) > MAX_MISSING:
            yield f"partial: and {len(missing) - MAX_MISSING} more, in report.json"


def _look(r: Mapping[str, Any], folder: Path | None) -> Iterator[RenderableType]:
    where = folder or Path(r["run_id"])
    if folder is None or any(map(_has_begun, (folder / name for name in _RECORDINGS))):
        yield _whole(f"watch it  mavherd view {quote(str(where))}")
    yield _whole(f"report    {where / 'report.html'}")


def _has_begun(recording: Path) -> bool:
    """Return whether there is anything in a recording; a recorder that died at once leaves none."""
    return recording.exists() and recording.stat().st_size > 0


def _whole(text: str) -> Text:
    """Return a line that is copied whole, however long it is."""
    return Text(text, no_wrap=True, overflow="ignore")


def _table() -> Table:
    return Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="dim")


def _tone(good: bool) -> str:
    return "green" if good else "red"


def _or(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
