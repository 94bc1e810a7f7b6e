"""All tracks of a run from above, ground and air side by side."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...scenarios.paths import path_duration
from ...scenarios.route import Route
from ...scenarios.schema import RobotSpec, Scenario
from ...transport.frames import yaw_of
from .contact import BODIES
from .figure_style import (
    INK,
    NAMED,
    PATH,
    RATE_HZ,
    SOFT,
    collision_mark,
    halo,
    nearest_pair,
    new_figure,
    quiet,
    robot_colours,
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
    low, high = _extent(scenario, starts, tracks, verdict)
    width = 5.6 if len(kinds) > 1 else 7.0
    height = width * (high[1] - low[1]) / (high[0] - low[0])
    left, gap, right, bottom, top = 0.75, 0.55, 0.25, 1.0, 0.75  # inches
    size = (left + width * len(kinds) + gap * (len(kinds) - 1) + right, bottom + height + top)
    figure = new_figure(size)
    paths = any(path_duration(spec.path) is not None for spec in starts)
    _key(figure, paths=paths, collisions=bool(verdict.collisions))
    specs = {spec.name: spec for spec in starts}
    colours = robot_colours({track.name: track.kind for track in tracks})
    for k, kind in enumerate(kinds):
        corner = (left + k * (width + gap)) / size[0], bottom / size[1]
        axes = figure.add_axes((*corner, width / size[0], height / size[1]))
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        axes.set_xlabel("east, m")
        axes.set_ylabel("" if k else "north, m")
        mine = [t for t in tracks if t.kind == kind]
        _plan_panel(axes, kind, scenario, specs, mine, verdict, colours)
    return figure


def _extent(
    scenario: Scenario, starts: Sequence[RobotSpec], tracks: Sequence[Track], verdict: Verdict
) -> tuple[Floats, Floats]:
    """Return the south-west and north-east corner of what is drawn, neither flat nor tall."""
    places = [t.position[t.time <= verdict.ended_at + 1e-6, :2] for t in tracks]
    places += [_asked_for(spec, scenario)[:, :2] for spec in starts]
    everything = np.concatenate(places)
    low, high = everything.min(axis=0), everything.max(axis=0)
    span = high - low
    span = np.maximum(span + np.maximum(1.2, 0.12 * span.max()), 0.0)
    span = np.maximum(span, span.max() * np.array([0.8, 0.45]))
    middle = (low + high) / 2
    return middle - span / 2, middle + span / 2


def _asked_for(spec: RobotSpec, scenario: Scenario) -> Floats:
    """Return the points of a robot's path; one where it has none."""
    duration = path_duration(spec.path)
    times = [0.0] if duration is None else np.linspace(0, duration, 200).tolist()
    route = Route(spec.path, spec, scenario.team)
    return np.array([route.at(t).position for t in times])


def _plan_panel(
    axes: "Axes",
    kind: str,
    scenario: Scenario,
    specs: dict[str, RobotSpec],
    tracks: Sequence[Track],
    verdict: Verdict,
    colours: dict[str, str],
) -> None:
    nearest = nearest_pair(verdict, f"{kind}-{kind}")
    when = verdict.ended_at if nearest is None or nearest.time is None else nearest.time
    few = len(tracks) <= NAMED
    centre = np.mean([track.position[0] for track in tracks], axis=0)
    for track in tracks:
        colour = colours[track.name]
        spec = specs.get(track.name)
        if spec is not None:
            _draw_goal(axes, spec, scenario, colour, few)
        _draw_track(axes, track, verdict, colour, few)
        _draw_robot(axes, track, when, colour)
        if few or (nearest and track.name in nearest.names):
            _label_start(axes, track, centre, colour)
    _draw_collisions(axes, kind, verdict)
    note = f"robots to size as at {when - (verdict.ready_at or 0.0):.1f} s"
    if nearest is not None:
        note += f": nearest {' and '.join(nearest.names)}, {nearest.min_separation:.2f} m"
    quiet(axes)
    title = f"{_TITLE[kind]}: {len(tracks)} {kind}{'s' * (len(tracks) > 1)}"
    axes.set_title(title, loc="left", pad=20, fontsize=12, color=INK)
    axes.text(0, 1.012, note, transform=axes.transAxes, fontsize=9, color=SOFT)


def _draw_track(axes: "Axes", track: Track, verdict: Verdict, colour: str, few: bool) -> None:
    ready = verdict.ready_at or 0.0
    inside = track.time <= verdict.ended_at + 1e-6
    position = track.position[inside]
    thin = slice(None, None, max(1, round(len(position) / max(1e-9, np.ptp(track.time)) / RATE_HZ)))
    line: dict[str, Any] = {
        "color": colour,
        "lw": 1.6 if few else 0.9,
        "alpha": 0.95 if few else 0.45,
    }
    axes.plot(position[thin, 0], position[thin, 1], zorder=3, solid_capstyle="round", **line)
    last = min(track.time[-1], verdict.ended_at)
    seconds = np.arange(TICK_S, last - ready + 1e-6, TICK_S)
    east, north = (np.interp(seconds + ready, track.time, track.position[:, a]) for a in (0, 1))
    axes.plot(
        east,
        north,
        "o",
        ms=3.6 if few else 1.8,
        mfc="white",
        mec=colour,
        mew=1.0 if few else 0.6,
        alpha=line["alpha"],
        zorder=4,
    )
    if few:
        _write_times(axes, seconds, east, north, colour)


def _write_times(axes: "Axes", seconds: Floats, east: Floats, north: Floats, colour: str) -> None:
    """Write the seconds beside every second tick that is well away from the last one written."""
    last = (np.inf, np.inf)
    for s, x, y in zip(seconds.tolist(), east.tolist(), north.tolist(), strict=True):
        if s % (2 * TICK_S) == 0 and np.hypot(x - last[0], y - last[1]) > 0.8:
            axes.annotate(
                f"{s:.0f}",
                (x, y),
                xytext=(4, 3),
                textcoords="offset points",
                fontsize=7,
                color=colour,
                zorder=6,
                path_effects=halo(),
            )
            last = (x, y)


def _draw_goal(axes: "Axes", spec: RobotSpec, scenario: Scenario, colour: str, few: bool) -> None:
    """Draw the target as a cross, or the path asked for as a dashed line."""
    points = _asked_for(spec, scenario)
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


def _label_start(axes: "Axes", track: Track, centre: Floats, colour: str) -> None:
    """Mark where a robot began and write its name on the side away from the others."""
    east, north = track.position[0, :2].tolist()
    axes.plot(east, north, "s", ms=6, mfc="white", mec=colour, mew=1.4, zorder=5)
    outward = np.array([east, north]) - centre[:2]
    size = float(np.hypot(*outward)) or 1.0
    dx, dy = (outward / size).tolist() if size > 1e-6 else (0.0, -1.0)
    axes.annotate(
        track.name,
        (east, north),
        xytext=(9 * dx, 9 * dy),
        textcoords="offset points",
        ha="left" if dx > 0.4 else "right" if dx < -0.4 else "center",
        va="bottom" if dy > 0.4 else "top" if dy < -0.4 else "center",
        fontsize=9,
        color=colour,
        zorder=7,
        path_effects=halo(),
    )


def _draw_collisions(axes: "Axes", kind: str, verdict: Verdict) -> None:
    mine = [c for c in verdict.collisions if c.pair_class in (f"{kind}-{kind}", "mixed")]
    if mine:
        places = np.array([c.position for c in mine])
        axes.plot(places[:, 0], places[:, 1], zorder=8, **collision_mark(len(mine)))


def _key(figure: "Figure", *, paths: bool, collisions: bool) -> None:
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
    if collisions:
        entries.append(Line2D([], [], label="collision", **collision_mark(1)))
    figure.legend(handles=entries, loc="lower center", ncols=5, frameon=False, fontsize=9)
