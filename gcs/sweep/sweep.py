"""Conducts a sweep: feeds an engine, writes rows as they come, and concludes when all are there."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from json import dumps
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Any, Protocol

from ...scenarios.loader import is_shipped
from ...scenarios.schema import Scenario
from ...transport.errors import MavherdError, os_reason
from ..complaint import INSTALL
from ..new_file import write_text
from .columns import JUDGED, Row, columns, settings_row
from .engine import Ended, Engine
from .folder import FIGURES, SCENARIO, SCRATCH, STREAM, SUMMARY, TABLE
from .plan import Plan
from .results import ResultStream, read_parquet, write_parquet
from .summary import Summary

if TYPE_CHECKING:
    import pyarrow as pa

_WAIT_S = 0.1


class View(Protocol):
    """Shows a sweep while it goes on."""

    def begun(self, done: int, runs: int) -> None:
        """Show that the sweep goes on from `done` of its `runs`."""
        ...

    def ended(self, rows: Sequence[Row]) -> None:
        """Count runs that have ended."""
        ...

    def refresh(self) -> None:
        """Show how time passes."""
        ...

    def note(self, text: str) -> None:
        """Say something that a user should know."""
        ...


class SweepInterruptedError(MavherdError):
    """A sweep that was broken off: `done` of its runs are in the folder."""

    exit_code = 130

    def __init__(self, folder: Path, done: int, runs: int) -> None:
        super().__init__(
            f"interrupted: {done} of {runs} runs are done"
            f" (go on with: mavherd sweep --resume {folder})"
        )


@dataclass(frozen=True, slots=True)
class Sweep:
    """One sweep in its folder, begun or not."""

    folder: Path
    plan: Plan
    points: tuple[Scenario, ...]

    @property
    def source(self) -> str:
        """Return what `mavherd run` takes to repeat a run: a shipped name, or the folder's copy."""
        named = self.plan.scenario
        return named if is_shipped(named) else str(self.folder / SCENARIO)

    def conduct(
        self, engine: Callable[[], Engine], view: View, interrupted: Callable[[], bool]
    ) -> None:
        """Do all runs that are not done yet; `engine` starts where they are done.

        Raise SweepInterruptedError as soon as `interrupted` says so; the folder can be resumed
        then, and after anything else that ends this process.
        """
        table = self.folder / TABLE
        try:
            with ResultStream(self.folder / STREAM, columns(self.plan, self.points)) as stream:
                if not table.exists():  # asked while nobody else can write it
                    if stream.cut:
                        view.note(f"{stream.cut} bytes after the last whole row are cut off")
                    view.begun(len(stream.done), self.plan.runs)
                    if len(stream.done) < self.plan.runs:
                        self._run(stream, engine(), view, interrupted)
                    write_parquet(table, stream.table())
                stream.path.unlink()
        except OSError as error:
            raise MavherdError(
                f"{os_reason(error)}: the results cannot be written"
                f" (mend that, and go on with: mavherd sweep --resume {self.folder})"
            ) from None

    def _run(
        self,
        stream: ResultStream,
        engine: Engine,
        view: View,
        interrupted: Callable[[], bool],
    ) -> None:
        kinds = {column.name: column.kind for column in columns(self.plan, self.points)}
        to_do = (self.plan.job(k) for k in range(self.plan.runs) if k not in stream.done)

        def keep(ended: Sequence[Ended]) -> None:
            if interrupted():  # what fails now may have lost its vehicles to the same signal
                ended = [each for each in ended if each.row["exit_code"] in JUDGED]
            rows = [settings_row(self.plan, kinds, job) | row for job, row in ended]
            if rows:
                stream.append(rows)
                view.ended(rows)

        under_way = 0
        try:
            while True:
                if interrupted():
                    keep(engine.take(0))
                    raise SweepInterruptedError(self.folder, len(stream.done), self.plan.runs)
                while under_way < engine.slots and (job := next(to_do, None)):
                    engine.submit(job)
                    under_way += 1
                if not under_way:
                    return
                ended = engine.take(_WAIT_S)
                under_way -= len(ended)
                keep(ended)
                view.refresh()
        finally:
            engine.stop()
            rmtree(self.folder / SCRATCH, ignore_errors=True)

    def conclude(self, note: Callable[[str], None]) -> tuple[Summary, dict[str, Any]]:
        """Write summary and figures of a complete sweep; return what the summary says."""
        table: pa.Table = read_parquet(self.folder / TABLE)
        if table["run"].to_pylist() != list(range(self.plan.runs)):
            raise MavherdError(f"{self.folder / TABLE}: has not the runs of this sweep")
        summary = Summary(self.plan, self.points, table)
        told = summary.as_json(self.source)
        write_text(self.folder / SUMMARY, dumps(told, indent=2, allow_nan=False) + "\n")
        if find_spec("matplotlib") is None:
            note(f"matplotlib is missing, so no figures ({INSTALL})")
        else:
            from .figures import draw

            draw(self.folder / FIGURES, summary)
        return summary, told
