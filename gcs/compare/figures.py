"""Pictures of a comparison: the tracks of all runs over one another, and their separations.

A run, or of many a group of runs, has its own colour and its own dashes, the same in every figure.
Runs are drawn until their work was done: until the last robot had arrived.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..report.contact import CLASSES, contact_distance
from ..report.figure_plan import thinned
from ..report.figure_style import (
    COLOURS,
    INK,
    SHADE,
    SOFT,
    WIDTH,
    Box,
    halo,
    label_axes,
    new_figure,
    panel,
    save_both,
)
from ..report.truth import Floats, Track
from .lineup import ComparedRun, LineUp
from .nearness import Nearness, nearness

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NAMED = 12  # robots of a kind whose starts carry their names
_TITLE = {"rover": "Ground", "quadcopter": "Air"}
_DASHES = (), (6, 2), (2, 1.2), (8, 2, 2, 2)
_LEFT, _GAP, _RIGHT, _TOP = 0.75, 0.6, 0.25, 0.45  # inches
_HEIGHT = 1.9  # of a panel of separations


class Look(NamedTuple):
    """How a run is told from the others."""

    colour: str
    dashes: tuple[float, ...]  # points on and off; empty: drawn through
    width: float

    def line(self) -> dict[str, Any]:
        """Return it in matplotlib's words."""
        style: Any = (0, self.dashes) if self.dashes else "-"
        return {"color": self.colour, "ls": style, "lw": self.width}


def look(place: int, total: int) -> Look:
    """Return the look of the run or group at `place`: later ones are thinner, so that all show."""
    rounds, colour = divmod(place, len(COLOURS))
    width = 2.2 - 0.8 * place / max(3, total - 1)
    return Look(COLOURS[colour], _DASHES[(place + rounds) % len(_DASHES)], width)


def looks_of(found: LineUp) -> list[Look]:
    """Return the look of each run, which those of its group share."""
    groups = found.groups
    shared = len(groups) < len(found.runs)
    looks = [look(groups.index(run.group), len(groups)) for run in found.runs]
    return [each._replace(width=1.1) if shared else each for each in looks]


def draw(folder: Path, found: LineUp) -> list[Path]:
    """Write every figure there is something for; return the PNGs, with an SVG beside each."""
    folder.mkdir(parents=True, exist_ok=True)
    looks = looks_of(found)
    drawn = []
    if any(run.tracks for run in found.runs):
        drawn.append(save_both(folder / "tracks.png", _tracks(found.runs, looks)))
    near = [nearness(run) for run in found.runs]
    if any(each.smallest for each in near):
        drawn.append(save_both(folder / "separations.png", _separations(found.runs, near, looks)))
    return drawn


def _tracks(runs: Sequence[ComparedRun], looks: Sequence[Look]) -> "Figure":
    """Return the tracks of all runs from above, ground and air side by side."""
    kinds = [kind for kind in _TITLE if any(t.kind == kind for run in runs for t in run.tracks)]
    low, high = _extent(runs)
    rows = _key_rows(runs)
    bottom = 0.6 + 0.24 * rows
    width = (WIDTH - _LEFT - _RIGHT - _GAP) / 2 if len(kinds) > 1 else 6.5
    height = width * (high[1] - low[1]) / (high[0] - low[0])
    wide = _LEFT + width * len(kinds) + _GAP * (len(kinds) - 1) + _RIGHT
    figure = new_figure((wide, bottom + height + _TOP))
    for k, kind in enumerate(kinds):
        box = Box(_LEFT + k * (width + _GAP), bottom, width, height)
        axes = panel(figure, box, _TITLE[kind])
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        label_axes(axes, box, "east, m", "" if k else "north, m")
        for place, (run, style) in enumerate(zip(runs, looks, strict=True)):
            _draw_run(axes, run, kind, style, 3 + 0.01 * place)
        _label_starts(axes, kind, runs)
    _key(figure, runs, looks, "start", "collision")
    return figure


def _extent(runs: Sequence[ComparedRun]) -> tuple[Floats, Floats]:
    places = [thinned(t, run.ready_at, run.done_at)[:, :2] for run in runs for t in run.tracks]
    places += [track.position[:1, :2] for run in runs for track in run.tracks]
    everything = np.concatenate(places)
    low, high = everything.min(axis=0), everything.max(axis=0)
    span = np.maximum(high - low + 1.6, (high - low).max() * np.array([0.8, 0.45]))
    middle = (low + high) / 2
    return middle - span / 2, middle + span / 2


def _draw_run(axes: "Axes", run: ComparedRun, kind: str, style: Look, order: float) -> None:
    for track in run.tracks:
        if track.kind != kind:
            continue
        way = thinned(track, run.ready_at, run.done_at)
        axes.plot(way[:, 0], way[:, 1], zorder=order, **style.line())
        axes.plot(*way[-1:, :2].T, "o", ms=5, mfc=style.colour, mec="white", mew=0.8, zorder=4)
    hits = [
        c for c in run.report["collision_events"] if kind in c["class"] or c["class"] == "mixed"
    ]
    mark: dict[str, Any] = {"ms": 10, "mfc": style.colour, "mec": "white", "mew": 1.2}
    east, north = [c["east_m"] for c in hits], [c["north_m"] for c in hits]
    axes.plot(east, north, "X", zorder=8, **mark)


def _label_starts(axes: "Axes", kind: str, runs: Sequence[ComparedRun]) -> None:
    """Mark where robots began; name those that all runs have, where there are few."""
    starts: dict[str, list[Track]] = {}
    for run in runs:
        for track in run.tracks:
            if track.kind == kind:
                starts.setdefault(track.name, []).append(track)
    for name, tracks in starts.items():
        places = np.array([track.position[0, :2] for track in tracks])
        axes.plot(places[:, 0], places[:, 1], "s", ms=5, mfc="white", mec=INK, mew=1.0, zorder=5)
        if len(starts) <= NAMED:
            by: dict[str, Any] = {"xytext": (0, 6), "textcoords": "offset points", "ha": "center"}
            axes.annotate(name, places[0], fontsize=8.5, color=INK, zorder=7, **by, **halo())


def _separations(
    runs: Sequence[ComparedRun], near: Sequence[Nearness], looks: Sequence[Look]
) -> "Figure":
    """Return the smallest separation of each class over time, a line for each run."""
    labels = [label for label in CLASSES if any(label in each.smallest for each in near)]
    rows = _key_rows(runs)
    bottom, step = 0.6 + 0.24 * rows, _HEIGHT + 0.65
    figure = new_figure((WIDTH, bottom + step * len(labels) - 0.2))
    last = max(float(each.time[-1]) for each in near if len(each.time))
    for k, label in enumerate(reversed(labels)):
        box = Box(_LEFT, bottom + k * step, WIDTH - _LEFT - _RIGHT, _HEIGHT)
        axes = panel(figure, box, f"{label.replace('-', ' to ')}: smallest separation")
        kinds = label.split("-") if label != "mixed" else ["rover", "quadcopter"]
        contact = contact_distance(kinds[0], kinds[-1])
        axes.fill_between([0, last], 0, contact, color=SHADE, alpha=0.07, lw=0)
        axes.axhline(contact, lw=1.0, color=INK)
        place: dict[str, Any] = {"xytext": (-4, 2), "textcoords": "offset points", "ha": "right"}
        axes.annotate(f"contact {contact:.3g} m", (last, contact), fontsize=8, color=INK, **place)
        top = 3 * contact
        for each, style in zip(near, looks, strict=True):
            if label in each.smallest:
                axes.plot(each.time, each.smallest[label], **style.line())
                top = max(top, 1.1 * float(np.nanmax(each.smallest[label])))
        axes.set_xlim(0, last)
        axes.set_ylim(0, top)
        label_axes(axes, box, "" if k else "time since all were ready, s", "centres, m")
    _key(figure, runs, looks)
    return figure


def _key_columns(runs: Sequence[ComparedRun]) -> int:
    groups = {run.group for run in runs}
    return max(1, min(len(groups) + 2, int(WIDTH * 14 / (max(map(len, groups)) + 8))))


def _key_rows(runs: Sequence[ComparedRun]) -> int:
    return -(-(len({run.group for run in runs}) + 2) // _key_columns(runs))


def _key(figure: "Figure", runs: Sequence[ComparedRun], looks: Sequence[Look], *marks: str) -> None:
    """Say once which run, or group of runs, has which line, and what the marks are."""
    from matplotlib.lines import Line2D

    shared = {run.group: style for run, style in zip(runs, looks, strict=True)}
    entries: list[Line2D] = [
        Line2D([], [], label=group, **style.line()) for group, style in shared.items()
    ]
    signs: dict[str, dict[str, Any]] = {
        "start": {"marker": "s", "mfc": "white", "mec": INK, "ms": 5},
        "collision": {"marker": "X", "mfc": SOFT, "mec": "white", "ms": 10},
    }
    entries += [Line2D([], [], ls="", label=mark, **signs[mark]) for mark in marks]
    place: dict[str, Any] = {"loc": "lower center", "ncols": _key_columns(runs)}
    figure.legend(handles=entries, frameon=False, fontsize=9, handlelength=3.2, **place)
