"""The fleet clock: grants simulated time in lockstep, or lets everybody run with the wall clock."""

import select
import socket
import time
from base64 import b64decode
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Protocol

from ...transport.channel import ChannelClosed
from ...transport.errors import VehicleError
from ...vehicles.grants import LIVENESS_S
from ..team.barrier import SLICE_S, Died, VehicleHandle
from .interrupted import Interrupted

__all__ = [
    "Clock",
    "CoordinatorHandle",
    "Died",
    "FreeRun",
    "Interrupted",
    "Lockstep",
    "Partner",
    "VehicleHandle",
]

BATCH_S = 0.02  # of wall time that a coordinator goes on by itself: a user notices no more


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
    external: tuple[str, ...] = ()  # its external vehicles
    prepared: bool = True  # and those may be steered now
    finished: bool = False
    heard_at: float = 0.0  # on the monotonic clock
    late: int = 0
    ticks: int = 0
    ready: bool = False  # it has come up
    parted: bool = False  # it has said its last word: external vehicles were seen to

    def part(self, last: dict[str, Any]) -> None:
        """Take in its last word."""
        self.parted, self.late, self.ticks = True, last["late"], last["ticks"]


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
        """Take in what a coordinator says; raise VehicleError when it gives up.

        Who gives up tells how far it came: ticks of which no answer tells any more.
        """
        for event in message.get("events", ()):
            self.on_event(event)
        self.now, self.ticks = message.get("done", (self.now, self.ticks))
        if died := message.get("died"):
            raise Died(*died)
        if error := message.get("error"):
            raise VehicleError(error)
        if last := message.get("parted"):  # though nobody has told it to
            coordinator.part(last)
            raise Died(coordinator.name, None, self.now)
        coordinator.finished = message.get("finished", coordinator.finished)
        coordinator.prepared = message.get("prepared", coordinator.prepared)
        coordinator.late = message.get("late", coordinator.late)
        coordinator.ticks = message.get("ticks", coordinator.ticks)


@dataclass(slots=True)
class Lockstep(Clock):
    """One tick is one coordination period: vehicles first, then their coordinators.

    A coordinator conducts its own vehicles; we grant time to all coordinators. One that is alone
    may get several ticks at once; several advance tick by tick, each by the states of the others.
    """

    outside: int = 0  # clients at the vehicles' own ports, when we last looked

    def tick(self, period_us: int) -> None:
        """Advance everybody by one period."""
        self.advance(period_us)

    def advance(self, period_us: int, most: int = 1, wall_s: float = BATCH_S) -> int:
        """Advance everybody by up to `most` periods; return by how many.

        Fewer it is when the team is done, when there are several coordinators, or when `wall_s`
        seconds of wall time are over.
        """
        until_us = round(self.now * 1e6) + period_us
        grant = {
            "until_us": until_us,
            "period_us": period_us,
            "ticks": most if len(self.coordinators) == 1 else 1,
            "wall_s": wall_s,
        }
        for coordinator in self.coordinators:
            try:
                coordinator.channel.send(grant)
            except ChannelClosed:
                self._hear_last_words(coordinator)
        early: dict[str, dict[str, Any]] = {}
        ticks = 0
        for coordinator in self.coordinators:
            answer = self._answer(coordinator, early)
            self.take(coordinator, answer)
            ticks = answer["ticks"]
        self.now = (until_us + (ticks - 1) * period_us) * 1e-6
        self.ticks += ticks
        return ticks

    def look(self) -> list[bytes]:
        """Ask each coordinator for the states of the last tick; return `team` messages."""
        for coordinator in self.coordinators:
            try:
                coordinator.channel.send({"look": True})
            except ChannelClosed:
                self._hear_last_words(coordinator)
        early: dict[str, dict[str, Any]] = {}
        team, outside = [], 0
        for coordinator in self.coordinators:
            answer = self._answer(coordinator, early)
            self.take(coordinator, answer)
            team.append(b64decode(answer["team"]))
            outside += answer.get("outside", 0)
        self.outside = outside
        return team

    def _answer(
        self, coordinator: CoordinatorHandle, early: dict[str, dict[str, Any]]
    ) -> dict[str, Any]:
        """Return an answer; those of others that come meanwhile go into `early`."""
        deadline = time.monotonic() + 2 * LIVENESS_S  # it waits for others itself
        while True:
            if (answer := early.pop(coordinator.name, None)) is not None:
                return answer
            try:
                answer = coordinator.channel.receive(SLICE_S)
            except ChannelClosed:
                raise Died(coordinator.name, None, self.now) from None
            if answer is not None and answer.keys() != {"events"}:
                return answer
            if answer is not None:  # of who is waited for
                self.take(coordinator, answer)
            for other in self.coordinators:  # it may be waiting for one that has given up
                self._look_at(other, early)
            if self.interrupted():
                raise Interrupted
            if time.monotonic() > deadline:
                raise VehicleError(
                    f"{coordinator.name} is frozen: no answer to the tick after {self.now:.2f} s "
                    f"for {2 * LIVENESS_S:.0f} s"
                )

    def _look_at(self, other: CoordinatorHandle, early: dict[str, dict[str, Any]]) -> None:
        try:
            answer = other.channel.receive(0.0)
        except ChannelClosed:
            raise Died(other.name, None, self.now) from None
        if answer is None:
            return
        if "ticks" in answer or "team" in answer:
            early[other.name] = answer
        else:
            self.take(other, answer)  # which raises what has gone wrong there

    def _hear_last_words(self, coordinator: CoordinatorHandle) -> None:
        """Raise what a coordinator that has ended by itself said last, or that it died."""
        with suppress(ChannelClosed):
            if (last := coordinator.channel.receive(0.0)) is not None:
                self.take(coordinator, last)
        raise Died(coordinator.name, None, self.now)


class FreeRun(Clock):
    """Everybody paces itself; we listen for events and for processes that die."""

    def listen(self, started: float, timeout: float) -> None:
        """Take in what comes within `timeout` seconds; fleet time counts from `started`."""
        talking = {c.channel.socket.fileno(): c for c in self.coordinators}
        dying = {v.control.fileno(): v for v in self.vehicles}
        poll = select.poll()  # select() knows 1024 files only
        for fd in (*talking, *dying):
            poll.register(fd, select.POLLIN)
        ready = poll.poll(timeout * 1000)
        self.now = time.monotonic() - started
        if self.interrupted():
            raise Interrupted
        for fd, _ in ready:
            if fd in dying:
                raise Died(dying[fd].name, dying[fd].pid, self.now)
            coordinator = talking[fd]
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
