"""All tracks in space, seen from aside: a parallel projection, so that equal lengths stay equal."""

from collections.abc import Sequence
from math import cos, pi, radians, sin
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...scenarios.schema import RobotSpec, Scenario
from .figure_plan import asked_for, extent, thinned
from .figure_style import (
    GRID,
    INK,
    NAMED,
    PATH,
    SOFT,
    WIDTH,
    Box,
    collision_mark,
    halo,
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

_ABOVE = radians(28)  # from where one looks
_ASIDE = radians(24)  # between the way most tracks go and the picture's lower edge
_LOFTY = 0.16  # of the ground's width: what is flatter is stretched
_STEPS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000)  # m


class _View(NamedTuple):
    """From east, north, up to the picture, m."""

    turn: float  # rad, of the ground
    stretch: float  # of heights

    def __call__(self, places: Any) -> Floats:
        east, north, up = np.moveaxis(np.asarray(places, float), -1, 0)
        across = east * cos(self.turn) - north * sin(self.turn)
        ahead = east * sin(self.turn) + north * cos(self.turn)
        return np.stack([across, ahead * sin(_ABOVE) + up * self.stretch * cos(_ABOVE)], -1)


def space(
    scenario: Scenario, starts: Sequence[RobotSpec], tracks: Sequence[Track], verdict: Verdict
) -> "Figure":
    """Return all tracks in space, with their shadows on the ground."""
    when = span(starts, verdict)
    low, high = extent(scenario, starts, tracks, verdict)
    ways = [thinned(track, when.ready, when.done) for track in tracks]
    top = max((float(way[:, 2].max()) for way in ways if len(way)), default=0.0)
    view = _choose_view(ways, top, float(max(high - low)))
    ground = view([(e, n, 0) for e in (low[0], high[0]) for n in (low[1], high[1])])
    (left, bottom), (right, ceiling) = ground.min(axis=0), ground.max(axis=0)
    ceiling += top * view.stretch * cos(_ABOVE)
    margin = 0.07 * (right - left)
    box_width = WIDTH - 0.5
    scale = min(box_width / (right - left + 2 * margin), 5.5 / (ceiling - bottom + 2 * margin))
    height = scale * (ceiling - bottom + 2 * margin)
    figure = new_figure((WIDTH, height + 0.55))
    box = Box(0.25, 0.1, box_width, height)
    note = "shadows on the ground" + (f"; heights x {view.stretch:g}" if view.stretch > 1 else "")
    axes = panel(figure, box, "Tracks in space", note)
    axes.set_axis_off()
    slack = (box_width / scale - (right - left)) / 2
    axes.set_xlim(left - slack, right + slack)
    axes.set_ylim(bottom - margin, ceiling + margin)
    _draw_ground(axes, view, low, high, top)
    specs = {spec.name: spec for spec in starts}
    colours = robot_colours({track.name: track.kind for track in tracks})
    few = len(tracks) <= 2 * NAMED
    for track, way in zip(tracks, ways, strict=True):
        spec = specs.get(track.name)
        goal = None if spec is None else asked_for(spec, scenario)[-1]
        _draw_way(axes, view, way, goal, colours[track.name], few)
    if few:
        found = [(t.name, view(way[0])) for t, way in zip(tracks, ways, strict=True) if len(way)]
        _write_names(axes, found, scale)
    _draw_collisions(axes, view, verdict)
    return figure


def _choose_view(ways: Sequence[Floats], top: float, width: float) -> _View:
    """Turn the ground so that most of the way goes across; stretch what is flat."""
    places = np.concatenate(ways)[:, :2]
    spread, axes = np.linalg.eigh(np.cov(places.T)) if len(places) > 2 else ([0, 0], np.eye(2))
    turn = radians(-30)
    if spread[1] > 2 * spread[0]:
        along = float(np.arctan2(axes[1, 1], axes[0, 1]))
        turn = (_ASIDE - along + pi / 2) % pi - pi / 2
    wanted = _LOFTY * width / max(top, 1e-9)
    return _View(turn, next((k for k in (1, 2, 3, 5) if k >= wanted), 5) if top > 0.1 else 1)


def _draw_ground(axes: "Axes", view: _View, low: Floats, high: Floats, top: float) -> None:
    """Draw a grid of the ground with its distances, and a scale of heights at its far corner."""
    step = next((s for s in _STEPS if max(high - low) / s <= 8), _STEPS[-1])
    lines: list[Floats] = []
    text: dict[str, Any] = {"fontsize": 8.5, "color": SOFT, "ha": "center", "va": "center"}
    front = [  # the edge that is nearer: of constant north, of constant east
        min((low[1], high[1]), key=lambda n: view((0, n, 0))[1]),
        min((low[0], high[0]), key=lambda e: view((e, 0, 0))[1]),
    ]
    beyond = 0.06 * max(high - low)
    for axis, name in enumerate(("east", "north")):
        other = 1 - axis
        out = np.sign(front[axis] - (low[other] + high[other]) / 2) * beyond
        marks = (
            np.arange(np.ceil(low[axis] / step), np.floor(high[axis] / step) + 1) * step + 0.0
        )  # no -0
        for mark in marks.tolist():
            ends = np.zeros((2, 3))
            ends[:, axis], ends[:, other] = mark, (low[other], high[other])
            lines.append(view(ends))
            place = np.zeros(3)
            place[axis], place[other] = mark, front[axis] + out
            label = f"{name} {mark:g} m" if mark == marks[-1] else f"{mark:g}"
            east, north = view(place).tolist()
            axes.text(east, north, label, **text)
    edge = [(low[0], low[1], 0), (high[0], low[1], 0), (high[0], high[1], 0), (low[0], high[1], 0)]
    lines.append(view([*edge, edge[0]]))
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(lines, colors=GRID, linewidths=0.9, zorder=1))
    if top > 0.3:
        far = np.array([low[0] + high[0] - front[1], low[1] + high[1] - front[0]])
        step = next(s for s in _STEPS if top / s <= 4)
        marks = np.arange(0, top + 1e-6, step)
        pole = view([(*far, up) for up in marks])
        axes.plot(*pole.T, "_-", color=SOFT, lw=0.9, ms=6, zorder=1)
        for place, up in zip(pole[1:], marks[1:], strict=True):
            side: dict[str, Any] = {"xytext": (7, 0), "textcoords": "offset points", "va": "center"}
            axes.annotate(f"up {up:g} m", place, fontsize=8.5, color=SOFT, **side)


def _draw_way(
    axes: "Axes", view: _View, way: Floats, goal: Floats | None, colour: str, few: bool
) -> None:
    width, alpha = (1.6, 0.95) if few else (0.8, 0.45)
    if goal is not None:
        axes.plot(*view(goal), "x", ms=8 if few else 4, mew=1.6 if few else 0.8, color=colour)
    if not len(way):
        return
    if float(way[:, 2].max()) > 0.3:
        shadow = way * (1, 1, 0)
        axes.plot(*view(shadow).T, color=PATH, lw=0.6 * width, alpha=0.6 * alpha, zorder=2)
        if few:
            ends = [way[0], shadow[0]], *([[goal, goal * (1, 1, 0)]] if goal is not None else [])
            for end in ends:
                axes.plot(*view(end).T, ":", color=PATH, lw=0.9, zorder=2)
    axes.plot(*view(way).T, color=colour, lw=width, alpha=alpha, zorder=3)
    if few:
        axes.plot(*view(way[0]), "s", ms=5.5, mfc="white", mec=colour, mew=1.4, zorder=5)


def _write_names(axes: "Axes", starts: Sequence[tuple[str, Floats]], scale: float) -> None:
    """Write names above where robots began, higher where another is; `scale`: inches per m."""
    style: dict[str, Any] = {"ha": "center", "va": "bottom", "fontsize": 9, "color": INK}
    taken: list[Floats] = []
    for name, start in sorted(starts, key=lambda item: float(item[1][0])):
        place = start * scale + np.array([0.0, 0.07])
        while any(
            abs(place - other)[0] < 0.08 * len(name) and abs(place - other)[1] < 0.14
            for other in taken
        ):
            place = place + np.array([0.0, 0.15])
        taken.append(place)
        up = 72 * float(place[1] - start[1] * scale)
        offset: dict[str, Any] = {"xytext": (0, up), "textcoords": "offset points"}
        axes.annotate(name, (start[0], start[1]), zorder=7, **offset, **style, **halo())


def _draw_collisions(axes: "Axes", view: _View, verdict: Verdict) -> None:
    if verdict.collisions:
        places = view([c.position for c in verdict.collisions])
        axes.plot(*places.T, zorder=8, **collision_mark(len(places)))
