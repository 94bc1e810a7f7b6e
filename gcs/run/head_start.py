"""Processes of a run that come up while the launcher itself still imports and reads.

Every process of a run imports for a third of a second. Side by side all are ready sooner; what
they shall do they are told when it is known.
"""

from types import TracebackType

from ...transport.channel import Channel
from .children import Child, Nursery, converse

_COORDINATOR = "mavherd.gcs.team.coordinator_process"


class HeadStart:
    """The nursery and a `coordinator`; who is not taken is ended at the end of the block."""

    def __init__(self, *, coordinator: bool = True) -> None:
        self._nursery: Nursery | None = Nursery()
        self._coordinator = converse(_COORDINATOR) if coordinator else None

    def nursery(self) -> Nursery:
        """Take the nursery; the taker ends it."""
        taken, self._nursery = self._nursery, None
        return taken or Nursery()

    def coordinator(self) -> tuple[Child, Channel]:
        """Take a coordinator that waits for its job; the taker ends it."""
        taken, self._coordinator = self._coordinator, None
        return taken or converse(_COORDINATOR)

    def close(self) -> None:
        """End who was not taken: there is nothing to finish."""
        if self._nursery:
            self._nursery.close(0.0)
        if self._coordinator:
            child, channel = self._coordinator
            channel.close()
            child.end(0.0)
        self._nursery = self._coordinator = None

    def __enter__(self) -> "HeadStart":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
