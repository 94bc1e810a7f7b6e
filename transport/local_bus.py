"""The bus of a run whose parts are all in one process: keys and mailboxes as on Zenoh, no network.

It gives what `bus.Bus` gives to a coordinator and to a launcher. One thread.
"""

from dataclasses import dataclass, field

from .bus import Mailbox
from .questions import Question


@dataclass(frozen=True, slots=True)
class LocalPublisher:
    """Publishes on one key."""

    key: str
    listeners: list[Mailbox]

    def put(self, payload: bytes) -> None:
        """Hand one sample to everybody who listens."""
        for listener in self.listeners:
            listener.put(self.key, payload)

    @property
    def wanted(self) -> bool:
        """Whether anybody listens at this moment."""
        return bool(self.listeners)


class NoQuestions:
    """What is asked where nobody else is there to ask."""

    def drain(self) -> tuple[Question, ...]:
        """Return nothing."""
        return ()


class NoToken:
    """Says that something is present where nobody else is there to be told."""

    def undeclare(self) -> None:
        """Be present no more."""


@dataclass(slots=True)
class LocalBus:
    """Keys are relative, as those of a `Bus`: nobody else is there to be told from."""

    _publishers: dict[str, LocalPublisher] = field(default_factory=dict)
    _subscriptions: list[tuple[str, Mailbox]] = field(default_factory=list)

    def publisher(self, key: str, *, for_onlookers: bool = False) -> LocalPublisher:
        """Return a publisher of raw bytes on `key`."""
        publisher = self._publishers.get(key)
        if publisher is None:
            listeners = [box for expression, box in self._subscriptions if matches(expression, key)]
            publisher = self._publishers[key] = LocalPublisher(key, listeners)
        return publisher

    def latest(self, expression: str) -> Mailbox:
        """Subscribe and keep the newest sample of each key."""
        box = Mailbox()
        self._subscriptions.append((expression, box))
        for key, publisher in self._publishers.items():
            if matches(expression, key):
                publisher.listeners.append(box)
        return box

    def questions(self, key: str) -> NoQuestions:
        """Take questions on `key`: there are none."""
        return NoQuestions()

    def declare_token(self, key: str) -> NoToken:
        """Declare presence on `key`: nobody follows it."""
        return NoToken()


def matches(expression: str, key: str) -> bool:
    """Return whether `key` is one of those below `expression`, in which `*` is any one part."""
    wanted, parts = expression.split("/"), key.split("/")
    return len(wanted) == len(parts) and all(
        one in ("*", part) for one, part in zip(wanted, parts, strict=True)
    )
