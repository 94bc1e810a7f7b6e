"""Space-time diagrams: along one robot's way, where and when others are in it.

As in path-velocity decomposition (Kant and Zucker 1986) and the s-t graphs of motion planners: time
goes to the right, the robot's own way upwards. A region is where its body would touch another's if
it were at that place of its way at that time; so its curve passes a region above (it went first),
below (it let the other pass), or through it (they collided). Round it, paler: nearer than twice
that distance.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scenarios.schema import RobotSpec
from .contact import BODIES, LEVEL_M, contact_distance
from .figure_style import (
    INK,
    WIDTH,
    Box,
    Span,
    collision_mark,
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

PANELS = 4  # those to whom somebody came nearest
OTHERS = 4  # in one panel, the nearest ones
NEAR = 2.0  # times the contact distance
_TIMES = 100  # in a diagram
_NAME = (0.09, 0.07)  # of a panel: half of what a name covers
_PLACES = (60, 140)  # in a diagram: as many as the smallest region needs, within these
_MOVED_M = 0.5  # who has gone less has no way that others could be in
_HEIGHT, _LEFT, _GAP, _RIGHT = 2.0, 0.75, 0.7, 0.25  # inches


class _Way(NamedTuple):
    """One robot's way over time."""

    time: Floats  # s since all were ready
    gone: Floats  # m, along the way
    position: Floats


class _Diagram(NamedTuple):
    """What stands in one robot's way: for each other one, distances in contact distances."""

    track: Track
    way: _Way
    places: Floats  # m along the way
    times: Floats
    others: list[tuple[Track, Floats]]  # (places, times)


def conflicts(
    starts: Sequence[RobotSpec], tracks: Sequence[Track], verdict: Verdict
) -> "Figure | None":
    """Return a diagram for each robot that others crossed; None where nobody did."""
    when = _shown(span(starts, verdict), verdict)
    found: list[_Diagram] = []
    for track in _by_danger(tracks, verdict)[: 2 * PANELS]:
        if len(found) < PANELS and (diagram := _examine(track, tracks, verdict, when)):
            found.append(diagram)
    if not found:
        return None
    found.sort(key=lambda d: d.track.system_id)
    colours = _colours(tracks, found)
    columns = 2 if len(found) > 1 else 1
    rows = -(-len(found) // columns)
    step = _HEIGHT + 0.75
    width = (WIDTH - _LEFT - _RIGHT - (columns - 1) * _GAP) / columns
    figure = new_figure((WIDTH, rows * step + 0.15))
    for k, diagram in enumerate(found):
        row, column = divmod(k, columns)
        left = _LEFT + column * (width + _GAP)
        box = Box(left, 0.5 + (rows - 1 - row) * step, width, _HEIGHT)
        name = diagram.track.name
        note = "" if k else "dark: they would touch; pale: within twice that"
        axes = panel(figure, box, f"In the way of {name}", note)
        _draw(axes, diagram, colours, verdict, when)
        last = row == rows - 1 or k + columns >= len(found)
        y = "along its way, m" if column == 0 else ""
        label_axes(axes, box, "time since all were ready, s" if last else "", y)
    return figure


def _shown(when: Span, verdict: Verdict) -> Span:
    """Return the span with its end where work was done, or later where somebody collided."""
    last = max((c.time + 1.0 for c in verdict.collisions), default=0.0)
    return when._replace(done=min(when.end, max(when.done, last)))


def _by_danger(tracks: Sequence[Track], verdict: Verdict) -> list[Track]:
    """Return the tracks, first those to whom another came nearest for its size."""
    danger: dict[str, float] = {}
    for pair in verdict.pairs:
        if pair.min_separation is not None:
            for name in pair.names:
                ratio = pair.min_separation / pair.contact
                danger[name] = min(ratio, danger.get(name, np.inf))
    return sorted((t for t in tracks if t.name in danger), key=lambda t: danger[t.name])


def _examine(
    track: Track, tracks: Sequence[Track], verdict: Verdict, when: Span
) -> _Diagram | None:
    way = _way(track, when)
    if len(way.time) < 2 or way.gone[-1] < _MOVED_M:
        return None
    small = 0.4 * min(contact_distance(track.kind, kind) for kind in BODIES)
    places = np.linspace(0, way.gone[-1], int(np.clip(way.gone[-1] / small, *_PLACES)))
    times = np.linspace(0, when.done - when.ready, _TIMES)
    mine = _sampled(way.gone, way.position, places)
    nearest = _nearest(track.name, verdict)
    others: list[tuple[Track, Floats]] = []
    for other in sorted(tracks, key=lambda t: nearest.get(t.name, np.inf))[: 2 * OTHERS]:
        if other.name not in nearest or len(others) == OTHERS:
            continue
        its = _way(other, when)
        if len(its.time) < 2:
            continue
        apart = _apart(track.kind, mine, other.kind, _sampled(its.time, its.position, times))
        if float(apart.min()) < 1.0:
            others.append((other, apart))
    return _Diagram(track, way, places, times, others) if others else None


def _nearest(name: str, verdict: Verdict) -> dict[str, float]:
    """Return for each other robot how near it came, in contact distances."""
    return {
        other: p.min_separation / p.contact
        for p in verdict.pairs
        for me, other in (p.names, p.names[::-1])
        if me == name and p.min_separation is not None
    }


def _way(track: Track, when: Span) -> _Way:
    first, last = np.searchsorted(track.time, (when.ready - 1e-6, when.done + 1e-6))
    step = max(1, round(len(track) / max(1e-9, float(np.ptp(track.time))) / 20))
    position = track.position[first:last:step]
    steps = np.hypot.reduce(np.diff(position, axis=0), axis=1)
    gone = np.concatenate([[0.0], np.cumsum(steps)])[: len(position)]
    return _Way(track.time[first:last:step] - when.ready, gone, position)


def _sampled(x: Floats, position: Floats, at: Floats) -> Floats:
    return np.stack([np.interp(at, x, position[:, axis]) for axis in range(3)], -1)


def _apart(kind: str, mine: Floats, other: str, its: Floats) -> Floats:
    """Return every place of one against every place of the other, in contact distances.

    As the judge measures: in space between quadcopters, otherwise in the plane and at one level.
    """
    d = its[None] - mine[:, None]
    squared = d[..., 0] ** 2 + d[..., 1] ** 2
    if kind == other == "quadcopter":
        squared = squared + d[..., 2] ** 2
    elif kind != other:
        a, b = BODIES[kind], BODIES[other]
        gap = np.maximum(d[..., 2] - b.below - a.above, -d[..., 2] - a.below - b.above)
        squared = np.where(gap < LEVEL_M, squared, 1e4)
    apart: Floats = np.sqrt(squared) / contact_distance(kind, other)
    return apart


def _colours(tracks: Sequence[Track], found: Sequence[_Diagram]) -> dict[str, str]:
    """Return a colour by name: the team's, or of a large team one for each in these diagrams."""
    named = {d.track.name: d.track.kind for d in found}
    named |= {other.name: other.kind for d in found for other, _ in d.others}
    team = robot_colours({track.name: track.kind for track in tracks})
    return {name: team[name] for name in named}


def _draw(
    axes: "Axes", diagram: _Diagram, colours: dict[str, str], verdict: Verdict, when: Span
) -> None:
    track, way, places, times, others = diagram
    taken = _along(diagram)
    for other, apart in others:
        colour = colours[other.name]
        axes.contourf(times, places, apart, levels=[0, NEAR], colors=[colour], alpha=0.2)
        axes.contourf(times, places, apart, levels=[0, 1], colors=[colour], alpha=0.75)
        free = np.where(taken, np.inf, apart)
        inside = free if float(free.min()) < NEAR else apart
        row, column = np.unravel_index(int(inside.argmin()), apart.shape)
        _name(axes, other.name, times[column] / times[-1], places[row] / places[-1])
        taken |= _around(diagram, times[column], places[row])
    axes.plot(way.time, way.gone, color=INK, lw=2.0, zorder=5)
    hits = [c.time - when.ready for c in verdict.collisions if track.name in c.names]
    if hits:
        gone = np.interp(hits, way.time, way.gone)
        axes.plot(hits, gone, zorder=6, **collision_mark(len(hits)))
    axes.set_xlim(0, times[-1])
    axes.set_ylim(0, 1.04 * places[-1])


def _along(diagram: _Diagram) -> NDArray[np.bool_]:
    """Return where a name would be on the robot's own curve."""
    _, way, places, times, _ = diagram
    taken = np.zeros((len(places), len(times)), dtype=bool)
    for t in np.linspace(0, times[-1], 40):
        taken |= _around(diagram, t, float(np.interp(t, way.time, way.gone)))
    return taken


def _around(diagram: _Diagram, time: float, place: float) -> NDArray[np.bool_]:
    """Return where a name would cover another one's middle, or that point."""
    beside = np.abs(diagram.times - time) < _NAME[0] * diagram.times[-1]
    level = np.abs(diagram.places - place) < _NAME[1] * diagram.places[-1]
    return level[:, None] & beside[None]


def _name(axes: "Axes", name: str, x: float, y: float) -> None:
    """Write who is there, inside of the panel."""
    side = "left" if x < 0.15 else "right" if x > 0.85 else "center"
    place = axes.transAxes
    x += 0.01 * ((side == "left") - (side == "right"))
    text = axes.text(
        x, min(0.93, max(0.05, y)), name, transform=place, ha=side, va="center", **halo()
    )
    text.set(fontsize=8.5, color=INK, zorder=7)
