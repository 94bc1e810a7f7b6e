"""Vehicles by hand: each its own process with its own ports, on the wall clock, until stopped."""

import socket
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from ..transport.errors import LinkError, MavherdError, os_reason
from ..transport.links import Endpoint, TcpServer, UdpIn, UdpOut, parse_address
from .brood import heed_stops, rear
from .config import VehicleConfig
from .missions.files import read
from .parameters import files
from .process import VehicleProcess
from .vehicle import Vehicle

_KEPT = "parameters.param"


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
    """Serve MAVLink until Ctrl-C, SIGTERM or SIGHUP; return the exit code.

    Everything that can be wrong is found before the first vehicle runs: raises ValueError for
    parameters that cannot be, LinkError for ports that cannot be had, MavherdError for files.
    Raises VehicleError when one of several has ended by itself; the others are stopped.
    """
    given: dict[str, float] = {}
    for path in parameter_files:
        values, foreign = files.fit(path, starts[0].config)
        given.update(values)
        if foreign:
            print(f"{path}: {_left_out(foreign)}", file=sys.stderr)
    with ExitStack() as opened:
        keeper = leash = None
        if len(starts) > 1:
            keeper, leash = map(opened.enter_context, socket.socketpair())
        processes = [_process(start, given, wipe, leash, opened) for start in starts]
        heed_stops()
        with suppress(KeyboardInterrupt):
            _announce(processes)
            run = partial(VehicleProcess.run_free, speed=speed)
            if keeper:
                rear(processes, run, keeper)
            run(processes[0])
    return 0


def _announce(processes: Sequence[VehicleProcess]) -> None:
    """Print who listens where."""
    for process in processes:
        config = process.vehicle.config
        print(f"{config.name}: {config.kind}, system id {config.system_id}: {process.labels}")
    print("Ctrl-C stops it." if len(processes) == 1 else "Ctrl-C stops them.", file=sys.stderr)
    sys.stdout.flush()
    sys.stderr.flush()


def _left_out(names: Sequence[str]) -> str:
    """Return how to tell of parameters in a file that are not for this kind of vehicle."""
    some = ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")
    return f"{len(names)} parameters that this vehicle does not have, or not to set: {some}"


def _process(
    start: Start,
    given: dict[str, float],
    wipe: bool,
    leash: socket.socket | None,
    opened: ExitStack,
) -> VehicleProcess:
    """Return the process of one vehicle, with its ports open until `opened` is left."""
    if not (start.tcp or start.udpin or start.udpout):
        raise LinkError("the vehicle has no port at all: give --tcp, --udpin or --udpout")
    config = start.config
    kept = _kept(start.folder, wipe) if start.folder else None
    params = {**given, **(_restored(kept, config) if kept else {}), **config.params}
    vehicle = Vehicle(replace(config, params=params, epoch_us=round(time.time() * 1e6)))
    if start.mission:
        vehicle.missions.load(read(start.mission), str(start.mission))
    if kept:
        files.save(kept, vehicle.parameters)  # now, if it cannot be
        vehicle.parameters.on_change = lambda: files.save(kept, vehicle.parameters)
    endpoints = []
    for endpoint in _endpoints(start):
        opened.callback(endpoint.close)
        endpoints.append(endpoint)
    return VehicleProcess(vehicle, endpoints, control=leash)


def _endpoints(start: Start) -> Iterator[Endpoint]:
    """Open the ports of one vehicle."""
    if start.tcp:
        yield TcpServer(start.tcp)
    for text in start.udpin:
        yield UdpIn(*parse_address(text, "--udpin"))
    for text in start.udpout:
        yield UdpOut(*parse_address(text, "--udpout"))


def _kept(folder: Path, wipe: bool) -> Path:
    """Return the file that a folder keeps parameters in; the folder is made."""
    path = folder / _KEPT
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if wipe:
            path.unlink(missing_ok=True)
    except OSError as error:
        raise MavherdError(f"--folder: {os_reason(error)}") from None
    return path


def _restored(path: Path, config: VehicleConfig) -> dict[str, float]:
    """Return what was kept the last time."""
    try:
        return files.fit(path, config).values if path.exists() else {}
    except files.ParameterFileError as error:
        raise MavherdError(f"{error} (mend it, or start with --wipe)") from None
