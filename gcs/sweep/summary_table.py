"""The summary of a sweep as a person reads it."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from .folder import FIGURES, SUMMARY, TABLE

MAX_POINTS = 40  # grid points; the summary has all
MAX_LOOKS = 5  # runs to look at, and failed ones
_RATES = ("passed", "collided")


class _Head(NamedTuple):
    text: str
    digits: int


_MEDIANS = {
    "min_separation_rover_rover_m": _Head("rovers m", 2),
    "min_separation_quadcopter_quadcopter_m": _Head("quads m", 2),
    "min_separation_mixed_m": _Head("mixed m", 2),
    "last_arrival_s": _Head("arrived s", 1),
    "max_rmse_m": _Head("RMSE m", 3),
}
_CLASSES = tuple(_MEDIANS)[:3]


def summary_table(summary: Mapping[str, Any], folder: Path) -> RenderableType:
    """Return a row for each grid point, the runs to look at, and where everything is."""
    return Group(_title(summary), _points(summary), *_looks(summary), *_where(folder))


def _title(s: Mapping[str, Any]) -> Text:
    points = len(s["points"])
    grid = f"  {points} grid points x {s['runs'] // points} seeds" if points > 1 else ""
    failed = (f"  {s['failed']} failed", "red") if s["failed"] else ""
    runs = f"  {_count(s['runs'])}"
    parts = (s["scenario"], "bold"), runs, (grid, "dim"), failed
    return Text.assemble(*parts, no_wrap=True, overflow="ignore")


def _points(s: Mapping[str, Any]) -> RenderableType:
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="dim")
    last_words = [key.rpartition(".")[2] for key in s["grid"]]
    for key, word in zip(s["grid"], last_words, strict=True):
        table.add_column(word if last_words.count(word) == 1 else key, overflow="fold")
    shown = [name for name in _MEDIANS if any(name in p["medians"] for p in s["points"])]
    if all(name in shown for name in _CLASSES):
        shown.remove(_CLASSES[-1])  # 80 columns have no room for it; summary and figures have
    for head in ("runs", *_RATES, *(_MEDIANS[name].text for name in shown)):
        table.add_column(head, justify="right", no_wrap=True)
    for p in s["points"][:MAX_POINTS]:
        table.add_row(
            *(Text(p["set"][key]) for key in s["grid"]),
            str(p["runs"] - p["failed"]),
            *(_rate(p["rates"][name]) for name in _RATES),
            *(_median(p["medians"].get(name), _MEDIANS[name].digits) for name in shown),
        )
    more = len(s["points"]) - MAX_POINTS
    notes = [f"and {more} more grid points, in {SUMMARY}"] if more > 0 else []
    notes.append("medians of the smallest separations, the last arrivals, the largest RMSE;")
    notes.append("below: 95 % intervals (rates: Wilson; medians: order statistics, from 6 runs on)")
    return Group(table, *(Text(note, style="dim") for note in notes))


def _rate(r: Mapping[str, Any]) -> Text:
    if r["rate"] is None:
        return Text("-")
    return _cell(f"{r['rate']:.0%}", f"{100 * r['low']:.0f}..{r['high']:.0%}")


def _median(m: Mapping[str, Any] | None, digits: int) -> Text:
    if m is None:
        return Text("-")
    low, middle, high = (_value(m[part], digits) for part in ("low", "median", "high"))
    return _cell(middle, f"{low}..{high}" if m["n"] > 5 else "")  # fewer have no interval


def _value(value: float | None, digits: int) -> str:
    return "never" if value is None else f"{value:.{digits}f}"


def _cell(value: str, interval: str) -> Text:
    return Text.assemble(value, "\n", (interval, "dim"))


def _looks(s: Mapping[str, Any]) -> Iterator[RenderableType]:
    for look in s["failures"][:MAX_LOOKS]:
        yield Text(f"failed, {_count(look['runs'])}: {look['why']}", style="red")
        yield _line(f"  {look['command']}", "dim")
    for look in s["worst"][:MAX_LOOKS]:
        yield Text(f"look at: {look['why']}")
        yield _line(f"  {look['command']}", "dim")


def _where(folder: Path) -> Iterator[RenderableType]:
    for what, name in (("table", TABLE), ("summary", SUMMARY), ("figures", FIGURES)):
        if (folder / name).exists():
            yield _line(f"{what:8} {folder / name}")


def _line(text: str, style: str = "") -> Text:
    """Return a line that stays whole, to be copied."""
    return Text(text, style, no_wrap=True, overflow="ignore")


def _count(runs: int) -> str:
    return f"{runs} run{'s' * (runs > 1)}"
