"""Questions that come over the bus and the answers that go back; see `Bus.questions` and `ask`."""

from collections.abc import Iterator
from typing import Any, NamedTuple

MAX_WAITING = 32  # questions; the oldest go unanswered when there are more
_MAX_BYTES = 200  # of a question that are read


class Question:
    """What somebody asks and waits to be answered."""

    def __init__(self, query: Any, key: str) -> None:
        self._query = query
        self._key = key
        payload = query.payload
        data = payload.to_bytes()[:_MAX_BYTES] if payload is not None else b""
        self.text: str = data.decode("utf-8", "replace")

    def answer(self, text: str) -> None:
        """Give the answer."""
        with self._query as query:  # whoever asks hears it when the query is given up
            query.reply(self._key, text)

    def refuse(self, text: str) -> None:
        """Say that there is none, and why."""
        with self._query as query:
            query.reply_err(text)


class Questions:
    """What is asked on one key, in order of arrival."""

    def __init__(self, queryable: Any, key: str) -> None:
        self._queryable = queryable
        self._key = key

    def drain(self) -> Iterator[Question]:
        """Yield and remove what has arrived."""
        for _ in range(MAX_WAITING):
            if (query := self._queryable.try_recv()) is None:
                return
            yield Question(query, self._key)


class Answer(NamedTuple):
    """What came of a question."""

    granted: bool
    text: str
