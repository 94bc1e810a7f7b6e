"""Writes what happened as tables: `states.parquet` and `events.parquet`.

Of states there is one row per robot and sample: position, velocity and attitude in ENU and body
FLU. Columns that only one kind has (rotor or wheel speeds) are empty for the other. `columns.py`
says what each is; the Parquet files say it too, as metadata of their fields. Without pyarrow the
states are a `.npz`, and the events stay in events.jsonl.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..new_file import new_file
from .columns import EVENTS, STATES, VERSION, Column, describe
from .truth import Floats, Track

if TYPE_CHECKING:
    import pyarrow as pa

_NUMBERS = tuple(column.name for column in STATES if column.kind == "float64")


def write_states(folder: Path, tracks: Sequence[Track], *, partial: bool = False) -> Path:
    """Write the table under a temporary name, then its own; return where it is.

    `partial`: some of the truth is missing or has no end, which the file then says.
    """
    parquet = find_spec("pyarrow") is not None
    path = folder / ("states.parquet" if parquet else "states.npz")
    with new_file(path) as part:
        if parquet:
            _write_parquet(part, tracks, partial)
        else:
            _write_npz(part, tracks)
    if parquet:
        (folder / "states.npz").unlink(missing_ok=True)  # an older one
    return path


def write_events(folder: Path, events: Iterable[Mapping[str, Any]]) -> Path | None:
    """Write the events of a run as a table; return where it is, None without pyarrow."""
    if find_spec("pyarrow") is None:
        return None
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows = [_event(event) for event in events]
    columns = list(zip(*rows, strict=True)) if rows else [()] * len(EVENTS)
    schema = pa.schema([_field(c, pa.string()) for c in EVENTS], metadata=_about("events"))
    arrays = [pa.array(values, field.type) for values, field in zip(columns, schema, strict=True)]
    path = folder / "events.parquet"
    with new_file(path) as part:
        pq.write_table(pa.table(arrays, schema=schema), part, compression="zstd")
    return path


def _event(event: Mapping[str, Any]) -> tuple[Any, ...]:
    """Return an event in the order of EVENTS."""
    vehicle, severity = event["vehicle"], event.get("severity")
    return (
        float(event["t"]),
        None if vehicle is None else str(vehicle),
        str(event["kind"]),
        severity if isinstance(severity, int) else None,
        str(event["text"]),
    )


def _columns(track: Track) -> Iterator[tuple[str, Floats]]:
    table = np.hstack([track.position, track.velocity, track.quaternion, track.rates])
    yield from zip(_NUMBERS, (track.time, *table.T), strict=True)
    yield from zip(track.actuator_names, track.actuators.T, strict=True)
    yield from zip(track.command_names, track.commands.T, strict=True)


def _names(tracks: Sequence[Track]) -> list[str]:
    """Return all columns of numbers, each once, in order of appearance."""
    of_kinds = (name for t in tracks for name in (*t.actuator_names, *t.command_names))
    return list(dict.fromkeys([*_NUMBERS, *of_kinds]))


def _write_parquet(path: Path, tracks: Sequence[Track], partial: bool) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    names = _names(tracks)
    number, text = pa.float64(), pa.dictionary(pa.int32(), pa.string())
    of_robots = [column for column in STATES if column.kind != "float64"]
    of_samples = [describe(name) for name in names]
    told = any(track.source != "physics" for track in tracks)
    schema = pa.schema(
        [_field(column, text) for column in (*of_robots, *of_samples)],
        metadata=_about("states")
        | {
            "frame": "ENU, metres from the fleet origin; attitude is body FLU to ENU",
            "source": "truth of the physics, not what the vehicles estimate"
            + ("; of external vehicles what they told" if told else ""),
            "partial": "true" if partial else "false",
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
                            pa.array(numbers[name], from_pandas=True)  # NaN is null
                            if name in numbers
                            else pa.nulls(n, number)
                            for name in names
                        ),
                    ],
                    schema=schema,
                )
            )


def _field(column: Column, text: "pa.DataType") -> "pa.Field":
    import pyarrow as pa

    types = {"text": text, "int16": pa.int16(), "float64": pa.float64()}
    about = {"unit": column.unit, "frame": column.frame, "description": column.text}
    said = {key: value for key, value in about.items() if value}
    return pa.field(column.name, types[column.kind], metadata=said)


def _about(table: str) -> dict[str, str]:
    return {"mavherd": table, "schema": str(VERSION)}


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
