"""A short scenario to sweep, and plans of it."""

from dataclasses import replace
from pathlib import Path

import pytest

from mavherd.gcs.sweep.columns import columns
from mavherd.gcs.sweep.grid import Axis
from mavherd.gcs.sweep.plan import Plan, fingerprint, load_points

DASH = """\
name: dash
duration: 30
robots:
  - {name: r1, kind: rover, start: {east: 0, north: 0}, goto: {east: 1, north: 0}, dwell_s: 0}
  - {name: r2, kind: rover, start: {east: 0, north: 3}, goto: {east: 1, north: 3}, dwell_s: 0}
expect: {collisions: 0}
"""


@pytest.fixture
def dash(tmp_path: Path) -> Path:
    """Return the file of a scenario whose runs take no time."""
    path = tmp_path / "dash.yaml"
    path.write_text(DASH)
    return path


@pytest.fixture
def planned(dash):
    """Return a plan of the short scenario and its grid points: planned(seeds=(0, 1), law=...)."""

    def make(seeds=(0, 1, 2), sets=(), **grid):
        axes = tuple(Axis(f"team.{key}", values) for key, values in grid.items())
        plan = Plan(scenario=str(dash), sets=sets, grid=axes, seeds=seeds)
        points = load_points(plan, dash)
        return replace(plan, fingerprint=fingerprint(points)), points

    return make


@pytest.fixture
def table_of():
    """Return the Arrow table of a plan with these rows, one for each run."""

    def make(plan, points, rows):
        import pyarrow as pa

        from mavherd.gcs.sweep.columns import settings_row
        from mavherd.gcs.sweep.results import schema_of

        described = columns(plan, points)
        kinds = {c.name: c.kind for c in described}
        full = [settings_row(plan, kinds, plan.job(k)) | row for k, row in enumerate(rows)]
        return pa.Table.from_pylist(full, schema=schema_of(described))

    return make
