"""Ctrl-C while a command is still being imported and read.

It raises KeyboardInterrupt as ever, and is remembered: Python drops an exception that falls into a
callback, of a weak reference during an import, say. Who takes Ctrl-C over then asks `presses`.
"""

import signal
from types import FrameType

_presses = 0


def remember() -> None:
    """Begin to count, unless somebody has us ignore Ctrl-C or sees to it already."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _press)


def presses() -> int:
    """Return how often Ctrl-C was pressed since `remember`."""
    return _presses


def _press(signum: int, frame: FrameType | None) -> None:
    global _presses
    _presses += 1
    raise KeyboardInterrupt
