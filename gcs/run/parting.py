"""Parting from those who are told to end: they are heard out; external vehicles come first."""

import socket
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from ...transport.channel import ChannelClosed
from ...transport.links import patience
from ...vehicles.grants import DONE, LIVENESS_S
from .children import Child
from .conductor import CoordinatorHandle, VehicleHandle

END_S = 1.0  # for everybody to end, in a hurry
_SLICE_S = 0.1  # how often a wait looks whether the user insists

Note = Callable[[dict[str, Any]], None]
"""Takes an event."""


def half_close(sock: socket.socket) -> None:
    """Let the other end see end-of-file, the order to end."""
    with suppress(OSError):  # it may be gone already
        sock.shutdown(socket.SHUT_WR)


def came_up(coordinator: CoordinatorHandle) -> bool:
    """Return whether a coordinator has come up, though nobody may have read its word of it."""
    with suppress(ChannelClosed):
        if not coordinator.ready and (first := coordinator.channel.receive(0.0)) is not None:
            coordinator.ready = "ready" in first
    return coordinator.ready


def hear_out(vehicle: VehicleHandle, deadline: float) -> None:
    """Take in the last word of a vehicle process, which ends with it."""
    patience(vehicle.control, left(deadline))
    with suppress(OSError):
        while len(data := vehicle.control.recv(4096)) >= DONE.size:
            last = DONE.unpack(data[-DONE.size :])
            _, vehicle.ticks, vehicle.outside_clients, vehicle.late = last


def part(
    coordinator: CoordinatorHandle,
    child: Child,
    deadline: float,
    note: Note,
    insists: Callable[[], bool],
) -> float:
    """Hear a coordinator out and close its channel; return until when its process may take.

    Bringing external vehicles to rest is waited for beyond the `deadline` (on the monotonic
    clock), as long as it goes on and the user does not insist.
    """
    if coordinator.external:
        _see_to_rest(coordinator, child, note, insists)
        deadline = max(deadline, time.monotonic() + END_S)
    with suppress(ChannelClosed):
        while (last := coordinator.channel.receive(left(deadline))) is not None:
            _take(coordinator, last, note)
    coordinator.channel.close()
    return deadline


def left(deadline: float) -> float:
    """Return the time to a deadline, and a little after it."""
    return max(0.01, deadline - time.monotonic())


def _see_to_rest(
    coordinator: CoordinatorHandle, child: Child, note: Note, insists: Callable[[], bool]
) -> None:
    """Listen to a coordinator that brings vehicles to rest, until it has, or must not."""
    silent_until = time.monotonic() + LIVENESS_S
    with suppress(ChannelClosed):
        while time.monotonic() < silent_until:
            if (last := coordinator.channel.receive(_SLICE_S)) is not None:
                silent_until = time.monotonic() + LIVENESS_S
                _take(coordinator, last, note)
            if insists():
                child.terminate()
                return


def _take(coordinator: CoordinatorHandle, last: dict[str, Any], note: Note) -> None:
    for event in last.get("events", ()):
        note(event)
    if facts := last.get("parted"):
        coordinator.part(facts)
