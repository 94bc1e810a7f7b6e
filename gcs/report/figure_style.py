"""What the figures share: colours, sizes and a quiet frame (matplotlib, no display).

Colours come from here alone: inside a page they become the page's own (see figure_svg.py). A run
waits for its figures, so everything is laid out by hand: matplotlib's own layout and the search
for a place for titles and labels cost as much as all drawing.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...scenarios.paths import path_duration
from ...scenarios.schema import RobotSpec
from ..new_file import new_file
from .contact import CLASSES, Pair
from .figure_svg import HALO, write_svg
from .judge import Verdict
from .page_style import COLOURS as THEMES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 120
WIDTH = 11.0  # inches, of most figures
NAMED = 8  # robots of a kind that get a colour and a name each; more share one colour
RATE_HZ = 10  # of what is drawn
# Okabe and Ito's palette, which colour-blind readers can tell apart.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#B07A00", "#56B4E9", "#444444", "#8A6FBF")
KIND_COLOUR = {"rover": "#D55E00", "quadcopter": "#0072B2"}
CLASS_COLOUR = dict(zip(CLASSES, ("#D55E00", "#0072B2", "#00795A"), strict=True))
_ON_DARK = dict(THEMES.values())
INK, SOFT, PATH, GRID, SHADE = "#1b1f24", "#59636e", "#9aa4ae", "#e4e7eb", "#000000"


def new_figure(size: tuple[float, float]) -> "Figure":
    """Return an empty figure of `size` inches that needs no display."""
    from matplotlib.figure import Figure

    return Figure(figsize=size)


class Box(NamedTuple):
    """Where a panel is in its figure, inches from the lower left corner."""

    left: float
    bottom: float
    width: float
    height: float


def panel(figure: "Figure", box: Box, title: str, note: str = "") -> "Axes":
    """Return quiet axes at `box`, with a title above and a note at its right end."""
    wide, high = figure.get_size_inches()
    corner = (box.left / wide, box.bottom / high, box.width / wide, box.height / high)
    axes = figure.add_axes(corner)
    above = 1 + 0.08 / box.height
    axes.set_title(title, loc="left", y=above, pad=0, fontsize=11, color=INK)
    if note:
        axes.text(1, above, note, transform=axes.transAxes, ha="right", fontsize=9, color=SOFT)
    quiet(axes)
    axes.locator_params(axis="x", nbins=7)  # each tick costs as much as a curve
    axes.locator_params(axis="y", nbins=max(3, min(7, round(2 * box.height))))
    return axes


def label_axes(axes: "Axes", box: Box, x: str = "", y: str = "") -> None:
    """Say what the axes are, at places that need no search."""
    axes.set_xlabel(x, color=SOFT, fontsize=9)
    axes.xaxis.set_label_coords(0.5, -0.3 / box.height)
    axes.set_ylabel(y, color=SOFT, fontsize=9)
    axes.yaxis.set_label_coords(-0.48 / box.width, 0.5)


def quiet(axes: "Axes") -> None:
    """Keep only the left and lower spine and a pale grid."""
    axes.grid(color=GRID, lw=0.8)
    axes.set_axisbelow(True)
    axes.patch.set_visible(False)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(SOFT)
    axes.tick_params(colors=SOFT, labelsize=9)


class Span(NamedTuple):
    """The times that matter in a figure, s of run time."""

    ready: float  # when all were ready; figures count from here
    done: float  # when the last one had arrived; the end where somebody had not
    end: float


def span(starts: Sequence[RobotSpec], verdict: Verdict) -> Span:
    """Return when the run began in earnest, when its work was done and when it ended."""
    ready = verdict.ready_at or 0.0
    end = max(verdict.ended_at, ready)
    if verdict.ready_at is None or not verdict.all_arrived:
        return Span(ready, end, end)
    ends = [*(path_duration(s.path) for s in starts), *(r.arrival for r in verdict.robots)]
    last = max((e for e in ends if e is not None), default=end - ready)
    return Span(ready, min(end, ready + last), end)


def robot_colours(kinds: Mapping[str, str]) -> dict[str, str]:
    """Return a colour by robot name: its own one in a small team, its kind's in a large one."""
    if len(kinds) <= NAMED:
        return dict(zip(kinds, COLOURS, strict=False))
    colours: dict[str, str] = {}
    for kind in KIND_COLOUR:
        mine = [name for name in kinds if kinds[name] == kind]
        few = len(mine) <= NAMED
        colours |= {n: COLOURS[i] if few else KIND_COLOUR[kind] for i, n in enumerate(mine)}
    return colours


def on_dark(colour: str) -> str:
    """Return how a colour is seen on dark ground: as on a page that is dark."""
    return _ON_DARK.get(colour.lower(), colour)


def save(path: Path, figure: "Figure") -> Path:
    """Save as PNG with a palette: a third of the size, and no difference to see.

    (Median cut, Pillow's default, would shift the colours of thin lines.)
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image  # matplotlib brings it

    figure.set_dpi(DPI)
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    pixels = Image.fromarray(np.asarray(canvas.buffer_rgba()))
    image = pixels.convert("RGB").quantize(
        256, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
    )
    with new_file(path) as part:
        image.save(part, format="png", compress_level=6)
    return path


def save_both(path: Path, figure: "Figure") -> Path:
    """Save as PNG at `path` and as SVG beside it."""
    save(path, figure)
    write_svg(path.with_suffix(".svg"), figure)
    return path


def nearest_pair(verdict: Verdict, label: str) -> Pair | None:
    """Return the nearest pair of a class."""
    return next((c.nearest for c in verdict.classes if c.pair_class == label), None)


def collision_mark(count: int) -> dict[str, Any]:
    """Return how a collision looks where there are `count`."""
    size = 9 if count <= 20 else 4
    edge = {"mec": "white", "mew": 1.0} if count <= 20 else {"mec": "none"}
    return {"marker": "X", "ls": "", "ms": size, "mfc": "black", **edge}


def halo() -> dict[str, Any]:
    """Return what keeps text legible on lines: an outline. In SVG it is a class instead."""
    from matplotlib.patheffects import withStroke

    return {"gid": HALO, "path_effects": [withStroke(linewidth=2.5, foreground="white")]}
