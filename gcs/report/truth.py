"""Reads the vehicles' truth logs and turns them into the ground side's frame (ENU, body FLU)."""

import json
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...transport.errors import MavherdError
from ...transport.frames import quaternion_to_enu, swap_ned_enu
from ...vehicles.config import VehicleConfig
from ...vehicles.truth import POSE_COLUMNS, SCHEMA

Floats = NDArray[np.float64]

# frames.py knows the conversions; both are linear, so their images of the unit vectors say it all.
_TO_ENU = np.array([swap_ned_enu((a, b, c)) for a, b, c in np.eye(3).tolist()])
_TURN_TO_ENU = np.array([quaternion_to_enu((w, x, y, z)) for w, x, y, z in np.eye(4).tolist()])
_TO_FLU = np.array([1.0, -1.0, -1.0])


class TruthError(MavherdError):
    """A truth log that cannot be read."""


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """What one robot truly did; one row per sample, ENU relative to the fleet origin."""

    name: str
    kind: str
    system_id: int
    columns: tuple[str, ...]  # of the file, in NED
    time: Floats  # (n,) s
    position: Floats  # (n, 3) m
    velocity: Floats  # (n, 3) m/s
    quaternion: Floats  # (n, 4) w x y z, body FLU to ENU
    rates: Floats  # (n, 3) rad/s about body FLU
    actuators: Floats  # (n, k)
    actuator_names: tuple[str, ...]
    source: str = "physics"  # | telemetry: what an external vehicle says of itself

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Where one robot truly was, and nothing else of it; see `Track`."""

    name: str
    kind: str
    system_id: int
    time: Floats
    position: Floats
    source: str = "physics"

    def __len__(self) -> int:
        return len(self.time)


Trail = Track | Places
"""What robots are judged by."""


def to_places(config: VehicleConfig, rows: bytes | bytearray) -> Places:
    """Return what a vehicle's `PlaceLog` has kept."""
    table = np.frombuffer(rows, dtype="<f8").reshape(-1, 4)
    time, position = table[:, 0].copy(), table[:, 1:4] @ _TO_ENU
    return Places(config.name, config.kind, config.system_id, time, position)


def read_truth(path: Path) -> Track:
    """Return the track in `path` (a `.part` too: a torn last row is left out)."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise TruthError(f"{path}: {error.strerror}") from None
    end = data.find(b"\n")
    if end < 0:
        raise TruthError(f"{path}: no header line (the vehicle stopped before its first row?)")
    header = _header(path, data[:end])
    rows = memoryview(data)[end + 1 :]
    return _track(header, rows[: len(rows) - len(rows) % _row_bytes(header)])


class TruthTail:
    """Follows a growing truth log: `path` is its final name, `path`.part the name before that.

    The file stays open, so it may be renamed meanwhile.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._chunks = self._follow()

    def read(self) -> Track | None:
        """Return the rows that are new since the last call; None while there is no header yet."""
        return next(self._chunks)

    def close(self) -> None:
        """Close the file."""
        self._chunks.close()

    def __enter__(self) -> "TruthTail":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _follow(self) -> Generator[Track | None, None, None]:
        part = self._path.with_name(self._path.name + ".part")
        while True:
            for name in (part, self._path):  # in this order: a rename in between is not missed
                try:
                    file = name.open("rb", buffering=0)
                except FileNotFoundError:
                    continue
                with file:
                    data = b""
                    while b"\n" not in data:
                        data += file.read()
                        if b"\n" not in data:
                            yield None
                    line, _, data = data.partition(b"\n")
                    header = _header(name, line)
                    size = _row_bytes(header)
                    while True:
                        data += file.read()
                        whole = len(data) - len(data) % size
                        yield _track(header, data[:whole])
                        data = data[whole:]
            yield None


def _header(path: Path, line: bytes) -> dict[str, Any]:
    try:
        header: dict[str, Any] = json.loads(line)
        schema, columns = header["schema"], tuple(header["columns"])
    except (ValueError, KeyError, TypeError):
        raise TruthError(f"{path}: this is not a truth log (its first line is no header)") from None
    if schema != SCHEMA or columns[: len(POSE_COLUMNS)] != POSE_COLUMNS:
        raise TruthError(f"{path}: truth log schema {schema}, this program reads {SCHEMA}")
    return header


def _row_bytes(header: dict[str, Any]) -> int:
    return 8 * len(header["columns"])


def _track(header: dict[str, Any], rows: bytes | memoryview) -> Track:
    columns = tuple(header["columns"])
    table = np.frombuffer(rows, dtype="<f8").reshape(-1, len(columns))
    actuators = len(POSE_COLUMNS)
    return Track(
        name=header["name"],
        kind=header["kind"],
        system_id=header["system_id"],
        columns=columns,
        time=table[:, 0].copy(),
        position=table[:, 1:4] @ _TO_ENU,
        velocity=table[:, 4:7] @ _TO_ENU,
        quaternion=table[:, 7:11] @ _TURN_TO_ENU,
        rates=table[:, 11:14] * _TO_FLU,
        actuators=table[:, actuators:].copy(),
        actuator_names=columns[actuators:],
        source=header.get("source", "physics"),
    )
