"""One Rerun recording on its way: to a file, to viewers that come and go, or to both.

Nothing here waits for a viewer. The server listens on loopback, keeps what viewers that come late
must have, and forgets the oldest beyond a limit.
"""

import ctypes
import re
import shutil
import socket
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ...transport.errors import MavherdError
from ..report.truth import Floats
from .viewers import LOOPBACK

APPLICATION = "mavherd"
TIMELINE = "sim_time"
SERVER_MEMORY = "512MiB"
_PATIENCE_S = 30  # for the rest to be written
_FULL_BYTES = 1 << 20  # less room than that is none
_ENDED = "shut down"  # says Rerun of a thread that writes, or serves, no more


class RecordingError(MavherdError):
    """A recording that cannot go on."""

    exit_code = 3


class Stream:
    """Writes one recording over the timeline `sim_time`; Rerun is imported when it is made.

    `file` is where it is written, `serve` the port on loopback at which viewers get it, `start` the
    moment (Unix time, s) that is zero on the timeline. Raises MavherdError when the file cannot be
    begun; whether viewers are served, `flush_served` tells.
    """

    def __init__(
        self,
        run_id: str,
        *,
        file: Path | None = None,
        serve: int | None = None,
        start: float | None = None,
    ) -> None:
        import rerun as rr

        if file is None and serve is None:
            raise ValueError("a stream must go somewhere: give file, serve or both")
        self._rr = rr
        # One for each, for a file has its end only when its stream has: viewers may stay longer.
        self._path = file or Path()
        self._file = self._begin(run_id, file, start) if file else None
        self._served = None
        self._port = serve
        if serve is not None:
            limit = SERVER_MEMORY
            server = rr.GrpcServerSink(bind_ip=LOOPBACK, port=serve, server_memory_limit=limit)
            self._served = self._open(run_id, server, start)

    def blueprint(self, layout: Any) -> None:
        """Lay out the views: an rrb.Blueprint; one that comes later takes the place of the last.

        None: not yet. A file that is to be made smaller must have one only: see `compact`.
        """
        if layout is None:
            return
        for rec in self._recs():
            rec.send_blueprint(layout)

    def columns(self, entity: str, time: Floats, columns: Any) -> None:
        """Record many rows at once: `columns` as an archetype's `columns()` makes them."""
        if not len(time):
            return
        index = self._rr.TimeColumn(TIMELINE, duration=np.asarray(time))
        columns = list(columns)
        for rec in self._recs():
            rec.send_columns(entity, indexes=[index], columns=columns)

    def log(self, entity: str, time: float, what: Any) -> None:
        """Record what happens now and then."""
        for rec in self._recs():
            rec.set_time(TIMELINE, duration=time)
            rec.log(entity, what)

    def static(self, entity: str, *what: Any) -> None:
        """Record what holds at all times."""
        for rec in self._recs():
            rec.log(entity, *what, static=True)

    def name(self, title: str) -> None:
        """Say what the recording is called in the viewer's list."""
        for rec in self._recs():
            rec.send_recording_name(title)

    def flush_file(self, patience_s: float = 1.0) -> bool:
        """Hand what was recorded to the file; return whether that was done in time.

        Raises RecordingError when the file takes no more. Now and then Rerun does not notice that,
        and no flush is ever done again.
        """
        if self._file is not None:
            try:
                self._file.flush(timeout_sec=patience_s)
            except RuntimeError as error:
                if _ENDED in str(error):
                    raise self.lost() from None
                return False
        return True

    def flush_served(self, patience_s: float = 1.0) -> bool:
        """Hand what was recorded to the viewers; return whether that was done in time.

        Raises RecordingError when none can be served.
        """
        if self._served is not None:
            try:
                self._served.flush(timeout_sec=patience_s)
            except RuntimeError as error:
                if _ENDED in str(error):
                    raise RecordingError(f"port {self._port} cannot be served") from None
                return False
        return True

    def answers(self) -> bool:
        """Return whether viewers may come; raise RecordingError when none ever may."""
        if not self.flush_served():  # first: whoever else has the port would answer, too
            return False
        with suppress(OSError), socket.create_connection((LOOPBACK, self._port or 0), 1.0):
            return True
        return False

    def end_file(self, patience_s: float = _PATIENCE_S) -> None:
        """Write the rest of the file and its end; viewers are served on.

        Raises RecordingError when that cannot be written.
        """
        if self._file is not None:
            try:
                self._file.flush(timeout_sec=patience_s)
            except RuntimeError:
                raise self.lost() from None
            self._file.disconnect()
            self._file = None

    def end_served(self) -> None:
        """Let no viewer come any more; they keep what they have."""
        served, self._served = self._served, None
        if served is not None:
            try:
                with suppress(RuntimeError):  # they got what they got
                    served.flush(timeout_sec=_PATIENCE_S)
            finally:
                served.disconnect()

    def close(self) -> None:
        """End the recording; raises RecordingError when the file has not got all of it."""
        try:
            self.end_file()
        finally:
            self.end_served()

    def _begin(self, run_id: str, file: Path, start: float | None) -> Any:
        try:
            return self._open(run_id, self._rr.FileSink(file), start)
        except RuntimeError as error:
            with suppress(OSError):
                if file.is_file() and not file.stat().st_size:
                    file.unlink()
            raise MavherdError(f"{file}: cannot be written: {_cause(error)}") from None

    def lost(self) -> RecordingError:
        """Give up the file; return what is said of it.

        Rerun may wait for ever for one that takes no more: to disconnect, when the stream is let go
        of, and when Python ends.
        """
        if self._file is not None:
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(self._file))  # is never let go of
            self._file = None
            self._rr.unregister_shutdown()
        if shutil.disk_usage(self._path.parent).free < _FULL_BYTES:
            return RecordingError(f"{self._path}: the disk is full")
        return RecordingError(f"{self._path}: cannot be written any more")

    def _open(self, run_id: str, sink: Any, start: float | None) -> Any:
        rec = self._rr.RecordingStream(APPLICATION, recording_id=run_id)
        rec.set_log_tick_enabled(False)
        rec.set_log_time_enabled(False)
        rec.set_sinks(sink)
        if start is not None:
            rec.send_recording_start_time_nanos(round(start * 1e9))
        return rec

    def _recs(self) -> list[Any]:
        return [rec for rec in (self._file, self._served) if rec is not None]


def _cause(error: RuntimeError) -> str:
    """Return what the system says, of all that Rerun says."""
    known = re.search(r"([^:]+) \(os error \d+\)", str(error))
    return known[1].strip() if known else str(error)


def rgb(colour: str) -> tuple[int, int, int]:
    """Return `#rrggbb` as Rerun takes it."""
    red, green, blue = bytes.fromhex(colour[1:])
    return red, green, blue
