"""Numbers and settings as a comparison says them, on the terminal and on the page."""

from typing import Any

from .measures import Measure, Standing

BEST, WORST = "★", "▽"
LEGEND = f"{BEST} best, {WORST} worst; costs are ranked where all arrived without a collision"
NONE = "\N{EN DASH}"


def shown(measure: Measure, value: float | None) -> str:
    """Return a value with as many digits as are meant."""
    return NONE if value is None else f"{value:.{measure.digits}f}"


def mark(standing: Standing, run: int) -> str:
    """Return the sign of the best and of the worst, which needs no colour to be seen."""
    return BEST if run in standing.best else WORST if run in standing.worst else ""


def head(measure: Measure) -> str:
    """Return what a measure is called, with its unit."""
    return f"{measure.head}, {measure.unit}" if measure.unit else measure.head


def setting(value: Any) -> str:
    """Return the value of a setting."""
    return NONE if value is None else str(value).lower() if isinstance(value, bool) else str(value)
