"""Reads the vehicles' truth logs and turns them into the ground side's frame (ENU, body FLU)."""

import json
import os
from collections.abc import Generator, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...transport.errors import MavherdError
from ...transport.frames import quaternion_to_enu, swap_ned_enu
from ...vehicles.config import VehicleConfig
from ...vehicles.truth import POSE_COLUMNS, RATE_HZ, SCHEMA

Floats = NDArray[np.float64]

_CHUNK = 1 << 16

# frames.py knows the conversions; both are linear, so their images of the unit vectors say it all.
_TO_ENU = np.array([swap_ned_enu((a, b, c)) for a, b, c in np.eye(3).tolist()])
_TURN_TO_ENU = np.array([quaternion_to_enu((w, x, y, z)) for w, x, y, z in np.eye(4).tolist()])
_TO_FLU = np.array([1.0, -1.0, -1.0])
_TURNED = ("pitch_command_rad", "yaw_rate_command_rad_s")  # commands with another sign in FLU


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
    commands: Floats = field(default_factory=lambda: np.empty((0, 0)))
    """(n, c) the motion that the onboard control asks for, ENU and body FLU; NaN while none."""
    command_names: tuple[str, ...] = ()

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
    whole = len(rows) - len(rows) % _row_bytes(header)
    return _tracks([Piece(header, _table(header, rows[:whole]))])[0]


class Piece(NamedTuple):
    """Rows of a truth log as they are there, in NED, and the log's header."""

    header: dict[str, Any]
    table: Floats


class TruthTail:
    """Follows a growing truth log: `path` is its final name, `path`.part the name before that.

    It gives out the rows of every so many 10 ms. The file stays open: it may be renamed meanwhile.
    """

    def __init__(self, path: Path, every: int = 1) -> None:
        self._path = path
        self._every = every
        self._pieces = self._follow()

    def read(self) -> Track | None:
        """Return the rows that are new since the last call; None while there is no header yet."""
        piece = next(self._pieces)
        return _tracks([piece])[0] if piece else None

    def take(self) -> Piece | None:
        """Return the same as it is in the file, for `read_all`."""
        return next(self._pieces)

    def close(self) -> None:
        """Close the file."""
        self._pieces.close()

    def __enter__(self) -> "TruthTail":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _follow(self) -> Generator[Piece | None, None, None]:
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
                        data += _new(file.fileno())
                        rows = len(data) // size
                        table = _table(header, data[: rows * size])
                        yield Piece(header, _thinned(table, self._every))
                        data = data[rows * size :]
            yield None


def read_all(tails: Iterable[TruthTail]) -> list[Track]:
    """Return what is new in each log: for many of them cheaper than one by one."""
    alike: dict[tuple[str, ...], list[Piece]] = {}
    for tail in tails:
        piece = tail.take()
        if piece and len(piece.table):
            alike.setdefault(tuple(piece.header["columns"]), []).append(piece)
    return [track for pieces in alike.values() for track in _tracks(pieces)]


def _new(fd: int) -> bytes:
    """Return what can be read now; for a little of it that is half the system calls of `read`."""
    data = os.read(fd, _CHUNK)
    if len(data) < _CHUNK:
        return data
    parts = [data]
    while parts[-1]:
        parts.append(os.read(fd, 16 * _CHUNK))
    return b"".join(parts)


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


def _table(header: dict[str, Any], rows: bytes | memoryview) -> Floats:
    return np.frombuffer(rows, dtype="<f8").reshape(-1, len(header["columns"]))


def _thinned(table: Floats, every: int) -> Floats:
    """Return the rows of every so many 10 ms, of rows that follow one another."""
    if every == 1 or not len(table):
        return table
    first = round(float(table[0, 0]) * RATE_HZ)
    return table[-first % every :: every]


def _tracks(pieces: Sequence[Piece]) -> list[Track]:
    """Return the tracks in pieces of logs whose columns are the same; they share their arrays."""
    header, table = pieces[0].header, np.concatenate([piece.table for piece in pieces])
    columns = tuple(header["columns"])
    actuators = len(POSE_COLUMNS)
    commands = len(columns) - int(header.get("commands", 0))
    parts = (
        table[:, 0].copy(),
        table[:, 1:4] @ _TO_ENU,
        table[:, 4:7] @ _TO_ENU,
        table[:, 7:11] @ _TURN_TO_ENU,
        table[:, 11:14] * _TO_FLU,
        table[:, actuators:commands].copy(),
        _commands_to_enu(table[:, commands:], columns[commands:]),
    )
    tracks, end = [], 0
    for header, own in pieces:
        begin, end = end, end + len(own)
        time, position, velocity, quaternion, rates, driven, asked = (p[begin:end] for p in parts)
        tracks.append(
            Track(
                name=header["name"],
                kind=header["kind"],
                system_id=header["system_id"],
                columns=columns,
                time=time,
                position=position,
                velocity=velocity,
                quaternion=quaternion,
                rates=rates,
                actuators=driven,
                actuator_names=columns[actuators:commands],
                commands=asked,
                command_names=columns[commands:],
                source=header.get("source", "physics"),
            )
        )
    return tracks


def _commands_to_enu(table: Floats, names: tuple[str, ...]) -> Floats:
    """Return commands about body FRD and to NED as those about body FLU and to ENU."""
    turned = np.where(np.isin(names, _TURNED), -table, table)
    if "yaw_command_rad" in names:
        yaw = names.index("yaw_command_rad")
        turned[:, yaw] = (1.5 * np.pi - turned[:, yaw]) % (2 * np.pi) - np.pi  # frames.swap_yaw
    return turned
