"""Draw the paper's Figures 4, 5 and 6 beside law `safe`: `python docs/paper_figures.py [FOLDER]`.

Left what the paper's equations do (eq. 22 and 23 in their most favourable reading), right what
mavherd does unless told otherwise. One mission, one seed, so that only the control differs.
"""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from missions import CROSSING, TRACKING, TRAFFIC, Flight, fly
from paper_panels import (
    KIND_COLOURS,
    colours_of,
    extent,
    from_above,
    how_far_off,
    how_near,
    in_space,
)

from mavherd.gcs.report.figure_plan import asked_for
from mavherd.gcs.report.figure_style import (
    INK,
    PATH,
    SOFT,
    Box,
    collision_mark,
    label_axes,
    new_figure,
    panel,
    save,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PICTURES = Path(__file__).parent / "pictures"
WIDTH, LEFT, GAP, RIGHT = 11.0, 0.7, 0.75, 0.35  # inches
COLUMN = (WIDTH - LEFT - GAP - RIGHT) / 2
SPACE, STRIP = 3.2, 1.5  # heights: the view in space; what goes over time
FOOT, HEAD, BETWEEN = 1.1, 0.35, 0.95  # below all, above all, and between panels
GAINS = tuple(f"robots.{k}.profile=paper" for k in range(4))
WAITING = tuple(f"robots.{k}.dwell_s=30" for k in range(6))
OFF_M = 0.8
SINCE = "time since all were ready, s"


class Side(NamedTuple):
    """One column of a figure."""

    title: str
    flight: Flight


def figure4() -> "Figure":
    """Return mission 1: four robots on their paths, and how far they are from where they should."""
    pushed = "disturbance=held"
    sides = (
        Side("Gains of the paper's Table 2", fly(TRACKING, "paper", pushed, *GAINS)),
        Side("mavherd: law safe, default gains", fly(TRACKING, "safe", pushed)),
    )
    room = extent(side.flight for side in sides)
    figure = new_figure((WIDTH, FOOT + STRIP + 0.55 + SPACE + HEAD))
    for k, (title, flight) in enumerate(sides):
        left = LEFT + k * (COLUMN + GAP)
        in_space(figure, Box(left, FOOT + STRIP + 0.55, COLUMN, SPACE), title, flight, room)
        box = Box(left, FOOT, COLUMN, STRIP)
        axes = panel(figure, box, "Distance from where it should be, pushed by ±0.4 N")
        label_axes(axes, box, SINCE, "" if k else "m")
        how_far_off(axes, flight, OFF_M)
    _key(figure, sides[0].flight)
    return figure


def figure5() -> "Figure":
    """Return mission 2: to places on one line, past those who wait there."""
    return _beside(CROSSING, *WAITING)


def figure6() -> "Figure":
    """Return mission 3: oncoming traffic on two circles."""
    return _beside(TRAFFIC)


def _beside(mission: str, *settings: str) -> "Figure":
    """Return tracks in space, final positions and separations under law `paper` and `safe`."""
    sides = (
        Side("(a) Law paper: equations 22 and 23", fly(mission, "paper", *settings)),
        Side("(a) Law safe: mavherd's default", fly(mission, "safe", *settings)),
    )
    room = extent(side.flight for side in sides)
    wide, high = room.high - room.low
    plan = COLUMN * float(high / wide)
    figure = new_figure((WIDTH, FOOT + STRIP + BETWEEN + plan + 0.6 + SPACE + HEAD))
    for k, (title, flight) in enumerate(sides):
        left = LEFT + k * (COLUMN + GAP)
        bottom = FOOT + STRIP + BETWEEN
        in_space(figure, Box(left, bottom + plan + 0.6, COLUMN, SPACE), title, flight, room)
        box = Box(left, bottom, COLUMN, plan)
        axes = panel(figure, box, "(b) Final positions, robots to size")
        label_axes(axes, box, "east, m", "" if k else "north, m")
        from_above(axes, flight, room)
        box = Box(left, FOOT, COLUMN, STRIP)
        axes = panel(figure, box, "(c) The two nearest of a kind, centre to centre")
        label_axes(axes, box, SINCE, "" if k else "m")
        how_near(axes, flight)
    _key(figure, sides[0].flight, collisions=True)
    return figure


def _key(figure: "Figure", flight: Flight, *, collisions: bool = False) -> None:
    """Say once who is who and what the symbols are."""
    from matplotlib.lines import Line2D

    robots = [Line2D([], [], color=c, lw=2.5, label=n) for n, c in colours_of(flight).items()]
    style: dict[str, Any] = {"ls": "", "color": SOFT, "mew": 1.5}
    marks = [
        Line2D([], [], marker="s", mfc="white", ms=5, label="start", **style),
        Line2D([], [], marker="o", ms=5, label="end", **style),
    ]
    lengths = {len(asked_for(spec, flight.scenario)) for spec in flight.starts}
    if lengths - {1}:
        marks.append(Line2D([], [], ls="--", color=PATH, label="path asked for"))
    if 1 in lengths:
        marks.append(Line2D([], [], marker="x", ms=8, label="target", **style))
    if collisions:
        marks.append(Line2D([], [], label="collision", **collision_mark(1)))
        for kind, colour in KIND_COLOURS.items():
            marks.append(Line2D([], [], color=colour, lw=1.7, label=f"(c) {kind}s"))
        marks.append(Line2D([], [], color=SOFT, ls="--", lw=1.2, label="(c) they touch"))
    text: dict[str, Any] = {"frameon": False, "fontsize": 9, "labelcolor": INK}
    for entries, inches in ((robots, 0.26), (marks, 0.02)):
        place = (0.5, inches / figure.get_size_inches()[1])
        options: dict[str, Any] = {
            "loc": "lower center",
            "bbox_to_anchor": place,
            "ncols": len(entries),
        }
        figure.legend(handles=entries, **options, **text)


def main(folder: Path = PICTURES) -> None:
    """Write figure-4.png, figure-5.png and figure-6.png."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, make in ((4, figure4), (5, figure5), (6, figure6)):
        path = save(folder / f"figure-{number}.png", make())
        print(f"{path}: {path.stat().st_size // 1024} kB")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
