"""The moment from which a run counts: when the last robot has begun its path."""

from collections.abc import Mapping
from typing import Any

from ...transport.wire import Phase

_BEGUN = Phase.ACTIVE.name.lower()


class Readiness:
    """Learns from the events of a run of `count` robots when all of them were ready."""

    def __init__(self, count: int) -> None:
        self.at: float | None = None  # s of fleet time
        self._count = count
        self._begun: set[str] = set()

    def note(self, event: Mapping[str, Any]) -> None:
        """Take in one event, in the order in which they happened."""
        if event["kind"] == "phase" and event["text"] == _BEGUN:
            self._begun.add(event["vehicle"])
            if self.at is None and len(self._begun) == self._count:
                self.at = event["t"]
