"""Several runs in one recording, on one timeline that is 0 when all robots of a run were ready.

Each run, or of many each group of them, has a colour; each run has a branch of its own,
`world/<run>`: where its robots are, their tracks, where two of them touched.
`separation/<class>/<run>` says how near they came.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..compare.lineup import ComparedRun, LineUp
from ..compare.measures import Standing
from ..compare.nearness import nearness
from ..compare.words import LEGEND, head, mark, shown
from ..new_file import new_file
from ..report.contact import BODIES, CLASSES, contact_distance
from ..report.figure_style import COLOURS, on_dark
from ..report.truth import Floats, Track
from .shapes import mesh3d, shape_of, whole
from .stage import stage_of
from .stream import Stream, rgb
from .views import world_view

POSE_EVERY = 5  # rows of the 100 Hz truth
TRACK_EVERY = 10
SHAPED = 80  # robots of all runs; more are drawn as balls
_WIDTHS = 3.0, 1.2  # points, of the first run's tracks and of the last one's
_CROSS_M = 0.35
_ASPECT = 1.15  # of the view, width over height
_CONTACT = (230, 232, 235)


def record_comparison(path: Path, found: LineUp, measured: Sequence[Standing]) -> Path:
    """Write the recording; it has its name when it is complete."""
    with new_file(path) as part:
        stream = Stream(f"compare-{path.resolve().parent.name}", file=part)
        try:
            stream.name(f"{len(found.runs)} runs of {', '.join(found.scenarios)}")
            classes = _record(stream, found)
            _numbers(stream, found, measured)
            stream.blueprint(_layout(found, classes))
        finally:
            stream.close()
    return path


def colour_of(place: int) -> str:
    """Return the colour of the run or group at `place`: as in the figures, but seen on dark."""
    return on_dark(COLOURS[place % len(COLOURS)])


def _record(stream: Stream, found: LineUp) -> list[str]:
    """Record all runs; return the classes of pairs that there are."""
    import rerun as rr

    stream.static("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    shaped = sum(len(run.tracks) for run in found.runs) <= SHAPED
    classes: dict[str, float] = {}  # the latest time, s
    for place, run in enumerate(found.runs):
        branch = rr.escape_entity_path_part(run.label)
        colour = rgb(colour_of(found.groups.index(run.group)))
        if shaped:
            for track in run.tracks:
                _pose(stream, f"world/{branch}/{track.name}", run, track, colour)
        else:
            _balls(stream, f"world/{branch}/robots", run, colour)
        step = (_WIDTHS[0] - _WIDTHS[1]) / max(1, len(found.runs) - 1)
        _tracks(stream, f"world/{branch}", run, colour, _WIDTHS[0] - step * place)
        near = nearness(run)
        for label, metres in near.smallest.items():
            entity = f"separation/{label}/{branch}"
            lines = rr.SeriesLines(names=run.label, colors=colour, widths=2)
            stream.static(entity, lines)
            stream.columns(entity, near.time, rr.Scalars.columns(scalars=metres))
            classes[label] = max(classes.get(label, 0.0), float(near.time[-1]))
    for label, last in classes.items():
        kinds = label.split("-") if label != "mixed" else ["rover", "quadcopter"]
        contact = contact_distance(kinds[0], kinds[-1])
        entity = f"separation/{label}/contact"
        name = f"contact, {contact:.2f} m"
        stream.static(entity, rr.SeriesLines(names=name, colors=_CONTACT, widths=1))
        ends = np.array([0.0, last])
        stream.columns(entity, ends, rr.Scalars.columns(scalars=[contact, contact]))
    return [label for label in CLASSES if label in classes]


def _pose(
    stream: Stream, entity: str, run: ComparedRun, track: Track, colour: tuple[int, int, int]
) -> None:
    """Record where a robot is, until the run's work is done, and its shape in the run's colour."""
    import rerun as rr

    rows = slice(0, int(np.searchsorted(track.time, run.done_at + 1e-6)), POSE_EVERY)
    turned = track.quaternion[rows][:, [1, 2, 3, 0]]
    poses = rr.Transform3D.columns(translation=track.position[rows], quaternion=turned)
    stream.columns(entity, track.time[rows] - run.ready_at, poses)
    stream.static(entity, mesh3d(whole(shape_of(track.kind, colour, fine=False))))


def _balls(stream: Stream, entity: str, run: ComparedRun, colour: tuple[int, int, int]) -> None:
    """Record where all robots of a run are, as balls."""
    import rerun as rr

    if not run.tracks:
        return
    first = max(track.time[0] for track in run.tracks)
    last = min(run.done_at, max(track.time[-1] for track in run.tracks))
    time = np.arange(first, last, POSE_EVERY / 100)
    places = np.stack([_at(track, time) for track in run.tracks], axis=1)  # (t, robots, 3)
    radii = [BODIES[track.kind].radius if track.kind in BODIES else 0.3 for track in run.tracks]
    stream.static(entity, rr.Points3D.from_fields(radii=radii, colors=[colour]))
    columns = rr.Points3D.columns(positions=places.reshape(-1, 3))
    counts = [len(run.tracks)] * len(time)
    stream.columns(entity, time - run.ready_at, columns.partition(counts))


def _at(track: Track, time: Floats) -> Floats:
    each = [np.interp(time, track.time, track.position[:, axis]) for axis in range(3)]
    return np.stack(each, axis=1)


def _tracks(
    stream: Stream, branch: str, run: ComparedRun, colour: tuple[int, int, int], width: float
) -> None:
    """Record the whole tracks, which are seen at all times, and where two robots touched."""
    import rerun as rr

    strips = []
    for track in run.tracks:
        first, last = np.searchsorted(track.time, (run.ready_at, run.done_at + 1e-6))
        strips.append(track.position[first:last:TRACK_EVERY].astype(np.float32))
    radii = rr.Radius.ui_points(width / 2)
    lines = rr.LineStrips3D(strips, colors=[(*colour, 190)], radii=radii)
    stream.static(f"{branch}/tracks", lines)
    hits = run.report["collision_events"]
    if not hits:
        return
    arms = np.array([[1, 1, 0], [1, -1, 0]]) * _CROSS_M
    places = np.array([[c["east_m"], c["north_m"], c["up_m"] + 0.05] for c in hits])
    crosses = (places[:, None, None] + np.stack([arms, -arms], axis=1)).reshape(-1, 2, 3)
    said = [f"{run.label}: {' and '.join(c['robots'])}" for c in hits]
    marks: dict[str, Any] = {"colors": [colour], "radii": rr.Radius.ui_points(3)}
    stream.static(f"{branch}/collisions", rr.LineStrips3D(crosses.astype(np.float32), **marks))
    names = rr.Points3D(places, radii=0.001, colors=[colour], labels=said, show_labels=False)
    stream.static(f"{branch}/collisions/names", names)


def _numbers(stream: Stream, found: LineUp, measured: Sequence[Standing]) -> None:
    """Record the table of numbers, a line for each run where runs are many."""
    import rerun as rr

    labels = [run.head for run in found.runs]
    verdicts = ["passed" if run.report["passed"] else "FAILED" for run in found.runs]
    table = [["", *labels], ["verdict", *verdicts]]
    for standing in measured:
        cells = [
            f"{shown(standing.measure, value)} {mark(standing, k)}".strip()
            for k, value in enumerate(standing.values)
        ]
        table.append([head(standing.measure), *cells])
    if len(labels) > 5:
        table = [list(row) for row in zip(*table[:8], strict=True)]
    rule = ["---", *(["---:"] * (len(table[0]) - 1))]
    lines = [
        f"| {' | '.join(_cell(cell) for cell in row)} |" for row in [table[0], rule, *table[1:]]
    ]
    text = "\n".join([*lines, "", LEGEND])
    stream.static("numbers", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN))


def _cell(text: str) -> str:
    return text.replace("|", "/")


def _layout(found: LineUp, classes: Sequence[str]) -> Any:
    """Return the blueprint: the world with all tracks, separations over one another, numbers."""
    import rerun.blueprint as rrb

    stages = [stage_of(run.flown.scenario) for run in found.runs]
    robots = tuple(robot for stage in stages for robot in stage.robots)
    world = world_view(stages[0]._replace(robots=robots), _ASPECT)
    plots = [
        rrb.TimeSeriesView(
            name=f"Smallest separation, m: {label.replace('-', ' to ')}",
            origin=f"/separation/{label}",
            plot_legend=rrb.PlotLegend(visible=len(found.runs) <= 10, corner=rrb.Corner2D.LeftTop),
        )
        for label in classes
    ]
    numbers = rrb.TextDocumentView(name="Numbers", origin="/numbers")
    shares = [*([2] * len(plots)), 3]
    return rrb.Blueprint(
        rrb.Horizontal(
            world, rrb.Vertical(*plots, numbers, row_shares=shares), column_shares=[3, 2]
        ),
        rrb.TimePanel(timeline="sim_time", state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
    )
