"""A recording that is made in a test and read back with Rerun's own reader."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mavherd.gcs.report.truth import Track


@pytest.fixture
def strict() -> Iterator[None]:
    """Whatever Rerun would only warn of is an error here."""
    rr = pytest.importorskip("rerun")
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


@pytest.fixture
def read_back() -> Callable[..., dict[str, dict[str, list[tuple[float | None, Any]]]]]:
    """Return entity -> component -> list of (time, value); what is static has no time."""

    def read(path):
        from rerun.chunk import RrdReader

        found: dict[str, dict[str, list[tuple[float | None, Any]]]] = {}
        for chunk in RrdReader(path).stream():
            rows = chunk.to_record_batch()
            timed = "sim_time" in chunk.timeline_names
            times = [t.value / 1e9 for t in rows["sim_time"]] if timed else [None] * rows.num_rows
            for name in rows.schema.names:
                if ":" in name:
                    entity = found.setdefault(chunk.entity_path, {})
                    values = zip(times, rows[name].to_pylist(), strict=True)
                    entity.setdefault(name, []).extend(values)
        return {
            entity: {c: sorted(v, key=lambda x: x[0] or 0.0) for c, v in parts.items()}
            for entity, parts in found.items()
        }

    return read


@pytest.fixture
def commanded() -> Callable[..., Track]:
    """Give a track actuators and commands: `actuators` and `commands` by column name."""

    def give(track: Track, actuators: dict[str, Any], commands: dict[str, Any]) -> Track:
        def table(columns: dict[str, Any]):
            return np.stack([np.broadcast_to(v, len(track)) for v in columns.values()], axis=1)

        return replace(
            track,
            actuators=table(actuators),
            actuator_names=tuple(actuators),
            commands=table(commands),
            command_names=tuple(commands),
        )

    return give
