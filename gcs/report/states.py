"""Writes the robots' true states as a table: `states.parquet`, or `.npz` without pyarrow.

One row per robot and sample; position, velocity and attitude in ENU and body FLU. Columns that
only one kind has (rotor or wheel speeds) are empty for the other.
"""

from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from .truth import Floats, Track

_UNITS = {"_rad_s": "rad/s", "_m_s": "m/s", "_m": "m", "_s": "s"}
_COMMON = (
    "time_s",
    *("east_m", "north_m", "up_m"),
    *("v_east_m_s", "v_north_m_s", "v_up_m_s"),
    *("qw", "qx", "qy", "qz"),  # body FLU to ENU
    *("roll_rate_rad_s", "pitch_rate_rad_s", "yaw_rate_rad_s"),  # about body FLU
)


def write_states(folder: Path, tracks: Sequence[Track]) -> Path:
    """Write the table under a temporary name, then its own; return where it is."""
    parquet = find_spec("pyarrow") is not None
    path = folder / ("states.parquet" if parquet else "states.npz")
    part = path.with_name(path.name + ".part")
    (_write_parquet if parquet else _write_npz)(part, tracks)
    part.replace(path)
    return path


def _columns(track: Track) -> Iterator[tuple[str, Floats]]:
    yield "time_s", track.time
    table = np.hstack([track.position, track.velocity, track.quaternion, track.rates])
    yield from zip(_COMMON[1:], table.T, strict=True)
    yield from zip(track.actuator_names, track.actuators.T, strict=True)


def _names(tracks: Sequence[Track]) -> list[str]:
    """Return all columns of numbers, each once, in order of appearance."""
    return list(dict.fromkeys([*_COMMON, *(name for t in tracks for name in t.actuator_names)]))


def _write_parquet(path: Path, tracks: Sequence[Track]) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    names = _names(tracks)
    number, text = pa.float64(), pa.dictionary(pa.int32(), pa.string())
    schema = pa.schema(
        [
            pa.field("robot", text),
            pa.field("kind", text),
            pa.field("system_id", pa.int16()),
            *(pa.field(name, number, metadata=_describe(name)) for name in names),
        ],
        metadata={
            "frame": "ENU, metres from the fleet origin; attitude is body FLU to ENU",
            "source": "truth of the physics, not what the vehicles estimate",
        },
    )
    # Plain doubles hardly compress; split by byte, their exponents do.
    split: Any = {"use_dictionary": ["robot", "kind"], "use_byte_stream_split": names}
    with pq.ParquetWriter(path, schema, compression="zstd", **split) as writer:
        for track in tracks:
            n = len(track)
            numbers = dict(_columns(track))
            writer.write_table(
                pa.table(
                    [
                        pa.array([track.name] * n, pa.string()).cast(text),
                        pa.array([track.kind] * n, pa.string()).cast(text),
                        pa.array(np.full(n, track.system_id), pa.int16()),
                        *(
                            pa.array(numbers[name]) if name in numbers else pa.nulls(n, number)
                            for name in names
                        ),
                    ],
                    schema=schema,
                )
            )


def _write_npz(path: Path, tracks: Sequence[Track]) -> None:
    tables = [dict(_columns(track)) for track in tracks]
    columns: dict[str, Any] = {
        name: np.concatenate(
            [
                table.get(name, np.full(len(track), np.nan))
                for track, table in zip(tracks, tables, strict=True)
            ]
            or [np.empty(0)]
        )
        for name in _names(tracks)
    }
    lengths = [len(track) for track in tracks]
    columns["robot"] = np.repeat([track.name for track in tracks], lengths)
    columns["kind"] = np.repeat([track.kind for track in tracks], lengths)
    columns["system_id"] = np.repeat([track.system_id for track in tracks], lengths)
    with path.open("wb") as file:
        np.savez_compressed(file, **columns)


def _describe(name: str) -> dict[str, str]:
    unit = next((unit for suffix, unit in _UNITS.items() if name.endswith(suffix)), "1")
    return {"unit": unit}
