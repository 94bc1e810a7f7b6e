"""Synthetic truth: logs as a vehicle writes them, from positions in ENU; where a router listens."""

import json
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from mavherd.gcs.report.truth import Track, read_truth
from mavherd.transport import bus
from mavherd.vehicles.truth import POSE_COLUMNS

ACTUATORS = {
    "rover": ("left_rad_s", "right_rad_s"),
    "quadcopter": ("rotor1_rad_s", "rotor2_rad_s", "rotor3_rad_s", "rotor4_rad_s"),
}
LEASE_MS = 60_000
_NOT_OF_IT = "COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"
LEVEL_FACING_NORTH = (1.0, 0.0, 0.0, 0.0)  # FRD to NED
Way = Callable[[np.ndarray], tuple[object, object, object]]  # time -> east, north, up


def write_truth(
    path: Path, name: str, kind: str, system_id: int, way: Way, seconds: float, start: float = 0.0
) -> Path:
    """Write a truth log of `seconds` at 100 Hz; the robot faces north, at rest in its attitude."""
    time = start + np.arange(round(seconds * 100) + 1) / 100
    east, north, up = (np.broadcast_to(np.asarray(v, float), time.shape) for v in way(time))
    velocity = np.gradient(np.stack([north, east, -up]), 0.01, axis=1)
    columns = POSE_COLUMNS + ACTUATORS[kind]
    header = {
        "schema": 1,
        "name": name,
        "kind": kind,
        "system_id": system_id,
        "rate_hz": 100,
        "columns": columns,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        file.write(json.dumps(header).encode() + b"\n")
        for k, t in enumerate(time):
            speeds = (float(k),) * len(ACTUATORS[kind])
            pose = (north[k], east[k], -up[k], *velocity[:, k], *LEVEL_FACING_NORTH, 0.1, 0.2, 0.3)
            file.write(struct.pack(f"<{len(columns)}d", t, *pose, *speeds))
    return path


@pytest.fixture(scope="module", autouse=True)
def _any_terminal() -> Iterator[None]:
    """What is printed is the same wherever tests are run from."""
    with pytest.MonkeyPatch.context() as patched:
        for name in _NOT_OF_IT:
            patched.delenv(name, raising=False)
        patched.setenv("TERM", "xterm")
        yield


@pytest.fixture
def endpoint(hold_port: Callable[[], int], monkeypatch: pytest.MonkeyPatch) -> str:
    """Where a Zenoh router can listen; no session is lost though the machine stands still."""
    monkeypatch.setattr(bus, "LEASE_MS", LEASE_MS)
    return f"tcp/127.0.0.1:{hold_port()}"


@pytest.fixture
def truth_log() -> Callable[..., Path]:
    return write_truth


@pytest.fixture
def track(tmp_path) -> Callable[..., Track]:
    """Make a track that has been through a file: track(name, kind, system_id, way, seconds)."""

    def make(name, kind, system_id, way, seconds=20.0, start=0.0):
        path = tmp_path / "tracks" / name / "truth.bin"
        return read_truth(write_truth(path, name, kind, system_id, way, seconds, start))

    return make
