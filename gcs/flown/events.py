"""The event log of a run: one JSON object a line, written while the run goes on.

Whoever writes it holds a lock on it, which ends with its process, however that ends.
"""

import fcntl
import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, TextIO

from .folder import unreadable

_NAME = "events.jsonl"
_KEYS = {"t", "vehicle", "kind", "text"}


class EventLog(NamedTuple):
    """What events.jsonl holds."""

    events: tuple[Mapping[str, Any], ...]
    damaged: tuple[int, ...]  # the lines that are none; a last one without its end is not counted


def open_events(folder: Path) -> TextIO:
    """Return the new event log of the run in `folder`, which goes on until it is closed."""
    log = (folder / _NAME).open("w", buffering=1, encoding="utf-8")
    with suppress(OSError):  # a file system without locks
        fcntl.flock(log, fcntl.LOCK_EX)
    return log


def is_written(folder: Path) -> bool:
    """Return whether somebody is writing the event log of the run in `folder`."""
    with suppress(OSError), (folder / _NAME).open("rb") as log:
        try:
            fcntl.flock(log, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


def read_events(folder: Path) -> EventLog:
    """Return the events of the run in `folder`, as far as they can be read."""
    try:
        text = (folder / _NAME).read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return EventLog((), ())
    except OSError as error:
        raise unreadable(error, folder) from None
    whole, _, _ = text.rpartition("\n")
    found = [_event(line) for line in whole.split("\n") if whole]
    damaged = tuple(n for n, event in enumerate(found, 1) if event is None)
    return EventLog(tuple(event for event in found if event is not None), damaged)


def _event(line: str) -> Mapping[str, Any] | None:
    """Return one event; None when the line is none."""
    try:
        event = json.loads(line)
        if isinstance(event, dict) and event.keys() >= _KEYS and float(event["t"]) >= 0:
            return event
    except (ValueError, TypeError):
        pass
    return None
