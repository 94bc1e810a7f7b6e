"""What every MAVLink service of a vehicle looks like; each link has its own."""

from collections.abc import Callable, Mapping
from typing import Protocol

from ...transport.mavlink import Message

Handler = Callable[[Message], list[Message]]
"""From a message of the ground to the replies that go back on the same link."""


class Service(Protocol):
    """One MAVLink microservice on one link."""

    @property
    def handlers(self) -> Mapping[str, Handler]:
        """Who takes which message, by name; the address has been looked at before."""
        ...


class PacedService(Service, Protocol):
    """A service that also sends later: lists under way, and requests that it repeats."""

    @property
    def busy(self) -> bool:
        """Whether something is under way; else `due` returns nothing until the next message."""
        ...

    def due(self, now: float) -> list[Message]:
        """Return what is to be sent unasked at `now`, s since boot; called often while busy."""
        ...
