"""The keys that a user presses while a run goes on; the terminal is put back afterwards."""

import os
import re
import select
import signal
import sys
import termios
import threading
from collections.abc import Callable
from contextlib import suppress
from types import FrameType
from typing import Any

COMMANDS = {
    " ": "toggle",
    ".": "step",
    "\x1b[C": "step",  # right arrow, in either mode of a terminal
    "\x1bOC": "step",
    "+": "faster",
    "=": "faster",  # the key of + without shift
    "-": "slower",
    "1": "speed 1",
    "0": "speed max",
    "m": "speed max",
}
QUIT = "q"
HINT = "space pause/resume   . step   + - speed   1 real time   m max   q quit"

_KEY = re.compile(r"\x1b(?:\[[0-?]*[ -/]*[@-~]|O.)?|[^\x1b]", re.DOTALL)
_BLOCK = 256


class Keys:
    r"""The keyboard of a terminal while this context lasts: no echo, no waiting for a whole line.

    Ctrl-C, Ctrl-Z and Ctrl-\ do what they always do. Whoever runs in the background hears nothing
    and leaves the terminal as it is.
    """

    def __init__(self, fd: int) -> None:
        self._fd = fd
        self._before: list[Any] | None = None
        self._restore_signal: Callable[[], None] | None = None
        self._continued = False
        self._gone = False

    def __enter__(self) -> "Keys":
        with suppress(termios.error):
            self._before = termios.tcgetattr(self._fd)
        self._gone = self._before is None
        self._take()
        if threading.current_thread() is threading.main_thread():
            previous = signal.signal(signal.SIGCONT, self._note)  # after Ctrl-Z and `fg`
            self._restore_signal = lambda: _reinstall(signal.SIGCONT, previous)
        return self

    def __exit__(self, *_: object) -> None:
        if self._restore_signal:
            self._restore_signal()
        self._set(self._before)

    def pressed(self) -> list[str]:
        """Return the keys that wait to be read; a key is a character or an escape sequence."""
        if self._continued:
            self._continued = False
            self._take()
        if self._gone or not select.select([self._fd], [], [], 0)[0] or not self._is_ours():
            return []
        try:
            data = os.read(self._fd, _BLOCK)
        except OSError:
            data = b""
        self._gone = not data  # the terminal was closed
        return split_keys(data.decode("utf-8", "replace"))

    def wait(self, seconds: float) -> None:
        """Wait for a key, for so long at most."""
        if self._gone or not self._is_ours():
            select.select([], [], [], seconds)
        else:
            select.select([self._fd], [], [], seconds)

    def _take(self) -> None:
        if self._before:
            mode = [*self._before[:6], list(self._before[6])]
            mode[3] &= ~(termios.ECHO | termios.ICANON)
            mode[6][termios.VMIN], mode[6][termios.VTIME] = 1, 0
            self._set(mode)

    def _set(self, mode: list[Any] | None) -> None:
        if mode and self._is_ours():
            with suppress(termios.error):
                termios.tcsetattr(self._fd, termios.TCSANOW, mode)

    def _is_ours(self) -> bool:
        """Return whether we are in the foreground: else reading or setting would stop us."""
        try:
            return os.tcgetpgrp(self._fd) == os.getpgrp()
        except OSError:
            return False

    def _note(self, signum: int, frame: FrameType | None) -> None:
        self._continued = True


def keys_of_terminal() -> Keys | None:
    """Return the keyboard when a person sits before it: stdin and stderr are both a terminal."""
    try:
        fd = sys.stdin.fileno()
        return Keys(fd) if os.isatty(fd) and os.isatty(sys.stderr.fileno()) else None
    except (AttributeError, OSError, ValueError):  # closed, or replaced by something else
        return None


def split_keys(text: str) -> list[str]:
    """Return the keys in what a terminal has sent."""
    return _KEY.findall(text)


def _reinstall(signum: int, handler: Any) -> None:
    signal.signal(signum, signal.SIG_DFL if handler is None else handler)
