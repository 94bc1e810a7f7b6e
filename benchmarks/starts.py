"""From the command to a team that is ready: `mavherd run` with N vehicles, in seconds of wall time.

A vehicle is ready when its coordinator has heard that it can arm, and says so in its first event.
"""

import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from fields import write_field

PATIENCE_S = 60.0
_PORTS = tuple(word for name in ("--gcs-udp", "--api-udp", "--tcp") for word in (name, "0"))


class Start(NamedTuple):
    """Seconds since the command."""

    up: float  # all processes are there, and fleet time begins
    ready: float  # all vehicles are heard, and told to arm


def start(robots: int) -> Start:
    """Start a run of so many vehicles, and end it when all are ready."""
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        scenario = write_field(robots, folder)
        command = [sys.executable, "-m", "mavherd", "run", str(scenario), "--no-record", *_PORTS]
        begun = time.perf_counter()
        with subprocess.Popen(command, cwd=folder, stderr=subprocess.DEVNULL) as process:
            try:
                return _watch(process, folder, robots, begun)
            finally:
                process.send_signal(signal.SIGINT)


def _watch(process: subprocess.Popen[bytes], folder: Path, robots: int, begun: float) -> Start:
    up = 0.0
    while (now := time.perf_counter() - begun) < PATIENCE_S:
        if process.poll() is not None:
            raise RuntimeError(f"the run of {robots} ended with {process.returncode}")
        for log in folder.glob("runs/*/events.jsonl"):
            with suppress(OSError):
                told = log.read_text().count('"kind": "phase"')
                up = up or (now if (log.parent / "ports.json").exists() else 0.0)
                if told >= robots:
                    return Start(up or now, now)
        time.sleep(0.005)
    raise RuntimeError(f"{robots} vehicles were not ready within {PATIENCE_S:g} s")
