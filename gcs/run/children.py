"""The processes of a run: started, watched and ended by pid and process group, never by name."""

import os
import resource
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ...transport.channel import MAX_FDS, Channel, ChannelClosed
from ...transport.errors import VehicleError
from .interrupted import Interrupted

READY_S = 20.0  # for a process to come up on a slow machine
_END_S = 2.0  # for a process to end by itself before it is killed
_DEAD = "the process that starts the vehicles has died"
_ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1"}  # its threads spin, and we have no use for them
_SLICE_S = 0.1  # how often a wait looks whether the user has pressed Ctrl-C


class Child:
    """One process in a session of its own, so that Ctrl-C in the terminal reaches only us."""

    def __init__(
        self, module: str, args: Sequence[str], *, fds: Sequence[int] = (), **pipes: Any
    ) -> None:
        # -P: a file in the user's folder must not shadow a module of ours
        self.process = subprocess.Popen(  # noqa: S603
            [sys.executable, "-P", "-m", module, *args],
            pass_fds=fds,
            start_new_session=True,
            env={**_ENVIRONMENT, **os.environ},
            **{"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, **pipes},
        )
        self.cpu_s: float | None = None  # once it has ended, with what it has started

    def wait(self, timeout: float | None) -> int | None:
        """Return the exit code, None when the process has not ended within `timeout` seconds."""
        before = _cpu_of_the_dead()
        with suppress(subprocess.TimeoutExpired):
            code = self.process.wait(timeout)
            if self.cpu_s is None:
                self.cpu_s = _cpu_of_the_dead() - before
            return code
        return None

    def end(self, timeout: float = _END_S) -> int:
        """Wait for the process to end by itself, then kill its group; return the exit code."""
        code = self.wait(timeout)
        if code is None:
            self.kill()
            code = self.wait(None)
        return -signal.SIGKILL if code is None else code

    def terminate(self) -> None:
        """Ask the process to end at once."""
        with suppress(ProcessLookupError):
            self.process.terminate()

    def kill(self) -> None:
        """Kill the process and everything it has started."""
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)


def converse(module: str) -> tuple[Child, Channel]:
    """Start a process that has one end of a channel as its argument; return it and our end."""
    ours, theirs = socket.socketpair()
    with theirs:
        fd = theirs.fileno()
        return Child(module, [str(fd)], fds=[fd]), Channel(ours)


def hand_over(channel: Channel, sockets: Sequence[socket.socket]) -> None:
    """Send open sockets ahead of the message that tells what they are."""
    fds = [sock.fileno() for sock in sockets]
    for at in range(0, len(fds), MAX_FDS):
        channel.send({}, fds[at : at + MAX_FDS])


class Nursery:
    """Our end of the process that forks the vehicles; what it prints goes to `log`, once told."""

    def __init__(self) -> None:
        self._child, self._channel = converse("mavherd.vehicles.nursery")
        self._exits: dict[int, int] = {}
        self.costs: dict[int, float] = {}  # s of processor time, by pid, of vehicles that ended

    @property
    def cpu_s(self) -> float | None:
        """Return its processor time with that of all vehicles, once it has seen to their end."""
        return self._child.cpu_s if self._child.process.returncode == 0 else None

    def log_to(self, log: Path) -> None:
        """Say where its words go; before, they go where ours do."""
        log.touch()
        with suppress(ChannelClosed):  # it is dead already: noticed when a vehicle is asked for
            self._channel.send({"log": str(log.absolute())})

    def ask(self, request: dict[str, Any], sockets: Sequence[socket.socket]) -> None:
        """Have it make a vehicle with these sockets."""
        try:
            self._channel.send({**request, "fds": len(sockets)}, [s.fileno() for s in sockets])
        except ChannelClosed:
            raise VehicleError(_DEAD) from None

    def fork(self) -> None:
        """Have all vehicles born that were asked for."""
        with suppress(ChannelClosed):  # it is dead already: noticed when a pid is waited for
            self._channel.send({"fork": True})

    def pid(self, interrupted: Callable[[], bool]) -> int:
        """Return the pid of the next vehicle that was asked for; `interrupted` is asked often."""
        deadline = time.monotonic() + READY_S
        try:
            while (pid := self._next(_SLICE_S)) is None:
                if interrupted():
                    raise Interrupted
                if time.monotonic() > deadline:
                    raise VehicleError(f"a vehicle did not start within {READY_S:.0f} s")
        except ChannelClosed:
            raise VehicleError(_DEAD) from None
        return pid

    def _next(self, timeout: float) -> int | None:
        """Take in what comes within `timeout` seconds; return the pid when it tells of a start."""
        message = self._channel.receive(timeout)
        if message is None:
            return None
        if "pid" in message:
            return int(message["pid"])
        self._exits[message["exited"]] = message["code"]
        self.costs[message["exited"]] = message["cpu_s"]
        return None

    def exit_code(self, pid: int, timeout: float) -> int | None:
        """Return how the vehicle `pid` ended, None when that is not known in time."""
        self.hear_exits([pid], timeout)
        return self._exits.get(pid)

    def hear_exits(self, pids: Iterable[int], timeout: float) -> None:
        """Take in how these vehicles ended, as far as that is told within `timeout` seconds."""
        deadline = time.monotonic() + timeout
        with suppress(ChannelClosed):
            for pid in pids:
                while pid not in self._exits and (left := deadline - time.monotonic()) > 0:
                    self._next(left)

    def close(self, timeout: float = _END_S) -> None:
        """End the nursery and every vehicle in it, who may take `timeout` seconds to finish."""
        self._channel.close()
        self._child.end(timeout)
        self._child.kill()  # whatever it may have left in its group


def how_it_ended(code: int | None) -> str:
    """Return an exit code in words."""
    if code is None:
        return "ended"
    if code < 0:
        with suppress(ValueError):
            return f"was killed by {signal.Signals(-code).name}"
    return f"ended with exit code {code}"


def _cpu_of_the_dead() -> float:
    """Return the processor time (s) of all children that have been waited for, so far."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
