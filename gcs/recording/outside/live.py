"""Outside vehicles live: lines in, a recording out, until somebody has seen enough."""

import contextlib
import select
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from ....transport.connect import Address
from ....transport.errors import MavherdError
from ....transport.tlog import TlogWriter
from .lines import Lines

_LOOK_S = 0.05  # between two looks at what has to be sent
_SILENCE_S = 5.0  # until it is said where nobody is heard
_FLUSH_S = 0.2  # between batches: what a viewer shows is this old
_FILE_FLUSH_S = 0.8  # where only a file is written, which is smaller for it


class Watch:
    """Records vehicles heard at `addresses`, to `file`, to viewers at port `serve`, or to both.

    Raises LinkError for a line that cannot be had, before Rerun is imported. `tlog` gets every
    frame, heard or sent. `tell` gets every event as it is recorded, `warn` a line for
    each address where nobody is heard after a while. `silent`: nothing is sent.
    `file` and `tlog` are written as `.part` and renamed at the end; if no vehicle was heard, or if
    anything cannot be had (MavherdError), none is left. When `file` takes no more, RecordingError
    says so, and its `.part` stays with what came before.
    """

    def __init__(
        self,
        addresses: Sequence[Address],
        *,
        file: Path | None = None,
        serve: int | None = None,
        tlog: Path | None = None,
        silent: bool = False,
        tell: Callable[[dict[str, Any]], None] | None = None,
        warn: Callable[[str], None] = lambda _: None,
    ) -> None:
        self._file = file
        self._part = file.with_name(file.name + ".part") if file else None
        self._tlog: TlogWriter | None = None
        with contextlib.ExitStack() as undo:
            self._lines = Lines(addresses, silent=silent, tap=self._log if tlog else None)
            undo.callback(self._lines.close)
            from ..stream import Stream  # Rerun takes its time; the sockets are open already
            from .watch import Outside

            began = time.time()
            self._run_id = time.strftime("outside-%Y%m%d-%H%M%S", time.localtime(began))
            title = ", ".join(address.text for address in addresses)
            self._stream = stream = Stream(self._run_id, file=self._part, serve=serve, start=began)
            if self._part:
                undo.callback(self._part.unlink, missing_ok=True)
            undo.callback(stream.close)
            if tlog:
                self._tlog = _open_tlog(tlog)
                undo.callback(self._tlog.discard)
            self._period = _FILE_FLUSH_S if serve is None else _FLUSH_S
            self.outside = Outside(stream, title, tell)
            undo.pop_all()
        self.url = f"rerun+http://127.0.0.1:{serve}/proxy" if serve else ""
        self._began_us = round(began * 1e6)
        self._started = time.monotonic()
        self._warn = warn
        self._warned = False

    @property
    def now(self) -> float:
        """Seconds since the beginning."""
        return time.monotonic() - self._started

    def run(
        self,
        stopped: Callable[[], bool],
        duration: float | None = None,
        goes_on: Callable[[], bool] | None = None,
    ) -> None:
        """Record until it is `stopped`, the time is over, or nobody looks.

        An exception in between, as Ctrl-C would be, could leave a vehicle half told of.
        """
        outside, lines = self.outside, self._lines
        flush_at = 0.0
        while not stopped() and (duration is None or self.now < duration):
            with contextlib.suppress(OSError, ValueError):  # a line was just lost
                select.select(lines.sockets(), [], [], _LOOK_S)
            now = self.now
            for message, source in lines.receive(now):
                outside.hear(message, source, now)
            vehicles = list(outside.vehicles.values())
            lines.tend(vehicles, now)
            if not self._warned and now > _SILENCE_S:
                self._warned = True
                for text in lines.silences(vehicles):
                    self._warn(text)
            if now >= flush_at:
                if goes_on and not goes_on():
                    return
                outside.flush(now)
                self._stream.flush_file()  # who is killed has recorded it
                flush_at = now + self._period

    def silences(self) -> list[str]:
        """Return a line for each address where no vehicle is heard."""
        return self._lines.silences(list(self.outside.vehicles.values()))

    def close(self) -> None:
        """End the recording and close the lines."""
        self._lines.close()
        heard = bool(self.outside.vehicles)
        try:
            self.outside.close(self.now)
            if self._part and self._file and heard:
                self._part.replace(self._file)
        finally:
            if self._part and self._part.exists() and not (heard and self._part.stat().st_size):
                self._part.unlink()
            if self._tlog:
                self._tlog.close() if heard else self._tlog.discard()

    def __enter__(self) -> "Watch":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        self.close()

    def _log(self, frames: bytes) -> None:
        if self._tlog:
            self._tlog.write(self._began_us + round(self.now * 1e6), frames)


def _open_tlog(path: Path) -> TlogWriter:
    try:
        return TlogWriter(path)
    except OSError as error:
        raise MavherdError(f"{path}: cannot be written: {error.strerror}") from None
