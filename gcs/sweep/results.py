"""A sweep's rows on disk: an Arrow stream while it goes on, Parquet when it is complete."""

import fcntl
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...transport.errors import MavherdError
from ..new_file import new_file
from .columns import Column, Row

if TYPE_CHECKING:
    import pyarrow as pa

_UNITS = {"_s": "s", "_m": "m"}


class ResultStream:
    """Appends rows to an Arrow IPC stream that any reader of Arrow can follow.

    Each batch is whole when `append` returns, whatever happens to this process. What a kill left
    of a batch is cut off when the stream is opened again (`cut` bytes); `done` are the runs in it.
    One process at a time. Raises MavherdError for what is no stream, another sweep's, or in use.
    """

    def __init__(self, path: Path, columns: Sequence[Column]) -> None:
        self.path = path
        self.schema = schema_of(columns)
        self.done: set[int] = set()
        self.cut = 0
        # A record lock, for it is not inherited: workers that outlive us for a moment hold nothing.
        self._file = path.open("a+b", buffering=0)
        try:
            fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.close()
            raise MavherdError(f"{path}: another process writes this sweep (wait for it)") from None
        try:
            self._recover()
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> "ResultStream":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def append(self, rows: Sequence[Row]) -> None:
        """Write rows; a column that one lacks is null."""
        import pyarrow as pa

        data = memoryview(pa.RecordBatch.from_pylist(list(rows), schema=self.schema).serialize())
        self._write(data)
        self.done.update(row["run"] for row in rows)

    def table(self) -> "pa.Table":
        """Return all rows in order of their runs."""
        import pyarrow as pa

        self._file.seek(0)
        with pa.ipc.open_stream(self._file) as reader:
            return pa.Table.from_batches(reader, self.schema).sort_by("run")

    def close(self) -> None:
        """Give the file to others."""
        self._file.close()

    def _write(self, data: memoryview) -> None:
        while data:
            data = data[self._file.write(data) :]

    def _recover(self) -> None:
        """Begin a stream, or find the end of the last whole batch and cut off the rest."""
        size = os.fstat(self._file.fileno()).st_size
        end = self._read() if size else 0
        if size and not end and not self._is_begun(size):
            raise MavherdError(
                f"{self.path}: not the results of a sweep (move it away, and go on: the runs in it"
                " are done again)"
            )
        if end < size:
            self.cut = size - end
            self._file.truncate(end)
        if not end:
            self._write(memoryview(self.schema.serialize()))

    def _is_begun(self, size: int) -> bool:
        """Return whether this is the beginning of our stream, torn in its schema."""
        self._file.seek(0)
        schema = self.schema.serialize().to_pybytes()
        return size < len(schema) and schema.startswith(self._file.read(size))

    def _read(self) -> int:
        """Note which runs are done; return where the last whole batch ends."""
        import pyarrow as pa

        self._file.seek(0)
        end = 0
        try:
            reader = pa.ipc.open_stream(self._file)
            if reader.schema != self.schema:
                raise MavherdError(f"{self.path}: its columns are not those of this sweep's plan")
            end = self._file.tell()
            while True:
                batch = reader.read_next_batch()
                batch.validate(full=True)
                self.done.update(batch.column(0).to_pylist())
                end = self._file.tell()
        except (StopIteration, OSError, pa.ArrowException):
            return end  # of the stream, or torn


def write_parquet(path: Path, table: "pa.Table") -> None:
    """Write a table; it has its name when it is complete and safe on the disk."""
    import pyarrow.parquet as pq

    with new_file(path) as part, part.open("wb") as file:
        pq.write_table(table, file, compression="zstd")
        file.flush()
        os.fsync(file.fileno())


def read_parquet(path: Path) -> "pa.Table":
    """Return the table of a complete sweep."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise MavherdError(f"{path}: not a sweep's table: {error}") from None


def schema_of(columns: Sequence[Column]) -> "pa.Schema":
    """Return the Arrow schema of these columns."""
    import pyarrow as pa

    types: dict[str, Any] = {
        "int": pa.int64(),
        "float": pa.float64(),
        "bool": pa.bool_(),
        "text": pa.string(),
    }
    return pa.schema([pa.field(c.name, types[c.kind], metadata=_unit(c)) for c in columns])


def _unit(column: Column) -> dict[str, str] | None:
    unit = next((unit for end, unit in _UNITS.items() if column.name.endswith(end)), None)
    return {"unit": unit} if unit and column.kind == "float" else None
