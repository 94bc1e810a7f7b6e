"""The fleet clock: grants simulated time in lockstep, or lets everybody run with the wall clock."""

import select
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from ...transport.channel import ChannelClosed
from ...transport.errors import VehicleError
from ...transport.links import patience
from ...vehicles.process import DONE, GRANT, LIVENESS_S

_SLICE_S = 0.2  # how often a wait looks whether the user has pressed Ctrl-C
_MAX_LAG_S = 0.5


class Interrupted(Exception):  # noqa: N818 - an order, not an error
    """The user wants the run to end now."""


@dataclass(slots=True)
class VehicleHandle:
    """The conductor's end of one vehicle process."""

    name: str
    pid: int
    control: socket.socket
    incoming: int = 0  # datagrams that wait for the vehicle
    outside_clients: int = 0
    ticks: int = 0  # free-running: slices of its own
    late: int = 0


class Partner(Protocol):
    """The conductor's end of its conversation with a coordinator.

    A process's is a `Channel`. A script's is in our own process: it does the whole tick in `send`,
    so it comes last in the list of coordinators, when all others have their grants.
    """

    @property
    def socket(self) -> socket.socket:
        """What to wait on."""
        ...

    @property
    def ended(self) -> bool:
        """Whether nobody is there any more and nothing is left to read."""
        ...

    def send(self, message: dict[str, Any]) -> None:
        """Send one object; raise ChannelClosed when nobody is there any more."""
        ...

    def receive(self, timeout: float | None = None) -> dict[str, Any] | None:
        """Return the next object, None after `timeout` seconds without one."""
        ...

    def close(self) -> None:
        """End the conversation."""
        ...


@dataclass(slots=True)
class CoordinatorHandle:
    """The conductor's end of one coordinator."""

    name: str
    channel: Partner
    vehicles: list[VehicleHandle]
    external: tuple[str, ...] = ()  # its external vehicles
    prepared: bool = True  # and those may be steered now
    finished: bool = False
    heard_at: float = 0.0  # on the monotonic clock
    late: int = 0
    ticks: int = 0
    parted: bool = False  # it has said its last word: external vehicles were seen to


@dataclass(slots=True)
class Clock:
    """What both kinds of conductor keep. `interrupted` is asked during every wait."""

    vehicles: list[VehicleHandle]
    coordinators: list[CoordinatorHandle]
    interrupted: Callable[[], bool]
    on_event: Callable[[dict[str, Any]], None]
    now: float = 0.0  # s of fleet time
    ticks: int = 0
    late: int = 0
    prepared_at: float | None = None  # s, when all external vehicles were ready; 0 without any

    @property
    def finished(self) -> bool:
        """Whether every coordinator's mission is over."""
        return all(c.finished for c in self.coordinators)

    def expired(self, duration: float) -> bool:
        """Return whether the run has gone on for `duration` seconds since all were prepared."""
        if self.prepared_at is None and all(c.prepared for c in self.coordinators):
            self.prepared_at = self.now
        return self.prepared_at is not None and self.now >= self.prepared_at + duration - 1e-9

    def take(self, coordinator: CoordinatorHandle, message: dict[str, Any]) -> None:
        """Take in what a coordinator says; raise VehicleError when it gives up."""
        for event in message.get("events", ()):
            self.on_event(event)
        if error := message.get("error"):
            raise VehicleError(error)
        coordinator.finished = message.get("finished", coordinator.finished)
        coordinator.prepared = message.get("prepared", coordinator.prepared)
        coordinator.late = message.get("late", coordinator.late)
        coordinator.ticks = message.get("ticks", coordinator.ticks)


class Died(VehicleError):  # noqa: N818 - reads as what it is
    """A process that has ended; the launcher adds how."""

    def __init__(self, name: str, pid: int | None, now: float) -> None:
        self.name, self.pid, self.now = name, pid, now
        super().__init__(f"{name} died at {now:.2f} s")


@dataclass(slots=True)
class Lockstep(Clock):
    """One tick is one coordination period: vehicles first, then coordinators.

    Each grant says how many datagrams were sent to its receiver in the phase before, so that
    nothing is in flight across a tick.
    """

    def tick(self, period_us: int) -> None:
        """Advance everybody by one period."""
        until_us = round(self.now * 1e6) + period_us
        for vehicle in self.vehicles:
            try:
                vehicle.control.sendall(GRANT.pack(until_us, vehicle.incoming))
            except OSError:
                raise Died(vehicle.name, vehicle.pid, self.now) from None
        sent = {}
        for vehicle in reversed(self.vehicles):  # the last to begin ends last: wake up once
            _, sent[vehicle.name], outside, _ = DONE.unpack(self._done(vehicle))
            vehicle.outside_clients = outside
        for coordinator in self.coordinators:
            expect = [sent[v.name] for v in coordinator.vehicles]
            try:
                coordinator.channel.send({"until_us": until_us, "expect": expect})
            except ChannelClosed:
                raise Died(coordinator.name, None, self.now) from None
        for coordinator in self.coordinators:
            answer = self._answer(coordinator)
            self.take(coordinator, answer)
            for vehicle, count in zip(coordinator.vehicles, answer["sent"], strict=True):
                vehicle.incoming = count
        self.now = until_us * 1e-6
        self.ticks += 1

    def __post_init__(self) -> None:
        for vehicle in self.vehicles:
            patience(vehicle.control, _SLICE_S)

    def _done(self, vehicle: VehicleHandle) -> bytes:
        data, deadline = b"", 0.0
        while len(data) < DONE.size:
            try:
                part = vehicle.control.recv(DONE.size - len(data))
            except BlockingIOError:
                deadline = deadline or time.monotonic() + LIVENESS_S
                self._check(deadline, vehicle.name, vehicle.pid)
                continue
            except OSError:
                part = b""
            if not part:
                raise Died(vehicle.name, vehicle.pid, self.now)
            data += part
        return data

    def _answer(self, coordinator: CoordinatorHandle) -> dict[str, Any]:
        deadline = time.monotonic() + 2 * LIVENESS_S  # it waits for others itself
        while True:
            try:
                answer = coordinator.channel.receive(_SLICE_S)
            except ChannelClosed:
                raise Died(coordinator.name, None, self.now) from None
            if answer is not None:
                return answer
            for other in self.coordinators:  # this one may be waiting for a state of theirs
                if other.channel.ended:
                    raise Died(other.name, None, self.now)
            self._check(deadline, coordinator.name, None)

    def _check(self, deadline: float, name: str, pid: int | None) -> None:
        if self.interrupted():
            raise Interrupted
        if time.monotonic() > deadline:
            process = f"{name} (pid {pid})" if pid else name
            raise VehicleError(
                f"{process} is frozen: no answer to the tick after {self.now:.2f} s for "
                f"{LIVENESS_S:.0f} s"
            )


class Pacer:
    """Holds lockstep back to `speed` times real time and counts the ticks that came too late."""

    def __init__(self, speed: float, period: float) -> None:
        self._pace = period / speed
        self._due = time.monotonic()
        self.late = 0

    def wait(self) -> None:
        """Sleep until the next tick is due; a tick is late when its successor already was."""
        self._due += self._pace
        lag = time.monotonic() - self._due
        if lag > max(self._pace, _MAX_LAG_S):  # skip rather than race to catch up
            self.late += int(lag / self._pace)
            self._due += lag
        elif lag > self._pace:
            self.late += 1
        elif lag < 0:
            time.sleep(-lag)


class FreeRun(Clock):
    """Everybody paces itself; we listen for events and for processes that die."""

    def listen(self, started: float, timeout: float) -> None:
        """Take in what comes within `timeout` seconds; fleet time counts from `started`."""
        by_socket = {c.channel.socket: c for c in self.coordinators}
        dying = {v.control: v for v in self.vehicles}
        ready, _, _ = select.select([*by_socket, *dying], [], [], timeout)
        self.now = time.monotonic() - started
        if self.interrupted():
            raise Interrupted
        for sock in ready:
            if sock in dying:
                raise Died(dying[sock].name, dying[sock].pid, self.now)
            coordinator = by_socket[sock]
            try:
                message = coordinator.channel.receive(LIVENESS_S)
            except ChannelClosed:
                raise Died(coordinator.name, None, self.now) from None
            coordinator.heard_at = time.monotonic()
            self.take(coordinator, message or {})
        for coordinator in self.coordinators:
            coordinator.heard_at = coordinator.heard_at or time.monotonic()
            if time.monotonic() - coordinator.heard_at > LIVENESS_S:
                raise VehicleError(
                    f"{coordinator.name} is frozen: not a word for {LIVENESS_S:.0f} s"
                )
