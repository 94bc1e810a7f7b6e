"""One vehicle by hand (`mavherd vehicle`): its start, and what it needs at real time."""

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from alone import starting
from machine import Memory, cpu_seconds, memory

from mavherd.transport.links import UdpIn
from mavherd.transport.mavlink import Codec, mav
from mavherd.transport.watcher import Watcher

SETTLING_S = 3.0  # from the start of a vehicle until its CPU time is looked at
SILENCE_S = 10.0
HEARTBEAT = mav.MAVLink_heartbeat_message(
    mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, mav.MAV_STATE_ACTIVE, 3
)


@contextmanager
def vehicle(kind: str, ports: list[UdpIn]) -> Iterator[subprocess.Popen[bytes]]:
    """Run a vehicle that sends to some ports; stop both."""
    targets = [text for p in ports for text in ("--udpout", f"127.0.0.1:{p.port}")]
    process = subprocess.Popen(
        [sys.executable, "-m", "mavherd", "vehicle", kind, "--tcp", "0", *targets],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    try:
        yield process
    finally:
        process.terminate()
        process.communicate()
        for port in ports:
            port.close()


def start(kind: str) -> float:
    """Return seconds from starting a vehicle process to its first HEARTBEAT."""
    port = UdpIn("127.0.0.1", 0)
    watcher, codec = Watcher([port]), Codec(255, 190)
    begun = time.perf_counter()
    with vehicle(kind, [port]) as process:
        while True:
            watcher.wait(1.0)
            for _, data in port.receive():
                if any(m.get_type() == "HEARTBEAT" for m in codec.decode(data)):
                    return time.perf_counter() - begun
            _see_that_it_lives(process, begun, 0.0)


def serving(kind: str, clients: int, seconds: float = 10.0) -> tuple[float, float, Memory]:
    """Return the CPU share of a vehicle at real time, messages/s to each client, and its memory.

    Each client is a ground station on a UDP socket of its own that sends heartbeats and gets
    every stream that flows unasked, as QGroundControl or MAVSDK do; the first has the vehicle
    armed, and a quadcopter hover. With none the vehicle stands, and one socket gets the
    heartbeats that nobody answers.
    """
    ports = [UdpIn("127.0.0.1", 0) for _ in range(max(clients, 1))]
    codecs = [Codec(255 - number, 190) for number in range(len(ports))]
    begun = heard = time.perf_counter()
    began = used = beat_at = 0.0
    messages, armed = 0, False
    watcher = Watcher(list(ports))
    with vehicle(kind, ports) as process:
        while True:
            watcher.wait(0.1)
            now = time.perf_counter()
            beat, beat_at = now >= beat_at, beat_at if now < beat_at else now + 1
            for codec, port in zip(codecs, ports, strict=True):
                for _, data in port.receive():
                    heard = now
                    for m in codec.decode(data, stream=False):
                        messages += 1
                        if m.get_type() == "HEARTBEAT":
                            armed = bool(m.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)
                if beat and clients:
                    first = port is ports[0] and not began
                    for link in port.links():
                        link.send(codec.encode([HEARTBEAT, *(starting(kind) if first else ())]))
            _see_that_it_lives(process, begun, heard)
            if not began and now - begun > SETTLING_S:  # start-up is another row
                if armed != bool(clients):
                    raise RuntimeError("the vehicle is not armed as it should be")
                began, used, messages = now, sum(cpu_seconds(process.pid).values()), 0
            elif began and now - began > seconds:
                share = (sum(cpu_seconds(process.pid).values()) - used) / (now - began)
                return share, messages / (now - began) / len(ports), memory(process.pid)


def _see_that_it_lives(process: subprocess.Popen[bytes], begun: float, heard: float) -> None:
    """Raise RuntimeError when a vehicle has ended or was silent for too long."""
    if (code := process.poll()) is not None:
        said = process.stderr.read().decode() if process.stderr else ""
        raise RuntimeError(f"the vehicle ended with exit code {code}: {said}")
    if time.perf_counter() - max(begun, heard) > SILENCE_S:
        raise RuntimeError(f"nothing was heard of the vehicle for {SILENCE_S:g} s")
