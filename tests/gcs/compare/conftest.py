"""Two rovers that meet head-on, under two laws: one pair of runs for all tests."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from mavherd.gcs.run.in_process import simulate
from mavherd.scenarios.loader import load_scenario

MEETING = """
name: meeting
duration: 12
robots:
  - {name: rover1, kind: rover, start: {east: 0, north: 0}, goto: {east: 4, north: 0}}
  - {name: rover2, kind: rover, start: {east: 4, north: 0.1}, goto: {east: 0, north: 0.1}}
expect: {collisions: 0}
"""


@pytest.fixture(scope="package")
def fly(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Fly it with changes: fly("team.law=off") returns the run's folder."""
    folder = tmp_path_factory.mktemp("meeting")
    (folder / "meeting.yaml").write_text(MEETING)
    done: dict[tuple[str, ...], Path] = {}

    def make(*changes: str) -> Path:
        if changes not in done:
            scenario = load_scenario(folder / "meeting.yaml", changes)
            kept = simulate(scenario, keep=folder / "runs").folder
            assert kept is not None
            done[changes] = kept
        return done[changes]

    return make


@pytest.fixture(scope="package")
def laws(fly: Callable[..., Path]) -> list[Path]:
    """Return the runs under law `off`, which collides, and `safe`."""
    return [fly("team.law=off"), fly("team.law=safe")]


@pytest.fixture
def copies(laws: list[Path], tmp_path: Path) -> list[Path]:
    """Return copies to spoil."""
    return [shutil.copytree(run, tmp_path / "runs" / run.name) for run in laws]
