"""Forks vehicle processes from one parent that has imported everything: fast, and small in memory.

Run as `python -m mavherd.vehicles.nursery FD`, where FD is one end of a Unix stream socket. Each
request is one JSON object and the vehicle's sockets; the answer is its pid. Exits are reported as
they happen. End-of-file ends the nursery and every vehicle in it.
"""

import gc
import json
import os
import select
import signal
import socket
import sys
import time
import traceback
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn

from ..transport.errors import MavherdError
from ..transport.links import Endpoint, TcpServer, UdpOut
from .config import VehicleConfig
from .parameters import files
from .process import VehicleProcess
from .truth import TruthLog
from .vehicle import Vehicle

GC_THRESHOLD = 50_000  # objects; the loops make no cycles, so looking for them seldom is enough
MAX_REQUEST = 1 << 16
_GRACE_S = 0.5  # for vehicles to end by themselves after end-of-file


def main(fd: int) -> None:
    """Serve requests on `fd` until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the launcher decides
    keeper = socket.socket(fileno=fd)
    wake_read, wake_write = os.pipe()
    for end in (wake_read, wake_write):
        os.set_blocking(end, False)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.set_wakeup_fd(wake_write)
    gc.collect()
    gc.freeze()
    gc.set_threshold(GC_THRESHOLD)
    children: set[int] = set()
    while True:
        ready, _, _ = select.select([fd, wake_read], [], [])
        if wake_read in ready:
            os.read(wake_read, 4096)
            _report_exits(keeper, children)
        if fd in ready:
            try:
                request, fds, _, _ = socket.recv_fds(keeper, MAX_REQUEST, 8)
            except ConnectionError:  # closed with words of ours unread: the same end
                break
            if not request:
                break
            pid = os.fork()
            if pid == 0:
                signal.set_wakeup_fd(-1)
                signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                keeper.close()
                _become_vehicle(json.loads(request), fds)
            children.add(pid)
            for each in fds:
                os.close(each)
            _tell(keeper, {"pid": pid})
    _end(children)


def _report_exits(keeper: socket.socket, children: set[int]) -> None:
    while children:
        pid, status = os.waitpid(-1, os.WNOHANG)
        if pid == 0:
            return
        children.discard(pid)
        _tell(keeper, {"exited": pid, "code": os.waitstatus_to_exitcode(status)})


def _tell(keeper: socket.socket, fact: dict[str, Any]) -> None:
    with suppress(OSError):
        keeper.sendall(json.dumps(fact).encode() + b"\n")


def _end(children: set[int]) -> None:
    """Give the vehicles time to end by themselves, then kill those that are left."""
    deadline = time.monotonic() + _GRACE_S
    while children and time.monotonic() < deadline:
        pid, _ = os.waitpid(-1, os.WNOHANG)
        children.discard(pid)
        if pid == 0:
            time.sleep(0.01)
    for pid in children:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def _become_vehicle(request: dict[str, Any], fds: list[int]) -> NoReturn:
    """Be a vehicle process; never returns."""
    code = 3
    try:
        folder = Path(request["folder"])
        with (folder / "log.txt").open("ab", buffering=0) as log:
            os.dup2(log.fileno(), 1)
            os.dup2(log.fileno(), 2)
        coordinator, control = (socket.socket(fileno=fd) for fd in fds[:2])
        endpoints: list[Endpoint] = [UdpOut(*address) for address in request["udpout"]]
        if len(fds) > 2:
            endpoints.append(TcpServer(socket.socket(fileno=fds[2])))
        vehicle = Vehicle(VehicleConfig.from_json(request["config"]))
        values = {entry.parameter.name: entry.value for entry in vehicle.parameters}
        files.write(folder / "parameters.param", values)
        process = VehicleProcess(
            vehicle,
            endpoints,
            coordinator=coordinator,
            control=control,
            truth=TruthLog(folder, vehicle.config, vehicle.robot),
        )
        if request["lockstep"]:
            process.run_lockstep()
        else:
            process.run_free(started=request["started"])
        process.close()
        code = 0
    except (MavherdError, OSError) as error:  # OSError: the disk is full, say
        print(f"mavherd: {error}", file=sys.stderr)
    except BaseException:
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # not through the parent's own clean-up


if __name__ == "__main__":
    main(int(sys.argv[1]))
