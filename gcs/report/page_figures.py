"""Figures inside a page: drawn lines where they are small, else a picture of them."""

import base64
from collections.abc import Iterator
from html import escape
from pathlib import Path

from .figure_svg import inline
from .page_parts import scrolled

INLINE_BYTES = 180_000  # of an SVG; a larger one (a hundred tracks) is shown as PNG


def figure(picture: Path, title: str, caption: str) -> Iterator[str]:
    """Yield one figure: the SVG beside `picture` where it is small, else `picture`, a PNG.

    `title` and `caption` are plain text. The figure scrolls by itself on a narrow screen, and takes
    the page's colours where it is SVG.
    """
    svg = picture.with_suffix(".svg")
    yield "<figure>"
    yield from scrolled(escape(title))
    if svg.is_file() and svg.stat().st_size <= INLINE_BYTES:
        yield inline(svg.read_text(encoding="utf-8"), picture.stem, title)
    else:
        data = base64.b64encode(picture.read_bytes()).decode()
        yield f'<img alt="{escape(title)}" src="data:image/png;base64,{data}">'
    yield f"</section><figcaption>{escape(caption)}</figcaption></figure>"
