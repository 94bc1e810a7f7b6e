"""What is being done, for people who wait longer than two seconds for it."""

from collections.abc import Callable
from threading import Lock, Timer
from types import TracebackType

from rich.console import Console
from rich.status import Status

from .run.console import QuietConsole

WAIT_S = 2.0


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

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
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
