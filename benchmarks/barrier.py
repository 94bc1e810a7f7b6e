"""What it costs to let N processes go on and to wait for all, with nothing for them to do.

The floors are what any lockstep pays on this machine: a grant and an answer on a socket pair, and
one datagram there and back. All in microseconds of wall time.
"""

import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager

from mavherd.gcs.team.barrier import Barrier, VehicleHandle
from mavherd.vehicles.grants import DONE, GRANT

DATAGRAM = bytes(100)


def empty_barrier(processes: int, barriers: int = 500) -> float:
    """Return the time of one barrier over so many processes that answer at once."""
    with _echoing(processes) as ends:
        begun = time.perf_counter()
        for tick in range(barriers):
            grant = GRANT.pack(tick, 0)
            for end in ends:
                end.send(grant)
            for end in reversed(ends):
                end.recv(DONE.size)
        return (time.perf_counter() - begun) / barriers * 1e6


def our_barrier(processes: int, barriers: int = 500) -> float:
    """Return the time of the same, as a run does it."""
    with _echoing(processes) as ends:
        handles = [VehicleHandle(f"v{n}", 0, end) for n, end in enumerate(ends)]
        barrier = Barrier(handles, lambda: None)
        begun = time.perf_counter()
        for tick in range(barriers):
            barrier.advance(tick)
        return (time.perf_counter() - begun) / barriers * 1e6


def bare_socket(round_trips: int = 5000) -> float:
    """Return the time of one datagram to another process and back, over UDP on loopback."""
    here = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    there = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    for end in (here, there):
        end.bind(("127.0.0.1", 0))
    here.connect(there.getsockname())
    there.connect(here.getsockname())
    here.settimeout(10)
    pid = os.fork()
    if not pid:
        while data := there.recv(2000):
            there.send(data)
        os._exit(0)
    there.close()
    begun = time.perf_counter()
    for _ in range(round_trips):
        here.send(DATAGRAM)
        here.recv(2000)
    spent = time.perf_counter() - begun
    here.send(b"")
    os.waitpid(pid, 0)
    here.close()
    return spent / round_trips * 1e6


@contextmanager
def _echoing(processes: int) -> Iterator[list[socket.socket]]:
    """Fork so many processes that answer every grant at once; yield the ends to grant on."""
    ends: list[socket.socket] = []
    pids = []
    for _ in range(processes):
        ours, theirs = socket.socketpair()
        pid = os.fork()
        if not pid:
            for end in (*ends, ours):
                end.close()
            while theirs.recv(GRANT.size):
                theirs.send(DONE.pack(0, 0, 0, 0))
            os._exit(0)
        theirs.close()
        ours.settimeout(10)
        ends.append(ours)
        pids.append(pid)
    try:
        yield ends
    finally:
        for end in ends:
            end.close()
        for pid in pids:
            os.waitpid(pid, 0)
