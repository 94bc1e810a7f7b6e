"""The paper's three missions, flown here and now for the pictures: seed 1, in this process."""

import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from mavherd.gcs.flown.flown import open_flown
from mavherd.gcs.report.truth import Floats, Track
from mavherd.gcs.run.in_process import simulate
from mavherd.scenarios.loader import load_scenario
from mavherd.scenarios.paths import path_duration
from mavherd.scenarios.schema import RobotSpec, Scenario

TRACKING, CROSSING, TRAFFIC = "tracking", "crossing-targets", "circle-traffic"
SEED = 1


class Flight(NamedTuple):
    """What became of one run."""

    scenario: Scenario
    starts: Sequence[RobotSpec]
    tracks: Sequence[Track]
    report: dict[str, Any]

    @property
    def ready(self) -> float:
        """When all were ready, s of run time."""
        return float(self.report["ready_at_s"])

    @property
    def done(self) -> float:
        """When the last one had arrived, s of run time."""
        return self.ready + float(self.report["fleet"]["last_arrival_s"])

    @property
    def collisions(self) -> list[dict[str, Any]]:
        """Where robots touched until all had arrived, as in report.json."""
        return [e for e in self.report["collision_events"] if e["time_s"] <= self.done]

    def last_row(self, track: Track) -> int:
        """Return the row of a track at which its path had ended, or else all had arrived."""
        spec = next(spec for spec in self.starts if spec.name == track.name)
        length = path_duration(spec.path)
        end = self.done if length is None else min(self.done, self.ready + length + spec.dwell_s)
        return min(int(np.searchsorted(track.time, end - 1e-6)), len(track) - 1)

    def way(self, track: Track) -> Floats:
        """Return where a robot was from the start to that row, every 0.1 s."""
        row = self.last_row(track)
        return np.concatenate([track.position[:row:10], track.position[row : row + 1]])


@cache
def fly(mission: str, law: str, *settings: str) -> Flight:
    """Fly a mission under a law; a second time it is remembered."""
    scenario = load_scenario(mission, [f"team.law={law}", *settings], seed=SEED)
    with tempfile.TemporaryDirectory() as scratch:
        result = simulate(scenario, keep=Path(scratch))
        assert result.folder is not None
        flown = open_flown(result.folder)
        return Flight(flown.scenario, flown.starts, flown.tracks(), result.report)
