"""A finished recording made smaller: many small batches become few large ones."""

import subprocess
from pathlib import Path

from ...transport.errors import MavherdError
from .viewers import rerun_binary

MAX_BYTES = 200_000_000  # of a recording that is small enough to be held in memory
_PATIENCE_S = 15.0


def compact(recording: Path) -> bool:
    """Rewrite a whole recording in less room; return whether that could be done.

    Until it is done the recording stays as it is, and so it does when it cannot be done. Of several
    blueprints in it another one than the last may count afterwards.
    """
    if recording.stat().st_size > MAX_BYTES:
        return False
    smaller = recording.with_name(f".{recording.name}.part")
    try:
        subprocess.run(  # noqa: S603
            [rerun_binary(), "rrd", "optimize", recording, "-o", smaller],
            check=True,
            timeout=_PATIENCE_S,
            stdin=subprocess.DEVNULL,
            capture_output=True,
        )
        smaller.replace(recording)
    except (MavherdError, OSError, subprocess.SubprocessError):
        return False
    finally:
        smaller.unlink(missing_ok=True)
    return True
