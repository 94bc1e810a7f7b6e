"""How far a command has come, on stderr, for whatever takes longer than two seconds."""

import time

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from .run.console import QuietConsole

_WAIT_S = 2.0  # what is over by then needs no bar
_REFRESH_S = 0.2
_LINE_S = 10.0  # between lines where no bar can be drawn


class Bar:
    """A bar with the time left, from the third second on; lines where there is no terminal."""

    def __init__(self, what: str, console: Console | None = None) -> None:
        self._what = what
        self._console = console or QuietConsole()
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("[dim]left[/dim]"),
            TimeRemainingColumn(),
            console=self._console,
            auto_refresh=False,
            transient=True,
        )
        self._task = self._progress.add_task(what, total=1.0)
        self._begun = self._shown = time.monotonic()

    def __enter__(self) -> "Bar":
        return self

    def __exit__(self, *_: object) -> None:
        if self._progress.live.is_started:
            self._progress.stop()

    def reach(self, share: float) -> None:
        """Show that this share (0..1) is done; call it as often as you like."""
        now = time.monotonic()
        period = _REFRESH_S if self._console.is_interactive else _LINE_S
        if now - self._begun < _WAIT_S or now - self._shown < period:
            return
        self._shown = now
        if self._console.is_interactive:
            self._progress.start()
            self._progress.update(self._task, completed=share, refresh=True)
        elif share > 0:
            left = (now - self._begun) * (1 - share) / share
            text = f"{self._what}: {share:.0%}, {left:.0f} s left"
            self._console.print(text, highlight=False, markup=False, soft_wrap=True)
