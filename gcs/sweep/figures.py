"""Pictures of a sweep: rates with their intervals, and what was measured, for each grid point.

Along an axis of numbers (three or more) as lines over it; otherwise a row for each grid point.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...scenarios.source import parse
from ..report.contact import contact_distance
from ..report.figure_style import COLOURS, INK, SOFT, new_figure, quiet, save
from .grid import Axis
from .intervals import Median, Rate
from .summary import Summary

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_ROWS = 40  # grid points in a picture; the summary has all
MAX_DOTS = 400  # of one grid point
_RATES = {
    "passed": "runs that passed",
    "collided": "runs with a collision",
    "all_arrived": "runs in which all arrived",
}
_MEASURES = {
    "min_separation_rover_rover_m": "nearest two rovers (centres), m",
    "min_separation_quadcopter_quadcopter_m": "nearest two quadcopters (centres), m",
    "min_separation_mixed_m": "nearest rover and quadcopter (centres), m",
    "last_arrival_s": "last arrival, s after all were ready",
    "max_rmse_m": "worst tracking RMSE, m",
}
_CONTACT = {
    "min_separation_rover_rover_m": ("rover", "rover"),
    "min_separation_quadcopter_quadcopter_m": ("quadcopter", "quadcopter"),
    "min_separation_mixed_m": ("rover", "quadcopter"),
}
_TRANSPARENT = 0.25


class _Series(NamedTuple):
    """Grid points that differ in the axis of numbers only."""

    label: str
    x: list[float]
    points: list[int]


def draw(folder: Path, summary: Summary) -> list[Path]:
    """Write rates.png and, when anything was measured, distributions.png; return them."""
    shown = range(min(summary.plan.points, MAX_ROWS))
    rates = {point: summary.rates(point) for point in range(summary.plan.points)}
    medians = {point: summary.medians(point) for point in range(summary.plan.points)}
    measured = [name for name in _MEASURES if any(name in medians[p] for p in shown)]
    numbers = _number_axis(summary.plan.grid)
    pictures: dict[str, Callable[[], Figure]] = {}
    if numbers is None:
        pictures["rates.png"] = lambda: _rate_rows(summary, rates)
        pictures["distributions.png"] = lambda: _measure_rows(summary, measured, medians)
    else:
        series = _series(summary, numbers)
        pictures["rates.png"] = lambda: _rate_lines(numbers.key, series, rates)
        pictures["distributions.png"] = lambda: _measure_lines(
            numbers.key, series, measured, medians
        )
    if not measured:
        del pictures["distributions.png"]
    folder.mkdir(parents=True, exist_ok=True)
    return [save(folder / name, make()) for name, make in pictures.items()]


def _number_axis(grid: Sequence[Axis]) -> Axis | None:
    """Return the longest axis whose values are three or more numbers."""
    long = [axis for axis in grid if len(axis.values) > 2 and _numbers(axis)]
    return max(long, key=lambda axis: len(axis.values), default=None)


def _numbers(axis: Axis) -> list[float]:
    """Return an axis's values, empty unless all are numbers."""
    values = [parse(text, axis.key).value for text in axis.values]
    numbers = [float(v) for v in values if isinstance(v, int | float) and not isinstance(v, bool)]
    return numbers if len(numbers) == len(values) else []


def _series(summary: Summary, numbers: Axis) -> list[_Series]:
    x = dict(zip(numbers.values, _numbers(numbers), strict=True))
    found: dict[str, _Series] = {}
    for point in range(summary.plan.points):
        settings = summary.plan.settings(point)
        at = x[settings.pop(numbers.key)]
        label = _label(settings)
        series = found.setdefault(label, _Series(label, [], []))
        series.x.append(at)
        series.points.append(point)
    return [_sorted(series) for series in found.values()]


def _sorted(series: _Series) -> _Series:
    order = np.argsort(series.x).tolist()
    return _Series(series.label, [series.x[k] for k in order], [series.points[k] for k in order])


def _label(settings: Mapping[str, str]) -> str:
    """Return what tells a grid point from others, by the last word of each key."""
    return ", ".join(f"{key.rpartition('.')[2]} {value}" for key, value in settings.items())


def _panels(count: int, height: float, *, width: float = 9.5) -> tuple["Figure", list["Axes"]]:
    figure = new_figure((width, 0.5 + height * count))
    figure.set_layout_engine("constrained", w_pad=0.15, h_pad=0.1)
    return figure, list(figure.subplots(count, 1, squeeze=False)[:, 0])


def _rows(axes: "Axes", summary: Summary) -> range:
    """Make room for a row for each grid point, the first on top; return the points."""
    points = range(min(summary.plan.points, MAX_ROWS))
    labels = [_label(summary.plan.settings(point)) for point in points]
    axes.set_yticks(list(points), labels)
    axes.set_ylim(len(points) - 0.5, -0.5)
    if len(points) < summary.plan.points:
        title = f"the first {len(points)} of {summary.plan.points} grid points"
        axes.set_title(title, loc="right", fontsize=9, color=SOFT)
    quiet(axes)
    return points


def _rate_rows(summary: Summary, rates: Mapping[int, Mapping[str, Rate]]) -> "Figure":
    figure, panels = _panels(len(_RATES), 0.7 + 0.25 * min(summary.plan.points, MAX_ROWS))
    for axes, (name, title) in zip(panels, _RATES.items(), strict=True):
        for point in _rows(axes, summary):
            _whisker(axes, rates[point][name], point)
        axes.set_xlim(-0.02, 1.02)
        axes.xaxis.set_major_formatter(_percent)
        axes.set_title(title, loc="left", fontsize=11, color=INK)
    panels[-1].set_xlabel("share of runs; bars: 95 % (Wilson)", color=SOFT)
    return figure


def _percent(value: float, _: object) -> str:
    return f"{value:.0%}"


def _whisker(axes: "Axes", rate: Rate, row: int) -> None:
    if rate.rate is not None:
        axes.plot([rate.low, rate.high], [row, row], color=COLOURS[0], lw=3, alpha=0.5)
        axes.plot(rate.rate, row, "o", color=COLOURS[0], ms=6)
        at = (min(rate.high, 0.9), row)
        note = f" {rate.hits} / {rate.n}"
        axes.annotate(note, at, (4, 4), textcoords="offset points", fontsize=8, color=SOFT)


def _measure_rows(
    summary: Summary, measured: Sequence[str], medians: Mapping[int, Mapping[str, Median]]
) -> "Figure":
    figure, panels = _panels(len(measured), 0.8 + 0.4 * min(summary.plan.points, MAX_ROWS))
    for axes, name in zip(panels, measured, strict=True):
        for point in _rows(axes, summary):
            values = summary.values(point, name)
            _dots(axes, values[np.isfinite(values)], point)
            if middle := medians[point].get(name):
                _middle(axes, middle, point)
            if never := int(np.isinf(values).sum()):
                axes.annotate(
                    f"never: {never} ",
                    (1, point),
                    xycoords=("axes fraction", "data"),
                    ha="right",
                    va="center",
                    fontsize=8,
                    color=COLOURS[1],
                )
        _contact(axes, name, upright=True)
        axes.set_title(_MEASURES[name], loc="left", fontsize=11, color=INK)
    panels[-1].set_xlabel(
        "dots: runs; tick and bar: median and its 95 % interval; dashed: contact", color=SOFT
    )
    return figure


def _contact(axes: "Axes", name: str, *, upright: bool) -> None:
    """Mark the contact distance, where anybody came near it."""
    if pair := _CONTACT.get(name):
        contact = contact_distance(*pair)
        if upright and axes.get_xlim()[0] < 3 * contact:
            axes.axvline(contact, ls="--", lw=1.1, color=INK)
            axes.set_xlim(left=0)
        elif not upright and axes.get_ylim()[0] < 3 * contact:
            axes.axhline(contact, ls="--", lw=1.1, color=INK)
            axes.set_ylim(bottom=0)


def _dots(axes: "Axes", values: "np.ndarray", row: int) -> None:
    """Draw runs as dots that step aside for one another in a fixed pattern."""
    few = values[:: max(1, -(-len(values) // MAX_DOTS))]
    aside = (np.arange(len(few)) * 0.618034 % 1 - 0.5) * 0.5
    axes.plot(few, row + aside, ".", ms=6, color=INK, alpha=0.4, mec="none", zorder=3)


def _middle(axes: "Axes", middle: Median, row: int) -> None:
    if middle.low is not None and middle.high is not None and np.isfinite(middle.high):
        ends = [middle.low, middle.high]
        axes.plot(ends, [row, row], color=COLOURS[0], lw=6, alpha=0.4, solid_capstyle="butt")
    if middle.median is not None and np.isfinite(middle.median):
        axes.plot(middle.median, row, "|", ms=16, mew=2, color=COLOURS[0])


def _rate_lines(
    key: str, series: Sequence[_Series], rates: Mapping[int, Mapping[str, Rate]]
) -> "Figure":
    figure, panels = _panels(len(_RATES), 2.3)
    for axes, (name, title) in zip(panels, _RATES.items(), strict=True):
        for each, colour in zip(series, COLOURS, strict=False):
            found = [rates[point][name] for point in each.points]
            middle = [np.nan if r.rate is None else r.rate for r in found]
            axes.fill_between(
                each.x,
                [r.low for r in found],
                [r.high for r in found],
                color=colour,
                alpha=_TRANSPARENT,
                lw=0,
            )
            axes.plot(each.x, middle, "o-", ms=4, color=colour, label=each.label)
        axes.set_ylim(-0.03, 1.03)
        axes.yaxis.set_major_formatter(_percent)
        axes.set_title(title, loc="left", fontsize=11, color=INK)
        quiet(axes)
    _finish_lines(panels, key, series, "bands: 95 % (Wilson)")
    return figure


def _measure_lines(
    key: str,
    series: Sequence[_Series],
    measured: Sequence[str],
    medians: Mapping[int, Mapping[str, Median]],
) -> "Figure":
    figure, panels = _panels(len(measured), 2.3)
    for axes, name in zip(panels, measured, strict=True):
        for each, colour in zip(series, COLOURS, strict=False):
            found = [medians[point].get(name) for point in each.points]
            low, middle, high = (
                [_finite(m and getattr(m, part)) for m in found]
                for part in ("low", "median", "high")
            )
            axes.fill_between(each.x, low, high, color=colour, alpha=_TRANSPARENT, lw=0)
            axes.plot(each.x, middle, "o-", ms=4, color=colour, label=each.label)
        _contact(axes, name, upright=False)
        axes.set_title(_MEASURES[name], loc="left", fontsize=11, color=INK)
        quiet(axes)
    _finish_lines(panels, key, series, "medians; bands: their 95 % intervals; dashed: contact")
    return figure


def _finite(value: float | None) -> float:
    return value if value is not None and np.isfinite(value) else np.nan


def _finish_lines(panels: Sequence["Axes"], key: str, series: Sequence[_Series], note: str) -> None:
    panels[-1].set_xlabel(f"{key}\n{note}", color=SOFT)
    if len(series) > len(COLOURS):
        note = f"the first {len(COLOURS)} of {len(series)} lines; the summary has all"
        panels[0].set_title(note, loc="right", fontsize=9, color=SOFT)
    if len(series) > 1:
        panels[0].legend(fontsize=8, frameon=False)
