"""Figures as SVG: small files whose text is text, and the same inside a page in its colours."""

import re
from html import escape
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from ..new_file import write_text
from .page_style import COLOURS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HALO = "halo"  # the gid of text that shall have an outline
MAX_SCALE = 1.55  # CSS pixels for a point, inside a page: so that text is never huge
_STYLE = "*{stroke-linejoin:round;stroke-linecap:butt}.halo{stroke:#fff;stroke-width:2.5px}"
_VARIABLES = {light: f"var(--{name})" for name, (light, _) in COLOURS.items()}
_LONG = re.compile(r"-?\d+\.\d{3,}")  # numbers; a tenth of a point is fine enough
_COLOUR = re.compile("|".join(_VARIABLES))


def write_svg(path: Path, figure: "Figure") -> Path:
    """Write `figure`, on white, and nothing from it afterwards: it loses its halos."""
    from matplotlib import rc_context
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        if text.get_gid() == HALO:
            text.set_path_effects([])  # matplotlib would draw letters as outlines
    buffer = StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": path.stem}):
        figure.savefig(buffer, format="svg", facecolor="white", metadata={"Date": None})
    write_text(path, _small(buffer.getvalue()))
    return path


def inline(svg: str, name: str, alt: str) -> str:
    """Return the SVG of `write_svg` as an element of a page.

    Its ids begin with `name`, its colours are the page's, and it is as wide as the page lets it be.
    """
    text = svg[svg.index("<svg") :].strip()
    text = re.sub(r"<style.*?</style>", "", text, count=1, flags=re.DOTALL)
    text = re.sub(r'<g id="patch_1">.*?</g>', "", text, count=1, flags=re.DOTALL)  # white paper
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = re.sub(r'xlink:href="#', f'href="#{name}-', text)
    text = text.replace("url(#", f"url(#{name}-")
    text = _COLOUR.sub(lambda match: _VARIABLES[match[0]], text)
    head, rest = text.split(">", 1)
    box = re.search(r'viewBox="([^"]*)"', head)
    if box is None:
        raise ValueError(f"{name}: this SVG is not one of ours: it has no viewBox")
    width = float(box[1].split()[2]) * MAX_SCALE
    return (
        f'<svg viewBox="{box[1]}" role="img" aria-label="{escape(alt)}" '
        f'style="max-width: {width:.0f}px">{rest}'
    )


def _round(number: re.Match[str]) -> str:
    return f"{float(number[0]):.1f}"


def _small(svg: str) -> str:
    """Return the same picture in a third of the bytes."""
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r"<!--.*?-->", "", svg, flags=re.DOTALL)
    svg = re.sub(r"(<style[^>]*>).*?(</style>)", rf"\1{_STYLE}\2", svg, count=1, flags=re.DOTALL)
    svg = svg.replace(f'<g id="{HALO}">', f'<g class="{HALO}" paint-order="stroke">')
    svg = re.sub(r'<g id="(?!patch_1")[^"]*">', "<g>", svg)
    svg = re.sub(r"'DejaVu Sans'[^;\"]*sans-serif", "sans-serif", svg)
    svg = re.sub(r"<[^<>]*\.[^<>]*>", lambda tag: _LONG.sub(_round, tag[0]), svg)
    svg = re.sub(r"\s*\n\s*(?=[A-Zz\"] ?)", "", svg)
    svg = re.sub(r"([MLCQ]) (?=[-\d])", r"\1", svg)
    return re.sub(r">\s+<", ">\n<", svg)
