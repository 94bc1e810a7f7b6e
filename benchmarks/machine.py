"""What Linux tells of this machine and of processes on it."""

import os
import platform
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

PROC = Path("/proc")


class Memory(NamedTuple):
    """Of one process, MB."""

    pss: float  # shared pages count in parts
    rss: float


def cpu_seconds(pid: int) -> dict[str, float]:
    """Return CPU seconds of a process's living threads: "main", and the others by their names."""
    spent: dict[str, float] = {}
    with suppress(OSError):  # it has ended
        for task in (PROC / str(pid) / "task").iterdir():
            with suppress(OSError):
                name = "main" if int(task.name) == pid else (task / "comm").read_text().strip()
                nanoseconds = int((task / "schedstat").read_text().split()[0])
                spent[name] = spent.get(name, 0.0) + nanoseconds * 1e-9
    return spent


def memory(pid: int) -> Memory:
    """Return what a process holds now."""
    kilobytes = {}
    for line in (PROC / str(pid) / "smaps_rollup").read_text().splitlines()[1:]:
        name, _, rest = line.partition(":")
        kilobytes[name] = int(rest.split()[0])
    return Memory(kilobytes["Pss"] / 1024, kilobytes["Rss"] / 1024)


def descendants(pid: int) -> list[int]:
    """Return the processes below a process."""
    children: dict[int, list[int]] = {}
    for entry in PROC.iterdir():
        if entry.name.isdigit():
            with suppress(OSError):
                parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
                children.setdefault(parent, []).append(int(entry.name))
    found, waiting = [], [pid]
    while waiting:
        below = children.get(waiting.pop(), [])
        found += below
        waiting += below
    return found


def command_line(pid: int) -> str:
    """Return how a process was started, "" when it has ended."""
    with suppress(OSError):
        return (PROC / str(pid) / "cmdline").read_bytes().replace(b"\0", b" ").decode().strip()
    return ""


def output_of(pid: int) -> Path:
    """Return where a process writes to."""
    return (PROC / str(pid) / "fd" / "1").resolve()


def facts() -> dict[str, str]:
    """Return what a reader of figures should know of the machine."""
    model = "unknown"
    for line in (PROC / "cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            model = line.partition(":")[2].strip()
            break
    return {
        "processor": model,
        "cores": str(len(os.sched_getaffinity(0))),
        "python": platform.python_version(),
        "platform": platform.platform(),
    }
