"""What is being done, and how much of it is done, for people who wait longer than two seconds.

Both are told on stderr, and what is over by then says nothing.
"""

import time
from collections.abc import Callable
from threading import Lock, Timer

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.status import Status

from .run.console import QuietConsole

WAIT_S = 2.0
_REFRESH_S = 0.2
_LINE_S = 10.0  # between lines where no bar can be drawn


class Patience:
    """Shows on stderr what a command is at, from when it has taken `WAIT_S` seconds.

    `with Patience() as step: step("reading the logs")`: at a terminal one line that goes away
    again, elsewhere a line for each step.
    """

    def __init__(self, console: Console | None = None, wait_s: float = WAIT_S) -> None:
        self._console = console or QuietConsole()
        self._status: Status | None = None
        self._timer = Timer(wait_s, self._wake)
        self._timer.daemon = True
        self._lock = Lock()
        self._text = ""
        self._late = self._over = False

    def __enter__(self) -> Callable[[str], None]:
        self._timer.start()
        return self._step

    def __exit__(self, *_: object) -> None:
        self._timer.cancel()
        with self._lock:
            self._over = True
            if self._status:
                self._status.stop()

    def _step(self, text: str) -> None:
        with self._lock:
            self._text = text
            if self._late:
                self._show()

    def _wake(self) -> None:
        with self._lock:
            self._late = not self._over
            if self._late and self._text:
                self._show()

    def _show(self) -> None:
        if not self._console.is_interactive:
            self._console.print(f"{self._text} ...", highlight=False, markup=False)
        elif self._status:
            self._status.update(self._text)
        else:
            self._status = Status(self._text, console=self._console)
            self._status.start()


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
        if now - self._begun < WAIT_S or now - self._shown < period:
            return
        self._shown = now
        if self._console.is_interactive:
            self._progress.start()
            self._progress.update(self._task, completed=share, refresh=True)
        elif share > 0:
            left = (now - self._begun) * (1 - share) / share
            text = f"{self._what}: {share:.0%}, {left:.0f} s left"
            self._console.print(text, highlight=False, markup=False, soft_wrap=True)
