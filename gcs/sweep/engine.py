"""The seam between a sweep and where its runs are done: processes here, a cluster elsewhere."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

from .columns import Row
from .plan import Job

Task = Callable[[Job], Row]
"""Does one run and returns its row; it can be pickled, and carries all that a run needs."""


class Ended(NamedTuple):
    """A run that is over."""

    job: Job
    row: Row


class Engine(Protocol):
    """Does jobs, each once, wherever it likes and in any order.

    A job that could not be done in two attempts ends too, with a row that says why.
    """

    @property
    def slots(self) -> int:
        """Return how many jobs it wants to have, so that nobody waits."""
        ...

    def submit(self, job: Job) -> None:
        """Take one job; return at once."""
        ...

    def take(self, timeout: float) -> list[Ended]:
        """Return what has ended; wait up to `timeout` s for the first."""
        ...

    def stop(self) -> None:
        """Give up what is under way and free everything."""
        ...
