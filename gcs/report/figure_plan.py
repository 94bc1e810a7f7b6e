"""All tracks of a run from above, ground and air side by side."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...scenarios.paths import path_duration
from ...scenarios.route import Route
from ...scenarios.schema import RobotSpec, Scenario
from ...transport.frames import yaw_of
from .contact import BODIES, Pair
from .figure_style import (
    INK,
    NAMED,
    PATH,
    RATE_HZ,
    SOFT,
    WIDTH,
    Box,
    Span,
    collision_mark,
    halo,
    label_axes,
    nearest_pair,
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

TICK_S = 5
ROVER_SIZE = (0.65, 0.45)  # m, length and width
_TITLE = {"rover": "Ground", "quadcopter": "Air"}


def plan(
    scenario: Scenario, starts: Sequence[RobotSpec], tracks: Sequence[Track], verdict: Verdict
) -> "Figure":
    """Return all tracks from above, ground and air side by side."""
    kinds = [kind for kind in _TITLE if any(t.kind == kind for t in tracks)]
    low, high = extent(scenario, starts, tracks, verdict)
    left, gap, right, bottom, top = 0.75, 0.6, 0.25, 0.95, 0.6  # inches
    width = (WIDTH - left - gap - right) / 2 if len(kinds) > 1 else 6.5
    height = width * (high[1] - low[1]) / (high[0] - low[0])
    size = (left + width * len(kinds) + gap * (len(kinds) - 1) + right, bottom + height + top)
    figure = new_figure(size)
    when = span(starts, verdict)
    paths = any(path_duration(spec.path) is not None for spec in starts)
    _key(figure, paths=paths, collisions=bool(verdict.collisions), later=when.end > when.done)
    specs = {spec.name: spec for spec in starts}
    colours = robot_colours({track.name: track.kind for track in tracks})
    there = {r.name: when.ready + r.arrival for r in verdict.robots if r.arrival is not None}
    for k, kind in enumerate(kinds):
        box = Box(left + k * (width + gap), bottom, width, height)
        mine = [t for t in tracks if t.kind == kind]
        axes = panel(figure, box, "")
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        label_axes(axes, box, "east, m", "" if k else "north, m")
        nearest = nearest_pair(verdict, f"{kind}-{kind}")
        _draw_panel(axes, scenario, specs, mine, nearest, colours, when, there)
        _draw_collisions(axes, kind, verdict)
        _head(axes, box, kind, len(mine), nearest, when)
    return figure


def _head(axes: "Axes", box: Box, kind: str, count: int, nearest: Pair | None, when: Span) -> None:
    note = f"robots to size as at {_moment(nearest, when) - when.ready:.1f} s"
    if nearest is not None and nearest.min_separation is not None:
        note += f": nearest {' and '.join(nearest.names)}, {nearest.min_separation:.2f} m"
    above = 1 + 0.08 / box.height
    title = f"{_TITLE[kind]}: {count} {kind}{'s' * (count > 1)}"
    axes.set_title(title, loc="left", y=above + 0.2 / box.height, pad=0, fontsize=11, color=INK)
    axes.text(0, above, note, transform=axes.transAxes, fontsize=9, color=SOFT)


def _moment(nearest: Pair | None, when: Span) -> float:
    """Return the time at which robots are drawn: when two were nearest, or when all was done."""
    return when.done if nearest is None or nearest.time is None else nearest.time


def extent(
    scenario: Scenario, starts: Sequence[RobotSpec], tracks: Sequence[Track], verdict: Verdict
) -> tuple[Floats, Floats]:
    """Return the south-west and north-east corner of what is drawn, neither flat nor tall."""
    places = [t.position[t.time <= verdict.ended_at + 1e-6, :2] for t in tracks]
    places += [asked_for(spec, scenario)[:, :2] for spec in starts]
    everything = np.concatenate(places)
    low, high = everything.min(axis=0), everything.max(axis=0)
    span = high - low
    span = np.maximum(span + np.maximum(1.2, 0.12 * span.max()), 0.0)
    span = np.maximum(span, span.max() * np.array([0.8, 0.45]))
    middle = (low + high) / 2
    return middle - span / 2, middle + span / 2


def asked_for(spec: RobotSpec, scenario: Scenario) -> Floats:
    """Return the points of a robot's path; one where it has none."""
    duration = path_duration(spec.path)
    times = [0.0] if duration is None else np.linspace(0, duration, 200).tolist()
    route = Route(spec.path, spec, scenario.team)
    return np.array([route.at(t).position for t in times])


def _draw_panel(
    axes: "Axes",
    scenario: Scenario,
    specs: dict[str, RobotSpec],
    tracks: Sequence[Track],
    nearest: Pair | None,
    colours: dict[str, str],
    when: Span,
    there: Mapping[str, float],
) -> None:
    few = len(tracks) <= NAMED
    ways = [(t.position[:1], thinned(t, -np.inf, when.end)) for t in tracks]
    places = np.concatenate([place[:, :2] for way in ways for place in way])
    metre = 72 * axes.bbox.width / axes.figure.dpi / np.ptp(axes.get_xlim())
    for track in tracks:
        colour = colours[track.name]
        spec = specs.get(track.name)
        if spec is not None:
            _draw_goal(axes, spec, scenario, colour, few)
        _draw_track(axes, track, when, colour, few, there.get(track.name, when.done))
        _draw_robot(axes, track, _moment(nearest, when), colour)
        if few or (nearest and track.name in nearest.names):
            label = _label_start(axes, track, places, metre, colour)
            places = np.concatenate([places, label])


def _draw_track(
    axes: "Axes", track: Track, when: Span, colour: str, few: bool, arrived: float
) -> None:
    """Draw the way there with the seconds on it until it `arrived`, and thinly the way home."""
    alpha = 0.95 if few else 0.45
    there, home = (thinned(track, *part) for part in ((-np.inf, when.done), (when.done, when.end)))
    line: dict[str, Any] = {"color": colour, "zorder": 3, "solid_capstyle": "round"}
    axes.plot(*there.T[:2], lw=1.6 if few else 0.9, alpha=alpha, **line)
    if len(home) > 1:
        axes.plot(*home.T[:2], lw=0.7 if few else 0.4, alpha=0.6 * alpha, **line)
    last = min(track.time[-1], when.done, arrived)
    seconds = np.arange(TICK_S, last - when.ready + 1e-6, TICK_S)
    east, north = (
        np.interp(seconds + when.ready, track.time, track.position[:, axis]) for axis in (0, 1)
    )
    size, edge = (3.6, 1.0) if few else (1.8, 0.6)
    dots: dict[str, Any] = {"ms": size, "mfc": "white", "mec": colour, "mew": edge}
    axes.plot(east, north, "o", alpha=alpha, zorder=4, **dots)
    if few:
        _write_times(axes, seconds, east, north)


def thinned(track: Track, start: float, end: float) -> Floats:
    """Return places of a track between two times, as many as a figure needs."""
    first, last = np.searchsorted(track.time, (start - 1e-6, end + 1e-6))
    step = max(1, round(len(track) / max(1e-9, float(np.ptp(track.time))) / RATE_HZ))
    return track.position[first:last:step]


def _write_times(axes: "Axes", seconds: Floats, east: Floats, north: Floats) -> None:
    """Write the seconds beside every second tick that is well away from the last one written."""
    last = (np.inf, np.inf)
    for s, x, y in zip(seconds.tolist(), east.tolist(), north.tolist(), strict=True):
        if s % (2 * TICK_S) == 0 and np.hypot(x - last[0], y - last[1]) > 0.8:
            axes.annotate(
                f"{s:.0f}",
                (x, y),
                xytext=(4, 3),
                textcoords="offset points",
                fontsize=7.5,
                color=SOFT,
                zorder=6,
                **halo(),
            )
            last = (x, y)


def _draw_goal(axes: "Axes", spec: RobotSpec, scenario: Scenario, colour: str, few: bool) -> None:
    """Draw the target as a cross, or the path asked for as a dashed line."""
    points = asked_for(spec, scenario)
    if len(points) > 1:
        axes.plot(points[:, 0], points[:, 1], "--", lw=1.0 if few else 0.6, color=PATH, zorder=2)
    else:
        size, width = (9, 1.8) if few else (4, 0.8)
        axes.plot(*points[0, :2], "x", ms=size, mew=width, color=colour, zorder=5)


def _draw_robot(axes: "Axes", track: Track, when: float, colour: str) -> None:
    """Draw one robot to size: its contact circle and its shape."""
    from matplotlib.patches import Circle, Rectangle
    from matplotlib.transforms import Affine2D

    row = int(np.searchsorted(track.time, when - 1e-6).clip(max=len(track) - 1))
    east, north = track.position[row, :2].tolist()
    w, x, y, z = track.quaternion[row].tolist()
    place = Affine2D().rotate(yaw_of((w, x, y, z))).translate(east, north) + axes.transData
    circle = Circle(
        (east, north), BODIES[track.kind].radius, fill=False, lw=0.7, ec=colour, zorder=5
    )
    axes.add_patch(circle)
    if track.kind == "rover":
        length, width = ROVER_SIZE
        box = Rectangle((-length / 2, -width / 2), length, width, fc=colour, ec="none", alpha=0.35)
        nose = ((0.1, length / 2), (0, 0))
        axes.add_patch(box)
        box.set_transform(place)
        axes.plot(*nose, color=colour, lw=1.2, transform=place, zorder=5)
    else:
        arm = BODIES["quadcopter"].radius
        for ends in (((-arm, arm), (0, 0)), ((0, 0), (-arm, arm))):
            axes.plot(*ends, color=colour, lw=1.0, transform=place, zorder=5)


def _label_start(axes: "Axes", track: Track, places: Floats, metre: float, colour: str) -> Floats:
    """Mark where a robot began and write its name where there is room; return where that is.

    `metre` is in points, `places` is what the name should not cover.
    """
    start = track.position[0, :2]
    axes.plot(*start, "s", ms=6, mfc="white", mec=colour, mew=1.4, zorder=5)
    half = np.array([2.7 * len(track.name), 5.0])  # points, of the text
    low, high = np.transpose((axes.get_xlim(), axes.get_ylim()))
    best, room = np.zeros(2), -np.inf
    for dx, dy in ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1)):
        offset = np.array([dx, dy]) * (half + 6)
        apart = np.abs((places - start) * metre - offset) - half
        clear = float(np.hypot.reduce(np.maximum(apart, 0), axis=1).min())
        corners = start + (offset + half * [[-1], [1]]) / metre
        if (corners < low).any() or (corners > high).any():
            clear -= 20  # points: rather inside of the axes
        if clear > room + 1.0:
            best, room = offset, clear
    style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 9, "color": INK}
    offset_by: dict[str, Any] = {"xytext": tuple(best), "textcoords": "offset points"}
    axes.annotate(track.name, (start[0], start[1]), zorder=7, **offset_by, **style, **halo())
    covered: Floats = start + (best + np.outer(np.linspace(-1, 1, 5), half * (1, 0))) / metre
    return covered


def _draw_collisions(axes: "Axes", kind: str, verdict: Verdict) -> None:
    mine = [c for c in verdict.collisions if c.pair_class in (f"{kind}-{kind}", "mixed")]
    if mine:
        places = np.array([c.position for c in mine])
        axes.plot(places[:, 0], places[:, 1], zorder=8, **collision_mark(len(mine)))


def _key(figure: "Figure", *, paths: bool, collisions: bool, later: bool) -> None:
    """Say once what the symbols are."""
    from matplotlib.lines import Line2D

    entries = [
        Line2D([], [], marker="s", ls="", mfc="white", mec=SOFT, mew=1.4, ms=6, label="start"),
        Line2D([], [], marker="x", ls="", color=SOFT, ms=8, mew=1.8, label="target"),
        Line2D(
            [], [], marker="o", color=SOFT, mfc="white", ms=4, label=f"every {TICK_S} s after ready"
        ),
    ]
    if paths:
        entries.append(Line2D([], [], ls="--", color=PATH, label="path asked for"))
    if later:
        entries.append(Line2D([], [], lw=0.7, color=SOFT, label="after all had arrived"))
    if collisions:
        entries.append(Line2D([], [], label="collision", **collision_mark(1)))
    figure.legend(
        handles=entries, loc="lower center", ncols=6, frameon=False, fontsize=9, labelcolor=INK
    )
