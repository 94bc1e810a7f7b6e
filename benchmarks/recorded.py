"""What being recorded costs: the recorder's own share, and what all the others pay for it."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import NamedTuple

from flights import field_scenario, watch

from mavherd.scenarios.loader import load_scenario
from mavherd.scenarios.schema import Scenario

_SETTLED_S = 6.0  # of a run: before, the recorder imports Rerun
_ROLES = "quadcopter", "rover", "coordinator"


class Recorded(NamedTuple):
    """Runs of one scenario at real time, with and without recording in turn: medians."""

    recorder: float  # CPU s per s
    others: float  # CPU s per s, of vehicles and coordinator, when they are recorded
    unseen: float  # the same when they are not
    megabytes: float  # of a recording of 60 s

    @property
    def ratio(self) -> float:
        """What the others use when they are recorded, beside what they use when not."""
        return self.others / self.unseen


def recorded(scenario: Scenario, repeats: int) -> Recorded:
    """Measure so many runs of each."""
    pairs = [(_fly(scenario, record=True), _fly(scenario, record=False)) for _ in range(repeats)]
    return Recorded(
        median(seen.recorder for seen, _ in pairs),
        median(seen.others for seen, _ in pairs),
        median(alone.others for _, alone in pairs),
        median(seen.megabytes for seen, _ in pairs),
    )


def scenarios(largest: int, seconds: float) -> Iterator[Scenario]:
    """Yield six robots, and a field that stays at its goals for so long."""
    yield load_scenario("crossing-targets", [])
    with tempfile.TemporaryDirectory() as folder:
        yield field_scenario(largest, Path(folder), dwell_s=seconds)


def _fly(scenario: Scenario, *, record: bool) -> Recorded:
    sizes: list[int] = []

    def look(folder: Path) -> None:
        sizes.extend(file.stat().st_size for file in folder.glob("run.rrd"))

    report, usage = watch(scenario, since=_SETTLED_S, look=look, speed=1.0, record=record)
    others = usage.of(*_ROLES)
    megabytes = sum(sizes) * 1e-6 * 60 / report["duration_s"]
    return Recorded(usage.of("recorder"), others, others, megabytes)
