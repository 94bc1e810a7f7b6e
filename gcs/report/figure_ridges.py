"""Quantities over time, a row per robot or, of many, how they are spread: speeds and errors."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...scenarios.route import Route
from ...scenarios.schema import Goto, RobotSpec, Scenario
from .figure_style import (
    INK,
    KIND_COLOUR,
    RATE_HZ,
    SOFT,
    WIDTH,
    Box,
    Span,
    halo,
    label_axes,
    new_figure,
    panel,
    robot_colours,
    span,
)
from .judge import Verdict
from .truth import Floats, Track

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROWS = 12  # more robots than this are drawn as their spread
_ROW, _SPREAD, _GAP = 0.42, 1.7, 0.62  # inches
_LEFT, _RIGHT = 1.15, 0.25


class Ridge(NamedTuple):
    """One robot's quantity over time."""

    name: str
    kind: str
    colour: str
    time: Floats  # s since all were ready
    value: Floats
    mark: float | None  # s, when it had arrived


class Group(NamedTuple):
    """Robots that share a panel and a scale."""

    title: str
    unit: str
    ridges: list[Ridge]
    own: bool = False  # each row has a scale of its own


def speeds(starts: Sequence[RobotSpec], tracks: Sequence[Track], verdict: Verdict) -> "Figure":
    """Return how fast robots moved: in the plane for rovers, in space for quadcopters."""
    when = span(starts, verdict)
    groups = []
    for kind, title in (
        ("rover", "Speed of the rovers"),
        ("quadcopter", "Speed of the quadcopters"),
    ):
        ridges = [
            ridge._replace(value=np.hypot.reduce(track.velocity[rows][:, : _axes(kind)], axis=1))
            for track, rows, ridge in _ridges(tracks, verdict, when)
            if kind == track.kind
        ]
        groups += [Group(title, "m/s", ridges)] if ridges else []
    return _draw(groups, when)


def errors(
    scenario: Scenario, starts: Sequence[RobotSpec], tracks: Sequence[Track], verdict: Verdict
) -> "Figure | None":
    """Return how far robots were from where they should be."""
    when = span(starts, verdict)
    specs = {spec.name: spec for spec in starts}
    left, behind = (
        Group("Distance left to the target", "m", [], own=True),
        Group("Distance from the place asked for at that moment", "m", []),
    )
    for track, rows, ridge in _ridges(tracks, verdict, when):
        if (spec := specs.get(track.name)) is None:
            continue
        route = Route(spec.path, spec, scenario.team)
        wanted = np.array([route.at(t).position for t in ridge.time.tolist()])
        apart = (track.position[rows] - wanted)[:, : _axes(track.kind)]
        ridge = ridge._replace(value=np.hypot.reduce(apart, axis=1))
        if isinstance(spec.path, Goto):
            left.ridges.append(_until_arrival(ridge))
        else:
            behind.ridges.append(ridge)
    groups = [group for group in (left, behind) if group.ridges]
    return _draw(groups, when) if groups else None


def _until_arrival(ridge: Ridge) -> Ridge:
    """Return a ridge without what came after arrival: who has arrived may go home."""
    last = len(ridge.time)
    if ridge.mark is not None:
        last = max(1, int(np.searchsorted(ridge.time, ridge.mark, "right")))
    return ridge._replace(time=ridge.time[:last], value=ridge.value[:last])


def _axes(kind: str) -> int:
    return 2 if kind == "rover" else 3


def _ridges(
    tracks: Sequence[Track], verdict: Verdict, when: Span
) -> "list[tuple[Track, slice, Ridge]]":
    """Return of each track the rows to be drawn, and a ridge without its values."""
    colours = robot_colours({track.name: track.kind for track in tracks})
    marks = {r.name: r.arrival for r in verdict.robots}
    found = []
    for track in tracks:
        first, last = np.searchsorted(track.time, (when.ready - 1e-6, when.done + 1e-6))
        step = max(1, round(len(track) / max(1e-9, float(np.ptp(track.time))) / RATE_HZ))
        rows = slice(int(first), int(last), step)
        time = track.time[rows] - when.ready
        if len(time):
            mark = marks.get(track.name)
            colour = colours[track.name]
            found.append((track, rows, Ridge(track.name, track.kind, colour, time, time, mark)))
    return found


def _draw(groups: Sequence[Group], when: Span) -> "Figure":
    heights = [_ROW * len(g.ridges) if len(g.ridges) <= ROWS else _SPREAD for g in groups]
    figure = new_figure((WIDTH, 0.2 + sum(heights) + _GAP * len(groups)))
    bottom = 0.5 + sum(heights) + _GAP * (len(groups) - 1)
    for group, height in zip(groups, heights, strict=True):
        bottom -= height
        box = Box(_LEFT, bottom, WIDTH - _LEFT - _RIGHT, height)
        few = len(group.ridges) <= ROWS
        top = max(float(ridge.value.max()) for ridge in group.ridges) or 1.0
        note = "line: median; band: 10 to 90 %"
        if few:
            note = "rows have scales of their own" if group.own else ""
            note = note or f"rows are {top:.2g} {group.unit} high"
        axes = panel(figure, box, f"{group.title}, {group.unit}", note)
        axes.set_xlim(0, max(when.done - when.ready, 1e-3))
        if few:
            _draw_rows(axes, group, top)
        else:
            _draw_spread(axes, group.ridges, top)
        x = "time since all were ready, s" if group is groups[-1] else ""
        label_axes(axes, box, x, "")
        bottom -= _GAP
    return figure


def _draw_rows(axes: "Axes", group: Group, top: float) -> None:
    """Draw a row per robot, the first one on top."""
    ridges, count, end = group.ridges, len(group.ridges), axes.get_xlim()[1]
    for k, ridge in enumerate(ridges):
        base = count - 1 - k
        high = float(ridge.value.max()) or 1.0 if group.own else top
        curve = base + 0.86 * ridge.value / high
        axes.fill_between(ridge.time, base, curve, color=ridge.colour, alpha=0.22, lw=0)
        axes.plot(ridge.time, curve, color=ridge.colour, lw=1.3)
        if ridge.mark is not None:
            axes.plot([ridge.mark] * 2, [base, base + 0.5], color=INK, lw=1.0)
            _note(
                axes, f"arrived {ridge.mark:.1f}", ridge.mark, base + 0.62, ridge.mark > 0.9 * end
            )
        if group.own:
            _note(axes, f"{high:.1f} {group.unit}", 0, base + 0.7, left=False)
    axes.set_yticks(range(count), [ridge.name for ridge in reversed(ridges)], va="bottom")
    axes.tick_params(axis="y", length=0, labelcolor=INK)
    axes.set_ylim(0, count)


def _note(axes: "Axes", text: str, x: float, y: float, left: bool) -> None:
    """Write to the right of a place in a row, or to its left."""
    side: Any = {"xytext": (-4 if left else 4, 0), "ha": "right" if left else "left"}
    place: Any = {"textcoords": "offset points", "va": "top", "fontsize": 8, "color": SOFT}
    axes.annotate(text, (x, y), zorder=5, **side, **place, **halo())


def _draw_spread(axes: "Axes", ridges: Sequence[Ridge], top: float) -> None:
    """Draw for each kind the median of all robots, and between what eight of ten are.

    Who has arrived keeps its last value: the median of those left would jump.
    """
    for kind, colour in KIND_COLOUR.items():
        mine = [ridge for ridge in ridges if ridge.kind == kind]
        if not mine:
            continue
        time = max((ridge.time for ridge in mine), key=len)
        table = np.array([np.interp(time, r.time, r.value) for r in mine])
        low, middle, high = np.percentile(table, (10, 50, 90), axis=0)
        axes.fill_between(time, low, high, color=colour, alpha=0.2, lw=0)
        axes.plot(time, middle, color=colour, lw=1.7, label=f"{len(mine)} {kind}s")
    axes.legend(loc="upper right", frameon=False, fontsize=9, labelcolor=INK)
    axes.set_ylim(0, 1.05 * top)
