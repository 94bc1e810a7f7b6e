"""The Zenoh bus: embedded router or client, explicit endpoints, nothing discovered by chance.

Only this module imports zenoh. Received samples wait in mailboxes that the owner's loop reads;
no user code runs in Zenoh's threads.
"""

import json
import os
import re
import threading
import time
from collections import deque
from collections.abc import Iterator
from typing import Any

# One small worker pool instead of several: fewer threads, less CPU. Read at the first open().
# Never combine it with express publications, which then lose samples.
os.environ.setdefault(
    "ZENOH_RUNTIME",
    "(app: (worker_threads: 1), net: (handover: app), acc: (handover: app), "
    "tx: (handover: app), rx: (handover: app))",
)
import zenoh

from .errors import LinkError
from .questions import MAX_WAITING, Answer, Questions

LEASE_MS = 3000
ROOT = "mavherd"


class Mailbox:
    """The newest payload of each key below an expression, and how many came."""

    def __init__(self) -> None:
        self.latest: dict[str, bytes] = {}
        self.received = 0
        self.arrived = threading.Event()

    def put(self, key: str, payload: bytes) -> None:
        """Keep `payload` as the newest of `key`; called in Zenoh's thread."""
        self.latest[key] = payload
        self.received += 1
        self.arrived.set()


class Queue:
    """Every sample below an expression, in order of arrival; the oldest go when it is full."""

    def __init__(self, size: int) -> None:
        self._items: deque[tuple[str, bytes]] = deque(maxlen=size)
        self.received = 0

    def put(self, key: str, payload: bytes) -> None:
        """Append one sample; called in Zenoh's thread."""
        self._items.append((key, payload))
        self.received += 1

    def drain(self) -> Iterator[tuple[str, bytes]]:
        """Yield and remove what has arrived."""
        while self._items:
            yield self._items.popleft()


class Newest:
    """The newest sample of one key, fetched when it is wanted: what comes between costs little."""

    def __init__(self, subscriber: Any) -> None:
        self._subscriber = subscriber
        self._last: bytes | None = None

    def get(self) -> bytes | None:
        """Return the newest payload, None before the first."""
        if (sample := self._subscriber.try_recv()) is not None:
            self._last = sample.payload.to_bytes()
        return self._last


class Publisher:
    """Publishes on one key."""

    def __init__(self, publisher: Any) -> None:
        self._publisher = publisher

    def put(self, payload: bytes) -> None:
        """Send one sample."""
        self._publisher.put(payload)

    @property
    def wanted(self) -> bool:
        """Whether anybody listens at this moment."""
        return bool(self._publisher.matching_status.matching)


class Bus:
    """One session. Keys given to its methods are relative to `mavherd/<run>/`.

    `reliable` publications wait for slow receivers (lockstep); others drop samples instead, and so
    do those that are for onlookers: nobody waits for those.
    """

    def __init__(self, session: Any, run: str, *, reliable: bool = False) -> None:
        self._session = session
        self._declarations: list[Any] = []  # Zenoh undeclares what is garbage-collected
        self.prefix = f"{ROOT}/{run}/"
        self._congestion = (
            zenoh.CongestionControl.BLOCK if reliable else zenoh.CongestionControl.DROP
        )
        # A callback that lives on at interpreter exit hangs it; threads are joined after this.
        getattr(threading, "_register_atexit", lambda _: None)(self.close)

    @classmethod
    def router(cls, endpoint: str, run: str, *, reliable: bool = False) -> "Bus":
        """Open the embedded router that all others connect to; `endpoint` as `tcp/HOST:PORT`."""
        try:
            session = zenoh.open(_config("router", listen=endpoint))
        except zenoh.ZError as error:
            raise LinkError(f"Zenoh cannot listen on {endpoint}: {_reason(error)}") from None
        return cls(session, run, reliable=reliable)

    @classmethod
    def client(cls, endpoint: str, run: str, *, reliable: bool = False) -> "Bus":
        """Connect to the router at `endpoint`; raise LinkError when it does not answer."""
        try:
            session = zenoh.open(_config("client", connect=endpoint))
        except zenoh.ZError as error:
            raise LinkError(f"no Zenoh router at {endpoint}: {_reason(error)}") from None
        return cls(session, run, reliable=reliable)

    def publisher(self, key: str, *, for_onlookers: bool = False) -> Publisher:
        """Return a publisher of raw bytes on `key`."""
        drop = zenoh.CongestionControl.DROP
        return Publisher(
            self._session.declare_publisher(
                self.prefix + key,
                encoding=zenoh.Encoding.APPLICATION_OCTET_STREAM,
                congestion_control=drop if for_onlookers else self._congestion,
                priority=zenoh.Priority.REAL_TIME,
                express=False,
            )
        )

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

    def newest(self, key: str) -> Newest:
        """Subscribe to one key and keep its newest sample, outside Python until it is wanted."""
        handler: Any = zenoh.handlers.RingChannel(1)
        subscriber = self._session.declare_subscriber(self.prefix + key, handler)
        self._declarations.append(subscriber)
        return Newest(subscriber)

    def questions(self, key: str) -> Questions:
        """Take questions on `key`; whoever asks waits until the owner's loop answers."""
        handler: Any = zenoh.handlers.RingChannel(MAX_WAITING)
        queryable = self._session.declare_queryable(self.prefix + key, handler)
        self._declarations.append(queryable)
        return Questions(queryable, self.prefix + key)

    def ask(self, key: str, text: str, timeout: float) -> Answer | None:
        """Ask on `key` and return the first answer, None when `timeout` seconds bring none."""
        deadline = time.monotonic() + timeout
        for reply in self._session.get(self.prefix + key, payload=text, timeout=timeout):
            granted = reply.ok is not None
            if not granted and time.monotonic() >= deadline:  # Zenoh's own: "Timeout"
                return None
            payload = (reply.ok if granted else reply.err).payload
            return Answer(granted, payload.to_bytes().decode("utf-8", "replace"))
        return None

    def declare_token(self, key: str) -> Any:
        """Declare presence on `key` until `undeclare()` is called or the session ends."""
        token = self._session.liveliness().declare_token(self.prefix + key)
        self._declarations.append(token)
        return token

    def watch_tokens(self, expression: str) -> Mailbox:
        """Follow presence: the mailbox holds b"1" for a living key and b"" for a lost one."""
        box = Mailbox()

        def on_change(sample: Any) -> None:
            alive = sample.kind == zenoh.SampleKind.PUT
            box.put(self._relative(sample), b"1" if alive else b"")

        handler = zenoh.handlers.Callback(on_change, indirect=False)
        self._declarations.append(
            self._session.liveliness().declare_subscriber(
                self.prefix + expression, handler, history=True
            )
        )
        return box

    def close(self) -> None:
        """Close the session; harmless when it is closed already."""
        if not self._session.is_closed():
            self._session.close()

    def __enter__(self) -> "Bus":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _subscribe(self, expression: str, into: Mailbox | Queue) -> None:
        def on_sample(sample: Any) -> None:
            into.put(self._relative(sample), sample.payload.to_bytes())

        handler = zenoh.handlers.Callback(on_sample, indirect=False)
        self._declarations.append(
            self._session.declare_subscriber(self.prefix + expression, handler)
        )

    def _relative(self, sample: Any) -> str:
        return str(sample.key_expr).removeprefix(self.prefix)


def _reason(error: Exception) -> str:
    """Return Zenoh's message without its source locations."""
    return re.sub(r" at \S+\.rs:\d+", "", str(error)).rstrip(". ")


def _config(mode: str, *, listen: str = "", connect: str = "") -> Any:
    return zenoh.Config.from_json5(
        json.dumps(
            {
                "mode": mode,
                "listen": {"endpoints": [listen] if listen else []},
                "connect": {
                    "endpoints": [connect] if connect else [],
                    "timeout_ms": 5000,
                    "exit_on_failure": True,
                    "retry": {
                        "period_init_ms": 50,
                        "period_max_ms": 500,
                        "period_increase_factor": 2,
                    },
                },
                "scouting": {
                    "delay": 0,
                    "multicast": {"enabled": False},
                    "gossip": {"enabled": False},
                },
                "timestamping": {"enabled": False},
                "transport": {
                    "link": {
                        "tx": {
                            "lease": LEASE_MS,
                            "queue": {
                                "congestion_control": {"block": {"wait_before_close": 500_000}}
                            },
                        }
                    },
                    "shared_memory": {"enabled": False},
                },
            }
        )
    )
