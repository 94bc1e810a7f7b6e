"""What mavherd must reach, on two cores: beside what was measured, reached or missed."""

from collections.abc import Mapping
from typing import NamedTuple

from tables import Table, digits


class Target(NamedTuple):
    """One figure, and what it must reach compiled and in pure Python."""

    key: str
    text: str
    compiled: float
    pure: float
    at_least: bool = False  # False: at most

    def verdict(self, measured: float | None, *, compiled: bool) -> tuple[str, str, str]:
        """Return target, measured figure, and how it went."""
        wanted = self.compiled if compiled else self.pure
        sign = ">=" if self.at_least else "<="
        if measured is None:
            return f"{sign} {wanted:g}", "-", "not measured"
        ratio = wanted / measured if self.at_least else measured / wanted
        word = "reached" if ratio <= 1 else f"missed, {digits(ratio)} times"
        return f"{sign} {wanted:g}", digits(measured), word


TARGETS = (
    Target("quadcopter full", "one quadcopter, full speed, CPU s per simulated s", 0.0008, 0.005),
    Target("quadcopter 1x", "one quadcopter at 1x, CPU s per s", 0.006, 0.010),
    Target("rover full", "one rover, full speed, CPU s per simulated s", 0.0006, 0.003),
    *(
        Target(f"factor {n}", f"real-time factor, {n} vehicle{'s' * (n > 1)}", c, p, at_least=True)
        for n, c, p in ((1, 400, 120), (6, 120, 40), (10, 80, 25), (50, 20, 5), (100, 10, 2.2))
    ),
    Target("cores 100", "100 vehicles at 1x, cores in all", 0.5, 1.2),
    Target("late 100", "100 vehicles at 1x, late ticks, %", 1, 1),
    Target("pss", "a vehicle's process of ten, PSS, MB", 3, 3),
    Target("rss", "a vehicle's process of ten, RSS, MB", 25, 25),
    Target("ready 10", "10 vehicles, from command to all ready, s", 0.6, 0.6),
    Target("ready 100", "100 vehicles, from command to all ready, s", 2, 2),
    Target("sweep", "in-process sweep of crossing-targets, runs per s", 15, 3, at_least=True),
    Target("recorder 100", "recorder of 100 vehicles at 1x, % of a core", 5, 5),
    Target("rrd 6", "recording of 60 s of six robots, MB", 5, 5),
    Target("tick 64", "coordinator tick, 64 robots, ms", 1, 1),
    Target("tick 240", "coordinator tick, 240 robots, ms", 4, 4),
)


def table(figures: Mapping[str, float], *, compiled: bool) -> Table:
    """Return every target with what was measured."""
    rows = [(t.text, *t.verdict(figures.get(t.key), compiled=compiled)) for t in TARGETS]
    return Table(
        "Targets", ("what", "compiled" if compiled else "pure Python", "measured", ""), rows
    )
