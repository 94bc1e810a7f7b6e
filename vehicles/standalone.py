"""Vehicles by hand: each its own process with its own ports, on the wall clock, until stopped."""

import os
import signal
import socket
import sys
import time
import traceback
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NoReturn

from ..transport.errors import LinkError, MavherdError, VehicleError
from ..transport.links import Endpoint, TcpServer, UdpIn, UdpOut, parse_address
from .config import VehicleConfig
from .missions.files import read
from .parameters import files
from .process import VehicleProcess
from .vehicle import Vehicle

_KEPT = "parameters.param"
_GRACE_S = 2.0  # for vehicles to end by themselves


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """One vehicle to serve: who it is, its ports, its mission file and where it keeps things."""

    config: VehicleConfig
    tcp: socket.socket | None
    udpin: Sequence[str]
    udpout: Sequence[str]
    mission: Path | None = None
    folder: Path | None = None


def serve(
    starts: Sequence[Start],
    *,
    speed: float = 1.0,
    parameter_files: Sequence[Path] = (),
    wipe: bool = False,
) -> int:
    """Serve MAVLink until Ctrl-C or SIGTERM; return the exit code.

    Everything that can be wrong is found before the first vehicle runs: raises ValueError for
    parameters that cannot be, LinkError for ports that cannot be had, MavherdError for files.
    """
    if not 0.01 <= speed <= 100:
        raise ValueError(f"--speed {speed:g}: expected a factor of 0.01..100")
    given: dict[str, float] = {}
    for path in parameter_files:
        values, foreign = files.fit(path, starts[0].config)
        given.update(values)
        if foreign:
            print(f"{path}: {_left_out(foreign)}", file=sys.stderr)
    processes = [_process(start, given, wipe) for start in starts]
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    for start, process in zip(starts, processes, strict=True):
        config = start.config
        print(f"{config.name}: {config.kind}, system id {config.system_id}: {process.labels}")
    print("Ctrl-C stops it." if len(starts) == 1 else "Ctrl-C stops them.", file=sys.stderr)
    sys.stdout.flush()
    sys.stderr.flush()
    if len(processes) == 1:
        _run(processes[0], speed)
        return 0
    return _supervise(starts, processes, speed)


def _left_out(names: Sequence[str]) -> str:
    """Return how to tell of parameters in a file that are not for this kind of vehicle."""
    some = ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")
    return f"{len(names)} parameters that this vehicle does not have, or not to set: {some}"


def _process(start: Start, given: dict[str, float], wipe: bool) -> VehicleProcess:
    """Return the process of one vehicle, with its ports open."""
    if not (start.tcp or start.udpin or start.udpout):
        raise LinkError("the vehicle has no port at all: give --tcp, --udpin or --udpout")
    config = start.config
    kept = start.folder / _KEPT if start.folder else None
    params = dict(given)
    if kept and wipe:
        kept.unlink(missing_ok=True)
    if kept and kept.exists():
        params.update(files.fit(kept, config).values)
    params.update(config.params)
    vehicle = Vehicle(replace(config, params=params, epoch_us=round(time.time() * 1e6)))
    if start.mission:
        vehicle.missions.load(read(start.mission), str(start.mission))
    if kept:
        kept.parent.mkdir(parents=True, exist_ok=True)
        vehicle.parameters.on_change = lambda: files.save(kept, vehicle.parameters)
    endpoints: list[Endpoint] = []
    endpoints += [TcpServer(start.tcp)] if start.tcp else []
    endpoints += [UdpIn(*parse_address(text, "--udpin")) for text in start.udpin]
    endpoints += [UdpOut(*parse_address(text, "--udpout")) for text in start.udpout]
    return VehicleProcess(vehicle, endpoints)


def _run(process: VehicleProcess, speed: float) -> None:
    try:
        process.run_free(speed)
    except KeyboardInterrupt:
        process.close()


def _supervise(starts: Sequence[Start], processes: Sequence[VehicleProcess], speed: float) -> int:
    """Fork a child for each vehicle; one that dies ends them all."""
    children: dict[int, str] = {}
    try:
        for start, process in zip(starts, processes, strict=True):
            pid = os.fork()
            if pid == 0:
                _be_child(process, [p for p in processes if p is not process], speed)
            children[pid] = start.config.name
        for process in processes:
            process.close()
        pid, status = os.wait()
        name = children.pop(pid)
        raise VehicleError(
            f"{name} ended by itself (exit code {os.waitstatus_to_exitcode(status)}); "
            "the others have been stopped"
        )
    except KeyboardInterrupt:
        return 0
    finally:
        _stop(children)


def _be_child(process: VehicleProcess, others: Sequence[VehicleProcess], speed: float) -> NoReturn:
    """Serve one vehicle with only its own sockets; never returns."""
    code = 0
    try:
        for other in others:
            other.close()
        _run(process, speed)
    except (MavherdError, OSError) as error:
        print(f"mavherd: {process.vehicle.config.name}: {error}", file=sys.stderr)
        code = 3
    except KeyboardInterrupt:
        pass
    except BaseException:
        traceback.print_exc()
        code = 3
    sys.stderr.flush()
    os._exit(code)


def _stop(children: dict[int, str]) -> None:
    """End every child, and wait for it."""
    for pid in children:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGTERM)
    deadline = time.monotonic() + _GRACE_S
    while children and time.monotonic() < deadline:
        pid, _ = os.waitpid(-1, os.WNOHANG)
        children.pop(pid, None)
        if pid == 0:
            time.sleep(0.01)
    for pid in children:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
