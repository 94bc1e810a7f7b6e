"""One Rerun recording on its way: to a file, to viewers that come and go, or to both.

Nothing here waits for a viewer. The server listens on loopback, keeps what viewers that come late
must have, and forgets the oldest beyond a limit.
"""

from pathlib import Path
from typing import Any

import numpy as np

from ..report.truth import Floats

APPLICATION = "mavherd"
TIMELINE = "sim_time"
SERVER_MEMORY = "512MiB"
_PATIENCE_S = 30  # for the rest to be written


class Stream:
    """Writes one recording over the timeline `sim_time`; Rerun is imported when it is made.

    `file` is where it is written, `serve` the port on loopback at which viewers get it, `start` the
    moment (Unix time, s) that is zero on the timeline.
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
        self._file = self._open(run_id, rr.FileSink(file), start) if file else None
        self._served = None
        if serve is not None:
            limit = SERVER_MEMORY
            server = rr.GrpcServerSink(bind_ip="127.0.0.1", port=serve, server_memory_limit=limit)
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

    def flush(self, patience_s: float = 1.0) -> None:
        """Hand what was recorded to the file and the viewers."""
        for rec in self._recs():
            rec.flush(timeout_sec=patience_s)

    def end_file(self) -> None:
        """Write the rest of the file and its end; viewers are served on."""
        file, self._file = self._file, None
        if file is not None:
            _end(file)

    def close(self) -> None:
        """End the recording; viewers keep what they have."""
        try:
            self.end_file()
        finally:
            served, self._served = self._served, None
            if served is not None:
                _end(served)

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


def _end(rec: Any) -> None:
    try:
        rec.flush(timeout_sec=_PATIENCE_S)
    finally:
        rec.disconnect()


def rgb(colour: str) -> tuple[int, int, int]:
    """Return `#rrggbb` as Rerun takes it."""
    red, green, blue = bytes.fromhex(colour[1:])
    return red, green, blue
