"""Ctrl-C: remembered while a command is being imported, noted while it must end in order.

While a command is imported and read Ctrl-C raises KeyboardInterrupt as ever, and is remembered:
Python drops an exception that falls into a callback, of a weak reference during an import, say. Who
takes Ctrl-C over then asks `presses`, as `noted_stops` does.
"""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

_presses = 0


def remember() -> None:
    """Begin to count, unless somebody has us ignore Ctrl-C or sees to it already."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _press)


def presses() -> int:
    """Return how often Ctrl-C was pressed since `remember`."""
    return _presses


@contextmanager
def noted_stops() -> Iterator[Callable[[], bool]]:
    """Note signals that end programs instead of falling over them; yield whether one came."""
    came = [signal.SIGINT] * _presses
    ends = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # not under nohup
        ends.append(signal.SIGHUP)

    def note(signum: int, frame: FrameType | None) -> None:
        came.append(signal.Signals(signum))

    before = {each: signal.signal(each, note) for each in ends}
    try:
        yield lambda: bool(came)
    finally:
        for signum, handler in before.items():
            signal.signal(signum, handler)


def _press(signum: int, frame: FrameType | None) -> None:
    global _presses
    _presses += 1
    raise KeyboardInterrupt
