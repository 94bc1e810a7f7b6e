"""Several vehicles by hand, each a forked process of its own: they end together.

Every child holds one end of a socket pair whose other end only the parent has. However the parent
ends, its children read end-of-file and end, too.
"""

import gc
import os
import signal
import socket
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NoReturn

from ..transport.errors import MavherdError, VehicleError
from .process import VehicleProcess

_STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_GRACE_S = 1.0  # for vehicles to end by themselves

Serve = Callable[[VehicleProcess], None]


def heed_stops() -> None:
    """Have SIGTERM and SIGHUP do what Ctrl-C does: raise KeyboardInterrupt (not under nohup)."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        signal.signal(signal.SIGHUP, signal.default_int_handler)


def rear(processes: Sequence[VehicleProcess], serve: Serve, keeper: socket.socket) -> NoReturn:
    """Fork a child for each vehicle and wait: for a signal to stop, or the end of one of them.

    `keeper` is the parent's end of what the processes have as their control sockets. Whatever
    happens, no child is left; raises VehicleError when one has ended by itself, else
    KeyboardInterrupt. Signals are blocked from here on: none can come between us and the children.
    """
    children: dict[int, str] = {}
    gc.freeze()
    stops = {each for each in _STOPS if signal.getsignal(each) is not signal.SIG_IGN}
    signal.signal(signal.SIGCHLD, lambda *_: None)  # who ignores it is told of no end
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {*_STOPS, signal.SIGCHLD})
    try:
        for process in processes:
            pid = _fork(process, processes, serve, keeper, before)
            children[pid] = process.vehicle.config.name
        for process in processes:
            process.close()
        while signal.sigwait({*stops, signal.SIGCHLD}) == signal.SIGCHLD:  # stops come first
            # who was frozen or thawed has not ended; `_stop` alone takes them away
            if ended := os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOWAIT | os.WNOHANG):
                who = f"{children[ended.si_pid]} ended by itself ({_how(ended)})"
                raise VehicleError(f"{who}; the others have been stopped")
        raise KeyboardInterrupt
    finally:
        _stop(children, keeper)


def _fork(
    process: VehicleProcess,
    processes: Sequence[VehicleProcess],
    serve: Serve,
    keeper: socket.socket,
    mask: set[int | signal.Signals],
) -> int:
    """Return the pid of a new child, which blocks the signals of `mask` only."""
    pid = os.fork()
    if pid == 0:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends these to everybody:
        signal.signal(signal.SIGHUP, signal.SIG_IGN)  # the parent decides
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        keeper.close()
        for other in processes:
            if other is not process:
                other.close()
        _be_child(process, serve)
    return pid


def _be_child(process: VehicleProcess, serve: Serve) -> NoReturn:
    """Serve one vehicle; never returns."""
    code = 3
    try:
        serve(process)
        code = 0
    except (MavherdError, OSError) as error:
        print(f"mavherd: {process.vehicle.config.name}: {error}", file=sys.stderr)
    except BaseException:
        traceback.print_exc()
    with suppress(OSError):  # nobody may be reading any more
        sys.stderr.flush()
    os._exit(code)  # not through the parent's own clean-up


def _how(ended: os.waitid_result) -> str:
    """Return the exit code or signal with which a child has ended."""
    if ended.si_code == os.CLD_EXITED:
        return f"exit code {ended.si_status}"
    return signal.Signals(ended.si_status).name


def _stop(children: dict[int, str], keeper: socket.socket) -> None:
    """End every child, and wait for it."""
    keeper.close()
    deadline = time.monotonic() + _GRACE_S
    while children and time.monotonic() < deadline:
        pid, _ = os.waitpid(-1, os.WNOHANG)
        children.pop(pid, None)
        if pid == 0:
            time.sleep(0.01)
    for pid in children:
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
