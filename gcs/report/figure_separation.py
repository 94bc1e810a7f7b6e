"""How near the robots of each class came to one another, over time."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...scenarios.schema import RobotSpec
from .contact import align, contact_distance, smallest_by_class
from .figure_style import (
    CLASS_COLOUR,
    INK,
    RATE_HZ,
    SHADE,
    SOFT,
    WIDTH,
    Box,
    collision_mark,
    label_axes,
    nearest_pair,
    new_figure,
    panel,
    span,
)
from .judge import Verdict
from .truth import Floats, Track

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_HEIGHT, _LEFT, _RIGHT = 1.45, 0.75, 0.25  # inches, of a panel and beside it


def separation(starts: Sequence[RobotSpec], tracks: Sequence[Track], verdict: Verdict) -> "Figure":
    """Return the smallest separation of each class over time, above its contact distance."""
    when = span(starts, verdict)
    labels = [c.pair_class for c in verdict.classes if c.nearest is not None]
    time, smallest = _smallest_by_class(tracks, verdict)
    step = _HEIGHT + 0.65
    figure = new_figure((WIDTH, 0.2 + step * len(labels)))
    for k, label in enumerate(labels):
        box = Box(_LEFT, 0.5 + (len(labels) - 1 - k) * step, WIDTH - _LEFT - _RIGHT, _HEIGHT)
        axes = panel(figure, box, *_heading(label, verdict))
        _draw(axes, label, time, smallest[label], verdict)
        if when.end > when.done:
            axes.axvline(when.done - when.ready, color=SOFT, lw=0.9, ls=":")
            if k == 0:
                _say(axes, "all had arrived", when.done - when.ready)
        last = label == labels[-1]
        label_axes(axes, box, "time since all were ready, s" if last else "", "centres, m")
    return figure


def _smallest_by_class(
    tracks: Sequence[Track], verdict: Verdict
) -> tuple[Floats, dict[str, Floats]]:
    ready = verdict.ready_at or 0.0
    time, position = align(tracks, ready, verdict.ended_at, RATE_HZ)
    kinds = [track.kind for track in tracks]
    return time - ready, smallest_by_class(kinds, position)


def _heading(label: str, verdict: Verdict) -> tuple[str, str]:
    """Return a panel's title and note."""
    hits = sum(c.pair_class == label for c in verdict.collisions)
    count = f"{hits} collision{'s' * (hits > 1)}" if hits else "no collision"
    nearest = nearest_pair(verdict, label)
    note = ""
    if nearest is not None and nearest.time is not None and nearest.min_separation is not None:
        at = nearest.time - (verdict.ready_at or 0.0)
        note = f"smallest {nearest.min_separation:.2f} m: {' and '.join(nearest.names)}, {at:.1f} s"
    kinds = "rover to quadcopter" if label == "mixed" else label.replace("-", " to ")
    return f"{kinds}: {count}", note


def _say(axes: "Axes", text: str, at: float) -> None:
    """Write beside a vertical line, at the top."""
    side = "right" if at > 0.85 * axes.get_xlim()[1] else "left"
    place = axes.get_xaxis_transform()
    axes.text(at, 0.97, f" {text} ", transform=place, ha=side, va="top", fontsize=8, color=SOFT)


def _draw(axes: "Axes", label: str, time: Floats, smallest: Floats, verdict: Verdict) -> None:
    colour = CLASS_COLOUR[label]
    kinds = label.split("-") if label != "mixed" else ["rover", "quadcopter"]
    contact = contact_distance(kinds[0], kinds[-1])
    ready = verdict.ready_at or 0.0
    seen = np.where(np.isfinite(smallest), smallest, np.nan)
    axes.fill_between(time[[0, -1]], 0, contact, color=SHADE, alpha=0.07, lw=0)
    axes.axhline(contact, ls="--", lw=1.1, color=INK)
    axes.annotate(
        f"contact {contact:.3g} m",
        (1, contact),
        xycoords=("axes fraction", "data"),
        xytext=(-4, 2),
        textcoords="offset points",
        ha="right",
        va="bottom",
        fontsize=8,
        color=INK,
    )
    axes.plot(time, seen, color=colour, lw=1.7)
    nearest = nearest_pair(verdict, label)
    if nearest is not None and nearest.time is not None and nearest.min_separation is not None:
        at = nearest.time - ready
        axes.plot(at, nearest.min_separation, "o", ms=6, mfc="white", mec=colour, mew=1.6, zorder=4)
    if hits := [c.time - ready for c in verdict.collisions if c.pair_class == label]:
        axes.plot(hits, [contact] * len(hits), zorder=6, **collision_mark(len(hits)))
    axes.set_ylim(0, max(3 * contact, 1.15 * float(np.nanmax(seen, initial=0.0))))
    axes.set_xlim(0, time[-1])
