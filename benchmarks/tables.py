"""Tables of a benchmark: rows of text under heads, as Markdown."""

import statistics
from collections.abc import Callable, Sequence
from typing import NamedTuple


class Table(NamedTuple):
    """One table; `note` says how it was measured."""

    title: str
    heads: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    note: str = ""

    def markdown(self) -> str:
        """Return it as Markdown, its title as a heading."""
        lines = [f"### {self.title}", ""]
        if self.note:
            lines += [self.note, ""]
        lines += [_row(self.heads), _row(["---"] * len(self.heads))]
        return "\n".join([*lines, *map(_row, self.rows), ""])


def median(repeats: int, measure: Callable[[], float]) -> float:
    """Return the median of so many measurements."""
    return statistics.median(measure() for _ in range(repeats))


def medians(repeats: int, measure: Callable[[], Sequence[float]]) -> list[float]:
    """Return the median of each column of so many measurements."""
    return [statistics.median(c) for c in zip(*(measure() for _ in range(repeats)), strict=True)]


def digits(value: float) -> str:
    """Return a figure with three digits that count."""
    if value == 0:
        return "0"
    size = abs(value)
    places = next(n for n in range(7) if size >= 10 ** (2 - n) or n == 6)
    return f"{value:.{places}f}"


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
