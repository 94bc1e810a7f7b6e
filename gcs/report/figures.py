"""Pictures of a run: all tracks from above, and separation over time."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...scenarios.schema import RobotSpec, Scenario
from .contact import CLASSES, align, contact_distance, pair_class, separations
from .figure_plan import plan
from .figure_style import (
    CLASS_COLOUR,
    INK,
    RATE_HZ,
    SOFT,
    collision_mark,
    nearest_pair,
    new_figure,
    quiet,
    save,
)
from .judge import Verdict
from .truth import Floats, Track

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def draw(
    folder: Path,
    scenario: Scenario,
    starts: Sequence[RobotSpec],
    tracks: Sequence[Track],
    verdict: Verdict,
) -> list[Path]:
    """Write plan.png and separation.png into `folder`; return those there was something for."""
    tracks = sorted((t for t in tracks if len(t)), key=lambda t: t.system_id)
    pictures: list[tuple[str, Callable[[], Figure]]] = []
    if tracks:
        pictures.append(("plan.png", lambda: plan(scenario, starts, tracks, verdict)))
    lasted = min((t.time[-1] for t in tracks), default=0.0) - (verdict.ready_at or 0.0)
    if lasted > 2 / RATE_HZ and any(pair.min_separation is not None for pair in verdict.pairs):
        pictures.append(("separation.png", lambda: separation(tracks, verdict)))
    folder.mkdir(parents=True, exist_ok=True)
    return [save(folder / name, make()) for name, make in pictures]


def separation(tracks: Sequence[Track], verdict: Verdict) -> "Figure":
    """Return the smallest separation of each class over time, above its contact distance."""
    labels = [c.pair_class for c in verdict.classes if c.nearest is not None]
    time, smallest = _smallest_by_class(tracks, verdict)
    figure = new_figure((9.5, 0.9 + 2.1 * len(labels)))
    figure.set_layout_engine("constrained", w_pad=0.15, h_pad=0.1)
    panels = figure.subplots(len(labels), 1, squeeze=False, sharex=True)[:, 0]
    for axes, label in zip(panels, labels, strict=True):
        _separation_panel(axes, label, time, smallest[label], verdict)
    panels[-1].set_xlabel("time since all were ready, s")
    return figure


def _smallest_by_class(
    tracks: Sequence[Track], verdict: Verdict
) -> tuple[Floats, dict[str, Floats]]:
    ready = verdict.ready_at or 0.0
    time, position = align(tracks, ready, verdict.ended_at, RATE_HZ)
    kinds = [track.kind for track in tracks]
    smallest = {label: np.full(len(time), np.inf) for label in CLASSES}
    for i in range(len(tracks) - 1):
        _, squared = separations(kinds, position, i, slice(i + 1, len(tracks)))
        for row, kind in zip(squared, kinds[i + 1 :], strict=True):
            best = smallest[pair_class(kinds[i], kind)]
            np.minimum(best, row, out=best)
    return time - ready, {label: np.sqrt(s) for label, s in smallest.items()}


def _separation_panel(
    axes: "Axes", label: str, time: Floats, smallest: Floats, verdict: Verdict
) -> None:
    colour = CLASS_COLOUR[label]
    kinds = label.split("-") if label != "mixed" else ["rover", "quadcopter"]
    contact = contact_distance(kinds[0], kinds[-1])
    seen = np.where(np.isfinite(smallest), smallest, np.nan)
    top = max(3 * contact, 1.15 * float(np.nanmax(seen, initial=0.0)))
    axes.fill_between(time[[0, -1]], 0, contact, color="#000000", alpha=0.07, lw=0)
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
        at = nearest.time - (verdict.ready_at or 0.0)
        axes.plot(at, nearest.min_separation, "o", ms=6, mfc="white", mec=colour, mew=1.6, zorder=4)
        note = f"smallest {nearest.min_separation:.2f} m: {' and '.join(nearest.names)}, {at:.1f} s"
        axes.set_title(note, loc="right", fontsize=9, color=SOFT)
    hits = [c.time - (verdict.ready_at or 0.0) for c in verdict.collisions if c.pair_class == label]
    if hits:
        axes.plot(hits, [contact] * len(hits), zorder=6, **collision_mark(len(hits)))
    count = f": {len(hits)} collision{'s' * (len(hits) > 1)}" if hits else ": no collision"
    axes.set_title(label.replace("-", " to ") + count, loc="left", fontsize=11, color=INK)
    axes.set_ylabel("centres, m")
    axes.set_ylim(0, top)
    axes.set_xlim(time[0], time[-1])
    quiet(axes)
