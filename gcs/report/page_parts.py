"""The parts that our pages are made of: numbers, tiles, tables. Everything returns HTML."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import Any, NamedTuple

NONE = "&ndash;"
MAX_ROWS = 240  # of a table: more than robots can be
_IN_SIGHT = 18  # rows of a table, with certainty


class Tile(NamedTuple):
    """One key number; all three are HTML."""

    name: str
    value: str
    note: str = ""


def number(value: float | None, digits: int) -> str:
    """Return a number, or a dash for what is unknown."""
    return NONE if value is None else f"{value:.{digits}f}"


def unit(value: float | None, digits: int, name: str) -> str:
    """Return a number with its unit, or a dash for what is unknown."""
    return NONE if value is None else f"{value:.{digits}f}&nbsp;{name}"


def time_base(report: Mapping[str, Any]) -> str:
    """Return what the times of a page and its figures count from, for captions."""
    ready = report.get("ready_at_s") is not None
    return "time since all were ready" if ready else "time since the start"


def since_ready(report: Mapping[str, Any], time: float | None) -> float | None:
    """Return a run time as `time_base` says."""
    return None if time is None else time - (report.get("ready_at_s") or 0.0)


def size(count: float | None) -> str:
    """Return a number of bytes in the unit that suits it."""
    if count is None:
        return NONE
    for name, step in (("MB", 1e6), ("kB", 1e3)):
        if count >= step:
            return f"{count / step:.1f}&nbsp;{name}"
    return f"{count:.0f}&nbsp;B"


def names(robots: Iterable[str] | None) -> str:
    """Return names of robots in a row, or a dash."""
    return escape(" and ".join(robots or ())) or NONE


def tiles(items: Iterable[Tile]) -> Iterator[str]:
    """Yield a grid of key numbers."""
    yield '<dl class="tiles">'
    for name, value, note in items:
        small = f"<small>{note}</small>" if note else ""
        yield f"<div><dt>{name}</dt><dd>{value}{small}</dd></div>"
    yield "</dl>"


def table(
    caption: str,
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    words: Collection[int] = (0,),
    label: str = "",
) -> Iterator[str]:
    """Yield a table whose first column names the rows; it scrolls by itself where it is too large.

    All cells are HTML. `words` are the columns that hold no numbers; those are aligned right.
    `label` names the table to screen readers where its caption is long.
    """
    tone = ["" if k in words else ' class="num"' for k in range(len(heads))]
    yield from scrolled(label or caption)
    if len(rows) > _IN_SIGHT:
        caption += f'<span class="scroll"> ({min(len(rows), MAX_ROWS)} rows: scroll)</span>'
    yield f"<table><caption>{caption}</caption><thead><tr>"
    yield "".join(f'<th scope="col"{t}>{h}</th>' for t, h in zip(tone, heads, strict=True))
    yield "</tr></thead><tbody>"
    for first, *rest in rows[:MAX_ROWS]:
        cells = (f"<td{t}>{cell}</td>" for t, cell in zip(tone[1:], rest, strict=True))
        yield f'<tr><th scope="row"{tone[0]}>{first}</th>{"".join(cells)}</tr>'
    yield "</tbody></table></section>"
    if len(rows) > MAX_ROWS:
        yield f'<p class="soft">… and {len(rows) - MAX_ROWS} more in report.json.</p>'


def scrolled(label: str) -> Iterator[str]:
    """Open a section that scrolls by itself, with a keyboard too; close it with `</section>`."""
    yield f'<section class="wide" tabindex="0" aria-label="{label}">'
