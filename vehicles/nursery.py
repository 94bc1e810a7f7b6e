"""Forks vehicle processes from one parent that has imported everything: fast, and small in memory.

Run as `python -m mavherd.vehicles.nursery FD`, where FD is one end of a `Channel`. Each request
comes with the vehicle's sockets, `fds` of them; at the word `fork` all that were asked for are
born, and each is answered for with its pid. Exits are reported as they happen. End-of-file ends the
nursery and every vehicle in it.
"""

import os
import select
import signal
import socket
import sys
import time
import traceback
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from ..transport.channel import Channel, ChannelClosed
from ..transport.child import log_to, settle
from ..transport.errors import MavherdError
from ..transport.links import Endpoint, TcpServer, UdpOut
from .config import VehicleConfig
from .parameters import files
from .process import VehicleProcess
from .rehearsal import rehearse
from .truth import TruthLog
from .vehicle import Vehicle

_LITTER = 8  # vehicles that are born together: each carries the others' making in its memory
_GRACE_S = 0.5  # for vehicles to end by themselves after end-of-file


class Unborn(NamedTuple):
    """A vehicle that has been made, or why it could not be, with its sockets."""

    vehicle: Vehicle | Exception
    request: dict[str, Any]
    fds: list[int]


def main(fd: int) -> None:
    """Serve requests on `fd` until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the launcher decides
    channel = Channel(socket.socket(fileno=fd))
    wake_read, wake_write = os.pipe()
    for end in (wake_read, wake_write):
        os.set_blocking(end, False)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.set_wakeup_fd(wake_write)
    rehearse()
    settle()
    children: set[int] = set()
    unborn: list[Unborn] = []
    with suppress(ChannelClosed):
        while True:
            ready, _, _ = select.select([fd, wake_read], [], [])
            if wake_read in ready:
                os.read(wake_read, 4096)
                _report_exits(channel, children)
            while fd in ready and (request := channel.receive(0.0)) is not None:
                if "log" in request:
                    log_to(request["log"])
                elif "fork" not in request:
                    unborn.append(_made(request, channel.fds))
                if "fork" in request or len(unborn) >= _LITTER:
                    last = max((each for it in unborn for each in it.fds), default=0)
                    while unborn:
                        children.add(_fork(unborn.pop(0), last, channel))
    _end(children)


def _made(request: dict[str, Any], fds: list[int]) -> Unborn:
    """Make a vehicle and take its sockets from `fds`.

    Many are made before one is born: what the making looks at, and thereby writes reference counts
    into, would otherwise be copied for each of them.
    """
    own, fds[:] = fds[: request["fds"]], fds[request["fds"] :]
    vehicle: Vehicle | Exception
    try:
        vehicle = Vehicle(VehicleConfig.from_json(request["config"]))
        values = {entry.parameter.name: entry.value for entry in vehicle.parameters}
        files.write(Path(request["folder"]) / "parameters.param", values)
    except Exception as error:  # its own process is to die of it, not ours
        vehicle = error
    return Unborn(vehicle, request, own)


def _fork(it: Unborn, last: int, channel: Channel) -> int:
    """Have a vehicle born and tell of it; return its pid. No file above `last` is open."""
    pid = os.fork()
    if pid == 0:
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        channel.socket.detach()
        _close_all_but(it.fds, last)
        _become(it)
    for fd in it.fds:
        os.close(fd)
    _tell(channel, {"pid": pid})
    return pid


def _close_all_but(own: list[int], last: int) -> None:
    """Close the nursery's and the siblings' files without a look at what the siblings are."""
    first = 3
    for fd in sorted(own):
        os.closerange(first, fd)
        first = fd + 1
    os.closerange(first, last + 1)


def _report_exits(channel: Channel, children: set[int]) -> None:
    while children:
        pid, status, usage = os.wait4(-1, os.WNOHANG)
        if pid == 0:
            return
        children.discard(pid)
        code, cpu_s = os.waitstatus_to_exitcode(status), usage.ru_utime + usage.ru_stime
        _tell(channel, {"exited": pid, "code": code, "cpu_s": cpu_s})


def _tell(channel: Channel, fact: dict[str, Any]) -> None:
    with suppress(ChannelClosed):
        channel.send(fact)


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
            os.waitpid(pid, 0)  # so that whoever waits for us knows what it has cost


def _become(it: Unborn) -> NoReturn:
    """Be a vehicle process; never returns."""
    code = 3
    vehicle, request, fds = it
    try:
        folder = Path(request["folder"])
        log_to(str(folder / "log.txt"))
        if isinstance(vehicle, Exception):
            raise vehicle
        coordinator, control = (socket.socket(fileno=fd) for fd in fds[:2])
        endpoints: list[Endpoint] = [UdpOut(*address) for address in request["udpout"]]
        if len(fds) > 2:
            endpoints.append(TcpServer(socket.socket(fileno=fds[2])))
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
