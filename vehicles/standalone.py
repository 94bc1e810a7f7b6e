"""One vehicle by hand: its own process, its own ports, the wall clock, until it is stopped."""

import signal
import socket
import sys
import time
from collections.abc import Sequence
from dataclasses import replace

from ..transport.errors import LinkError
from ..transport.links import Endpoint, TcpServer, UdpIn, UdpOut, parse_address
from .config import VehicleConfig
from .process import VehicleProcess
from .vehicle import Vehicle


def serve(
    config: VehicleConfig,
    *,
    tcp: socket.socket | None,
    udpin: Sequence[str],
    udpout: Sequence[str],
    speed: float = 1.0,
) -> int:
    """Serve MAVLink on these addresses until Ctrl-C or SIGTERM; return the exit code.

    Raises ValueError for parameters that cannot be, LinkError for ports that cannot be had.
    """
    if not 0.01 <= speed <= 100:
        raise ValueError(f"--speed {speed:g}: expected a factor of 0.01..100")
    if not (tcp or udpin or udpout):
        raise LinkError("the vehicle has no port at all: give --tcp, --udpin or --udpout")
    vehicle = Vehicle(replace(config, epoch_us=round(time.time() * 1e6)))
    endpoints: list[Endpoint] = []
    endpoints += [TcpServer(tcp)] if tcp else []
    endpoints += [UdpIn(*parse_address(text, "--udpin")) for text in udpin]
    endpoints += [UdpOut(*parse_address(text, "--udpout")) for text in udpout]
    process = VehicleProcess(vehicle, endpoints)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    labels = "  ".join(endpoint.label for endpoint in endpoints)
    print(f"{config.name}: {config.kind}, system id {config.system_id}: {labels}", flush=True)
    print("Ctrl-C stops it.", file=sys.stderr, flush=True)
    try:
        process.run_free(speed)
    except KeyboardInterrupt:
        process.close()
    return 0
