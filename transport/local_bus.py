"""The bus of a run whose parts are all in one process: keys and mailboxes as on Zenoh, no network.

It gives what `bus.Bus` gives to a coordinator and to a launcher. One thread.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from .bus import Mailbox, Queue
from .questions import Question

Listeners = dict[str, list[Mailbox | Queue]]


@dataclass(frozen=True, slots=True)
class LocalPublisher:
    """Publishes on one key."""

    key: str
    listeners: list[Mailbox | Queue]

    def put(self, payload: bytes) -> None:
        """Hand one sample to everybody who listens."""
        for listener in self.listeners:
            listener.put(self.key, payload)

    @property
    def wanted(self) -> bool:
        """Whether anybody listens at this moment."""
        return bool(self.listeners)


@dataclass(frozen=True, slots=True)
class LocalNewest:
    """The newest sample of one key."""

    key: str
    box: Mailbox

    def get(self) -> bytes | None:
        """Return the newest payload, None before the first."""
        return self.box.latest.get(self.key)


class NoQuestions:
    """What is asked where nobody else is there to ask."""

    def drain(self) -> tuple[Question, ...]:
        """Return nothing."""
        return ()


@dataclass(frozen=True, slots=True)
class LocalToken:
    """Says that something is present until it is undeclared."""

    key: str
    tell: Callable[[str, bytes], None]

    def undeclare(self) -> None:
        """Be present no more."""
        self.tell(self.key, b"")


@dataclass(slots=True)
class LocalBus:
    """Keys are relative, as those of a `Bus`: nobody else is there to be told from."""

    _publishers: dict[str, LocalPublisher] = field(default_factory=dict)
    _subscriptions: list[tuple[str, Mailbox | Queue]] = field(default_factory=list)
    _present: dict[str, bytes] = field(default_factory=dict)
    _watchers: list[tuple[str, Mailbox]] = field(default_factory=list)

    def publisher(self, key: str) -> LocalPublisher:
        """Return a publisher of raw bytes on `key`."""
        publisher = self._publishers.get(key)
        if publisher is None:
            listeners = [box for expression, box in self._subscriptions if matches(expression, key)]
            publisher = self._publishers[key] = LocalPublisher(key, listeners)
        return publisher

    def latest(self, expression: str) -> Mailbox:
        """Subscribe and keep the newest sample of each key."""
        box = Mailbox()
        self._subscribe(expression, box)
        return box

    def queue(self, expression: str, size: int = 4096) -> Queue:
        """Subscribe and keep every sample, up to `size` unread ones."""
        queue = Queue(size)
        self._subscribe(expression, queue)
        return queue

    def newest(self, key: str) -> LocalNewest:
        """Subscribe to one key and keep its newest sample."""
        return LocalNewest(key, self.latest(key))

    def questions(self, key: str) -> NoQuestions:
        """Take questions on `key`: there are none."""
        return NoQuestions()

    def declare_token(self, key: str) -> LocalToken:
        """Declare presence on `key` until `undeclare()` is called."""
        self._tell(key, b"1")
        return LocalToken(key, self._tell)

    def watch_tokens(self, expression: str) -> Mailbox:
        """Follow presence: the mailbox holds b"1" for a living key and b"" for a lost one."""
        box = Mailbox()
        self._watchers.append((expression, box))
        for key, alive in self._present.items():
            if alive and matches(expression, key):
                box.put(key, alive)
        return box

    def close(self) -> None:
        """Forget who listens."""
        for publisher in self._publishers.values():
            publisher.listeners.clear()
        self._subscriptions.clear()

    def _subscribe(self, expression: str, into: Mailbox | Queue) -> None:
        self._subscriptions.append((expression, into))
        for key, publisher in self._publishers.items():
            if matches(expression, key):
                publisher.listeners.append(into)

    def _tell(self, key: str, alive: bytes) -> None:
        self._present[key] = alive
        for expression, box in self._watchers:
            if matches(expression, key):
                box.put(key, alive)


def matches(expression: str, key: str) -> bool:
    """Return whether `key` is one of those below `expression`, in which `*` is any one part."""
    wanted, parts = expression.split("/"), key.split("/")
    return len(wanted) == len(parts) and all(
        one in ("*", part) for one, part in zip(wanted, parts, strict=True)
    )
