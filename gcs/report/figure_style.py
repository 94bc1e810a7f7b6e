"""What the figures share: colours, sizes and a quiet frame (matplotlib, no display)."""

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .contact import CLASSES, Pair
from .judge import Verdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 120
NAMED = 8  # robots of a kind that get a colour and a name each; more share one colour
RATE_HZ = 10  # of what is drawn
# Okabe and Ito's palette, which colour-blind readers can tell apart.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#B07A00", "#56B4E9", "#444444", "#8A6FBF")
KIND_COLOUR = {"rover": "#D55E00", "quadcopter": "#0072B2"}
CLASS_COLOUR = dict(zip(CLASSES, ("#D55E00", "#0072B2", "#00795A"), strict=True))
INK, SOFT, PATH, GRID = "#1b1f24", "#59636e", "#9aa4ae", "#e4e7eb"


def new_figure(size: tuple[float, float]) -> "Figure":
    """Return an empty figure of `size` inches that draws to memory."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size)
    FigureCanvasAgg(figure)
    return figure


def quiet(axes: "Axes") -> None:
    """Keep only the left and lower spine and a pale grid."""
    axes.grid(color=GRID, lw=0.8)
    axes.set_axisbelow(True)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(SOFT)
    axes.tick_params(colors=SOFT, labelsize=9)


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


def save(path: Path, figure: "Figure") -> Path:
    """Save with a palette: a third of the size, and no difference to see."""
    from PIL import Image  # matplotlib brings it

    part = path.with_name(path.name + ".part")
    with BytesIO() as buffer:
        figure.savefig(buffer, format="png", dpi=DPI, facecolor="white")
        image = Image.open(buffer).convert("RGB").quantize(64, dither=Image.Dither.NONE)
    image.save(part, format="png", optimize=True)
    part.replace(path)
    return path


def nearest_pair(verdict: Verdict, label: str) -> Pair | None:
    """Return the nearest pair of a class."""
    return next((c.nearest for c in verdict.classes if c.pair_class == label), None)


def collision_mark(count: int) -> dict[str, Any]:
    """Return how a collision looks where there are `count`."""
    size = 9 if count <= 20 else 4
    edge = {"mec": "white", "mew": 1.0} if count <= 20 else {"mec": "none"}
    return {"marker": "X", "ls": "", "ms": size, "mfc": "black", **edge}


def halo() -> list[Any]:
    """Return an outline that keeps text legible on lines."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=2.5, foreground="white")]
