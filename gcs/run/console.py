"""The console of everything that is said to a person: stderr, which may be full, closed or gone."""

import sys
from contextlib import suppress
from typing import IO, Any, cast

from rich.console import Console


class QuietConsole(Console):
    """Writes to stderr; when nobody can read any more the command goes on in silence.

    Live output is for terminals only: colours that were forced (FORCE_COLOR in CI) make none.
    """

    def __init__(self) -> None:
        stream = _Forgiving(sys.stderr)
        super().__init__(file=cast("IO[str]", stream), stderr=True)
        self.is_interactive = stream.isatty() and not self.is_dumb_terminal


class _Forgiving:
    """A stream whose failures end the talking, not the command (`2>&1 | head`, a full disk)."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self.encoding = getattr(stream, "encoding", None) or "utf-8"
        self._dead = stream is None

    def isatty(self) -> bool:
        with suppress(OSError, ValueError):
            return not self._dead and bool(self._stream.isatty())
        return False

    def fileno(self) -> int:
        return int(self._stream.fileno())

    def write(self, text: str) -> int:
        try:
            if not self._dead:
                self._stream.write(text)
        except (OSError, ValueError):  # ValueError: closed
            self._dead = True
        return len(text)

    def flush(self) -> None:
        try:
            if not self._dead:
                self._stream.flush()
        except (OSError, ValueError):
            self._dead = True
