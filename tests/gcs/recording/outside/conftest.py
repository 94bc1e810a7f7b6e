"""What the tests of outside vehicles share: messages of real vehicles, and recordings read back."""

from collections import defaultdict

import numpy as np
import pytest

from mavherd.transport.mavlink import Codec


@pytest.fixture(scope="session")
def heard():
    """Let vehicles live for some seconds side by side; yield time and message, as on links."""

    def listen(seconds, *desks):
        codecs = [Codec(0) for _ in desks]
        flows = [desk.frames(seconds) for desk in desks]
        for bunch in zip(*flows, strict=True):
            for codec, desk, data in zip(codecs, desks, bunch, strict=True):
                for message in codec.decode(data):
                    yield desk.now, message

    return listen


class Reading:
    """A recording read back: rows by entity and component."""

    def __init__(self, path):
        from rerun.chunk import RrdReader

        self._rows = defaultdict(list)
        for chunk in RrdReader(path).stream():
            if "sim_time" not in chunk.timeline_names:
                continue
            batch = chunk.to_record_batch()
            times = batch["sim_time"].cast("int64").to_numpy() * 1e-9
            for name in batch.schema.names:
                if ":" in name:
                    values = batch[name].to_pylist()
                    rows = [(t, v) for t, v in zip(times, values, strict=True) if v is not None]
                    self._rows[chunk.entity_path, name].extend(rows)

    @property
    def entities(self):
        return {entity for entity, _ in self._rows}

    def rows(self, entity, component):
        return sorted(self._rows[entity, component], key=lambda row: row[0])

    def positions(self, name):
        """Times and places of a robot."""
        rows = self.rows(f"/world/robots/{name}", "Transform3D:translation")
        return np.array([t for t, _ in rows]), np.array([v[0] for _, v in rows])

    def texts(self):
        return [v[0] for _, v in self.rows("/events", "TextLog:text")]

    def modes(self, name):
        return [v[0] for _, v in self.rows(f"/mode/{name}", "StateChange:state")]

    def numbers(self, entity):
        """Times and numbers of a plot."""
        rows = self.rows(entity, "Scalars:scalars")
        return np.array([t for t, _ in rows]), np.array([v for _, v in rows])


@pytest.fixture(scope="session")
def read():
    """Read a recording back: read(path)."""
    pytest.importorskip("rerun")
    return Reading
