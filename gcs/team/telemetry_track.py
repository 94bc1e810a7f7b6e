"""The track of an external vehicle: what it tells of itself, in the form of a truth log.

Nobody knows where it truly is. Its positions are interpolated to the rate of the truth logs, so
that whoever reads those need not care; the header says `"source": "telemetry"`.
"""

import json
import struct
from math import hypot, nan
from pathlib import Path

from ...scenarios.schema import RobotSpec
from ...vehicles.truth import POSE_COLUMNS, RATE_HZ, SCHEMA
from ..station import VehicleStatus

_FLUSH_S = 0.25
_SLACK = 1e-6  # of a period
_NO_RATES = (nan, nan, nan)


class TelemetryTrack:
    """Writes `truth.bin.part` and renames it to `truth.bin` when it is complete."""

    def __init__(self, folder: Path, spec: RobotSpec) -> None:
        header = {
            "schema": SCHEMA,
            "name": spec.name,
            "kind": spec.kind,
            "system_id": spec.system_id,
            "rate_hz": RATE_HZ,
            "columns": POSE_COLUMNS,
            "source": "telemetry",
        }
        self._path = folder / "truth.bin"
        self._part = folder / "truth.bin.part"
        self._file = self._part.open("wb", buffering=1 << 14)
        self._file.write(json.dumps(header).encode() + b"\n")
        self._pack = struct.Struct(f"<{len(POSE_COLUMNS)}d").pack
        self._last: tuple[float, tuple[float, ...]] | None = None
        self._flushed_at = 0.0

    def add(self, status: VehicleStatus) -> None:
        """Append what is new since the last call, if anything is."""
        at = status.position_at
        pose = (*status.position, *status.velocity, *status.quaternion)
        if at < 0 or (self._last is not None and at <= self._last[0]):
            return
        if self._last is not None:
            self._write_between(self._last, (at, pose))
        self._last = (at, pose)
        if at > self._flushed_at + _FLUSH_S:
            self._flushed_at = at
            self._file.flush()

    def close(self) -> None:
        """Finish the file under its final name."""
        self._file.close()
        self._part.rename(self._path)

    def _write_between(
        self, old: tuple[float, tuple[float, ...]], new: tuple[float, tuple[float, ...]]
    ) -> None:
        """Write rows at all multiples of the period after `old` up to `new`."""
        (t0, a), (t1, b) = old, new
        sign = -1.0 if sum(x * y for x, y in zip(a[6:], b[6:], strict=True)) < 0 else 1.0
        row = int(t0 * RATE_HZ + _SLACK) + 1
        while row <= t1 * RATE_HZ + _SLACK:
            t = row / RATE_HZ
            share = (t - t0) / (t1 - t0)
            way = [x + (y - x) * share for x, y in zip(a[:6], b[:6], strict=True)]
            turn = [x + (sign * y - x) * share for x, y in zip(a[6:], b[6:], strict=True)]
            length = hypot(*turn) or 1.0
            self._file.write(self._pack(t, *way, *(x / length for x in turn), *_NO_RATES))
            row += 1
