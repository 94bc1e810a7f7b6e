"""Ctrl-C, SIGTERM and SIGHUP while a fleet is open: never in mid-tick, always in order."""

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_GRACE_S = 1.0  # for a tick to end by itself


class Terminated(SystemExit):
    """We are to end: the with block is left as by any exception, then the process ends."""

    def __init__(self, signum: int) -> None:
        super().__init__(128 + signum)


class Signals:
    """Turns these signals into exceptions, raised where a script can bear them.

    Only in the main thread; elsewhere whoever started the thread has its own way to stop.
    """

    def __init__(self) -> None:
        self._before: dict[int, Any] = {}
        self._guarded = 0
        self._pending: BaseException | None = None
        self._since = 0.0

    def install(self) -> None:
        """Begin to look after signals that nobody else does."""
        if threading.current_thread() is not threading.main_thread():
            return
        for signum in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(signum) in (signal.default_int_handler, signal.SIG_DFL):
                self._before[signum] = signal.signal(signum, self._note)

    def remove(self) -> None:
        """Put back what was there before."""
        for signum, handler in self._before.items():
            signal.signal(signum, handler)
        self._before = {}

    def interrupted(self) -> bool:
        """Return whether a wait should be given up: a signal came, and the tick does not end."""
        return self._pending is not None and time.monotonic() - self._since > _GRACE_S

    @contextmanager
    def guard(self) -> Iterator[None]:
        """Keep a signal until the end of what must be done as a whole."""
        self._guarded += 1
        try:
            yield
        finally:
            self._guarded -= 1
        if not self._guarded and (pending := self._pending):
            self._pending = None
            raise pending

    def _note(self, signum: int, frame: FrameType | None) -> None:
        error = KeyboardInterrupt() if signum == signal.SIGINT else Terminated(signum)
        if not self._guarded:
            raise error
        self._pending, self._since = error, time.monotonic()
