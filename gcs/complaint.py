"""What a person is told, on streams that may be full, closed or nobody's any more."""

import os
import sys
from contextlib import suppress
from typing import TextIO

INSTALL = "pip install 'mavherd[view]'"
"""What gives somebody the figures, the tables, the recordings and their viewer."""


def complain(text: str) -> None:
    """Print one line on stderr; when that cannot be, the exit code still says what happened."""
    if sys.stderr is None:
        return
    try:
        print(text, file=sys.stderr, flush=True)
    except (OSError, ValueError):  # ValueError: closed
        give_up(sys.stderr)


def interrupted() -> int:
    """Tell that Ctrl-C ended the command; return the exit code.

    Ctrl-C while Python runs a text (dataclasses and named tuples are made of one) has CPython end
    itself by SIGINT later, although the exception was caught; running another text takes it back.
    """
    eval("None")  # noqa: S307
    complain("mavherd: interrupted")
    return 130


def settle() -> None:
    """Write out what stderr still holds; a failure must not become the exit code."""
    try:
        if sys.stderr is not None:
            sys.stderr.flush()
    except (OSError, ValueError):
        give_up(sys.stderr)


def deliver(text: str = "") -> None:
    """Write to stdout, and all that it still holds; an OSError names it."""
    try:
        print(text, end="", flush=True)
    except OSError as error:
        raise OSError(error.errno, error.strerror, "standard output") from None


def give_up(stream: TextIO | None) -> None:
    """Have a stream's last flush, by the interpreter, go nowhere instead of failing again."""
    with suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())  # type: ignore[union-attr]
