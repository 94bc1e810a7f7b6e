"""The barrier of lockstep: one coordinator's vehicles get time, and all of them are waited for.

A grant says how many datagrams were sent to its receiver in the tick before, and each answer how
many the vehicle has sent, so that nothing is in flight across a tick.
"""

import select
import socket
import time
from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ...transport.errors import VehicleError
from ...vehicles.grants import DONE, GRANT, LIVENESS_S

if TYPE_CHECKING:
    from .ground import Ground

SLICE_S = 0.2  # how often a wait looks whether it still makes sense
STALL_S = 2.0  # of waiting, and it is told for whom


class Died(VehicleError):  # noqa: N818 - reads as what it is
    """A process that has ended; the launcher adds how."""

    def __init__(self, name: str, pid: int | None, now: float) -> None:
        self.name, self.pid, self.now = name, pid, now
        super().__init__(f"{name} died at {now:.2f} s")


@dataclass(slots=True)
class VehicleHandle:
    """Our end of one vehicle process."""

    name: str
    pid: int
    control: socket.socket
    outside_clients: int = 0
    ticks: int = 0  # free-running: slices of its own
    late: int = 0


class Barrier:
    """Grants time to some vehicles. `check` is called during every wait; it raises to end it.

    `stalled` is told, once in a wait that takes long, the vehicle that is waited for and since
    what fleet time.
    """

    def __init__(
        self,
        vehicles: Sequence[VehicleHandle],
        check: Callable[[], None],
        stalled: Callable[[str, float], None] = lambda name, since: None,
    ) -> None:
        self._vehicles = vehicles
        self._check = check
        self._stalled = stalled
        self._now_us = 0
        self.done = (0.0, 0)  # s of fleet time, and ticks, with what the coordinator has to do
        self.incoming = [0] * len(vehicles)  # datagrams that wait for each
        self._gates = [select.poll() for _ in vehicles]
        for vehicle, gate in zip(vehicles, self._gates, strict=True):
            gate.register(vehicle.control, select.POLLIN)

    @property
    def outside_clients(self) -> int:
        """Return how many clients have come to the vehicles' own ports."""
        return sum(vehicle.outside_clients for vehicle in self._vehicles)

    def advance(self, until_us: int) -> list[int]:
        """Have every vehicle live until then; return the number of datagrams that each has sent."""
        grants = {n: GRANT.pack(until_us, n) for n in set(self.incoming)}
        for vehicle, incoming in zip(self._vehicles, self.incoming, strict=True):
            try:
                vehicle.control.send(grants[incoming])
            except OSError:
                raise self._died(vehicle) from None
        # The last to begin ends last: in this order we wake up once.
        sent = [*map(self._sent, reversed(self._vehicles), reversed(self._gates))]
        sent.reverse()
        self._now_us = until_us
        return sent

    def _sent(self, vehicle: VehicleHandle, gate: select.poll) -> int:
        data, begun, told = b"", 0.0, False
        while len(data) < DONE.size:
            try:
                part = vehicle.control.recv(DONE.size - len(data), socket.MSG_DONTWAIT)
            except BlockingIOError:
                # A wait in `recv` would be woken for nothing when the vehicle reads its grant.
                if gate.poll(SLICE_S * 1e3):
                    continue
                self._check()
                begun = begun or time.monotonic()
                waited = time.monotonic() - begun
                if waited > STALL_S and not told:
                    told = True
                    self._stalled(vehicle.name, self._now_us * 1e-6)
                if waited > LIVENESS_S:
                    raise VehicleError(
                        f"{vehicle.name} (pid {vehicle.pid}) is frozen: no answer to the tick "
                        f"after {self._now_us * 1e-6:.2f} s for {LIVENESS_S:.0f} s"
                    ) from None
                continue
            except OSError:
                part = b""
            if not part:
                raise self._died(vehicle)
            data += part
        sent: int
        _, sent, vehicle.outside_clients, _ = DONE.unpack(data)
        return sent

    def _died(self, vehicle: VehicleHandle) -> Died:
        return Died(vehicle.name, vehicle.pid, self._now_us * 1e-6)


def serve(grant: Mapping[str, Any], barrier: Barrier, ground: "Ground") -> dict[str, Any]:
    """Do the ticks that the conductor grants, vehicles first; return the answer it waits for.

    It is fewer ticks than were granted when the team is done, or `wall_s` seconds are over. A
    `look` grants none: it asks for the states of the last tick. Whatever breaks a tick off,
    `barrier.done` tells of the ticks before.
    """
    if "look" in grant:
        team = b64encode(ground.exchange.known()).decode()
        return {"team": team, "outside": barrier.outside_clients}
    until_us, period_us, most = grant["until_us"], grant["period_us"], grant["ticks"]
    core = ground.core
    answer_at = time.monotonic() + grant["wall_s"]
    ticks = 0
    while True:
        now = until_us * 1e-6
        ground.receive_counted(barrier.advance(until_us), now)
        barrier.incoming = list(ground.exchange_and_tick(now).values())
        ticks += 1
        barrier.done = now, barrier.done[1] + 1
        finished = core.finished
        if finished or ticks >= most or time.monotonic() > answer_at:
            return {"ticks": ticks, "events": core.take_events(), "finished": finished}
        until_us += period_us
