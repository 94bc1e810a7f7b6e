"""What a person sees while a sweep goes on (on stderr: `--json` leaves stdout pure)."""

import time
from collections.abc import Sequence

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from .columns import JUDGED, Row

_REFRESH_S = 0.5
_LINE_S = 10.0  # between lines where no bar can be drawn
_PATIENCE_S = 2.0  # what takes no longer needs no line


class SweepView:
    """A bar with the time left and what was counted; plain lines where the output is no terminal.

    It is drawn by `refresh`, never by a thread: workers are forked from this process.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("[dim]gone,[/dim]"),
            TimeRemainingColumn(),
            TextColumn("[dim]left[/dim]"),
            TextColumn("[dim]{task.fields[counted]}[/dim]"),
            console=console,
            auto_refresh=False,
            transient=True,
            disable=not console.is_interactive,
            speed_estimate_period=60,
        )
        self._bar = self._progress.add_task("runs", total=None, counted="")
        self._runs = self._done = self._collided = self._failed = 0
        self._begun = self._shown = time.monotonic()
        self._checked = -_LINE_S
        self._done_before = 0

    def __enter__(self) -> "SweepView":
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def checked(self, points: int, of: int) -> None:
        """Show how many grid points have been looked at."""
        self._progress.update(
            self._bar, description="checking the grid", completed=points, total=of
        )
        waited = time.monotonic() - self._begun
        if self._console.is_interactive:
            if waited > _REFRESH_S:  # it takes long enough to be looked at
                self._progress.start()
                self.refresh()
        elif waited > _PATIENCE_S and time.monotonic() - self._checked >= _LINE_S:
            self._checked = time.monotonic()
            left = _duration((of - points) * waited / points)
            self.note(f"checking the grid: {points} of {of} points, {left} left")

    def begun(self, done: int, runs: int) -> None:
        """Show that the sweep goes on from `done` of its `runs`."""
        self._runs, self._done, self._done_before = runs, done, done
        self._begun = time.monotonic()
        self._progress.start()
        if done:
            self.note(f"{done} of {runs} runs are done already")
        self._progress.reset(
            self._bar, description="runs", total=runs, completed=done, counted=self._counted()
        )
        self._show()

    def ended(self, rows: Sequence[Row]) -> None:
        """Count runs that have ended."""
        self._done += len(rows)
        self._collided += sum(bool(row.get("collisions")) for row in rows)
        self._failed += sum(row["exit_code"] not in JUDGED for row in rows)
        self._progress.update(self._bar, completed=self._done, counted=self._counted())

    def refresh(self) -> None:
        """Draw, if it is time."""
        period = _REFRESH_S if self._console.is_interactive else _LINE_S
        if time.monotonic() - self._shown >= period:
            self._show()

    def finished(self) -> None:
        """Say how long it took."""
        took, count = time.monotonic() - self._begun, self._done - self._done_before
        if count:
            self.note(f"{count} runs in {took:.1f} s, {count / took:.3g} a second")

    def note(self, text: str) -> None:
        """Print a line above the bar."""
        self._console.print(text, highlight=False, markup=False, soft_wrap=True)

    def _show(self) -> None:
        self._shown = time.monotonic()
        if self._console.is_interactive:
            self._progress.refresh()
        elif self._runs > self._done > self._done_before:
            rate = (self._done - self._done_before) / (self._shown - self._begun)
            left = _duration((self._runs - self._done) / rate)
            said = f"{self._done} of {self._runs} runs, {rate:.2g} a second, {left} left"
            self.note(", ".join(filter(None, [said, self._counted()])))

    def _counted(self) -> str:
        parts = [f"{self._collided} collided"] if self._collided else []
        parts += [f"{self._failed} failed"] if self._failed else []
        return ", ".join(parts)


def _duration(seconds: float) -> str:
    minutes, s = divmod(round(seconds), 60)
    hours, m = divmod(minutes, 60)
    return f"{hours}:{m:02d}:{s:02d}"
