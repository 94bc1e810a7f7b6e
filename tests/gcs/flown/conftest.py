"""One short run on disk, and copies of it to spoil."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from mavherd.gcs.run.in_process import simulate
from mavherd.scenarios.loader import load_scenario

SHORT = """
name: short
duration: 5
robots:
  - {name: rover1, kind: rover, start: {east: 0, north: 0}, goto: {east: 0.6, north: 0}}
  - {name: rover2, kind: rover, start: {east: 0, north: 3}, goto: {east: 0.6, north: 3}}
expect: {collisions: 0}
"""


@pytest.fixture(scope="package")
def whole_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two rovers, two metres, one second of computing: not to be written to."""
    folder = tmp_path_factory.mktemp("flown")
    (folder / "short.yaml").write_text(SHORT)
    kept = simulate(load_scenario(folder / "short.yaml"), keep=folder / "runs").folder
    assert kept is not None
    return kept


@pytest.fixture
def run_folder(whole_run: Path, tmp_path: Path) -> Path:
    """Return a copy to spoil."""
    return shutil.copytree(whole_run, tmp_path / "runs" / whole_run.name)


def break_off(folder: Path, *, cut: int = 5) -> Path:
    """Leave what a run leaves that is killed: every log without its end, and no report."""
    for name in ("report.json", "report.html", "states.parquet"):
        (folder / name).unlink()
    for log in [*folder.glob("vehicles/*/truth.bin"), *folder.glob("vehicles/*/*.tlog")]:
        log.with_name(log.name + ".part").write_bytes(log.read_bytes()[:-cut])
        log.unlink()
    return folder


@pytest.fixture
def killed(run_folder: Path) -> Path:
    """Return the folder of a run that was killed just before its end."""
    return break_off(run_folder)


@pytest.fixture
def spoil() -> Callable[..., Path]:
    return break_off
