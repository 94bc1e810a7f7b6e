"""The process around one vehicle: sockets, pacing and logs. One thread, one loop.

In lockstep the conductor grants simulated time over a control socket; free-running, the wall
clock does. Either way end-of-file on the control socket is the order to stop.
"""

import math
import select
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from itertools import count

from ..transport.errors import VehicleError
from ..transport.links import Endpoint, Link, patience
from ..transport.mavlink import V2_MARKER, Message
from ..transport.watcher import Watcher
from .attention import Attention
from .config import SLICE_US
from .grants import DONE, GRANT, LIVENESS_S
from .lockstep import advance
from .protocol.conversation import Conversation
from .routing import Router
from .truth import TruthLog
from .vehicle import Vehicle

_LOOK_S = 0.06  # how long a stranger outside may wait for a first answer, in lockstep
_MAX_LAG_S = 0.5  # free-running: skip time rather than race to catch up by more
_FLUSH_US = 250_000  # of vehicle time between two flushes of the truth log
_DATAGRAM = 65535
_MAX_SENT = 60_000  # bytes; UDP carries at most 65,507
_STRIDE = 2  # free-running: slices at once while nobody listens outside; half the wake-ups
_STRIDE_ALONE = 5  # the same without a coordinator
_MAX_CATCH_UP = 8  # slices at once when late, before anybody is heard again
_MAX_PASS_S = 3e-3  # of hearing outside clients before physics is looked after again


@dataclass(slots=True)
class _Client:
    """What the process keeps of one outside link."""

    conversation: Conversation
    attention: Attention


class VehicleProcess:
    """Serves one vehicle's links: the coordinator's own socket and those of outside clients."""

    def __init__(
        self,
        vehicle: Vehicle,
        endpoints: list[Endpoint],
        *,
        coordinator: socket.socket | None = None,
        control: socket.socket | None = None,
        truth: TruthLog | None = None,
    ) -> None:
        self.vehicle = vehicle
        self.late = 0
        self.outside_clients = 0
        self._skipped_s = 0.0  # fleet time that vehicle time has missed while frozen
        self._endpoints = list(endpoints)
        self._coordinator = coordinator
        self._control = control
        self._truth = truth
        self._own = vehicle.converse(channel=None)
        self._outside: dict[Link, _Client] = {}
        self._router: Router[Link] = Router(vehicle.config.system_id)
        self._max_pass_s = _MAX_PASS_S
        self._look_outside()

    @property
    def labels(self) -> str:
        """The names of the ports, for people."""
        return "  ".join(endpoint.label for endpoint in self._endpoints)

    def run_lockstep(self) -> None:
        """Advance as the conductor grants, serving outside clients in between."""
        control, coordinator, vehicle = self._control, self._coordinator, self.vehicle
        if control is None or coordinator is None:
            raise ValueError("lockstep needs a control and a coordinator socket")
        patience(coordinator, LIVENESS_S)
        control.setblocking(True)
        gate = select.poll()
        gate.register(control, select.POLLIN)
        watcher = Watcher(self._endpoints, control)
        look_at = 0.0 if self._endpoints else math.inf
        while (grant := self._next_grant(control, gate, watcher)) is not None:
            until_us, expected = GRANT.unpack(grant)
            if not self.outside_clients and time.monotonic() > look_at:
                self._serve_outside()  # for grants may come without a pause
                look_at = time.monotonic() + _LOOK_S
            heard = [self._promised(coordinator, until_us) for _ in range(expected)]
            others = self._report_outside if self._outside else None
            out = advance(vehicle, self._own, heard, until_us, self._truth, others)
            if self._truth and until_us % _FLUSH_US == 0:
                self._truth.flush()
            datagrams = _datagrams(out)
            done = DONE.pack(vehicle.now_us, len(datagrams), self.outside_clients, self.late)
            try:
                for datagram in datagrams:
                    coordinator.send(datagram)
                control.send(done)
            except ConnectionError:  # they have ended: for us the same as end-of-file
                return
        with suppress(OSError):
            control.send(DONE.pack(vehicle.now_us, 0, self.outside_clients, self.late))

    def _next_grant(
        self, control: socket.socket, gate: select.poll, watcher: Watcher
    ) -> bytes | None:
        """Serve outside clients until a grant comes; return it, None at end-of-file.

        Without any it waits for the grant alone at first, which costs less. A wait in `recv` would
        be woken for nothing each time that the other end reads what we have sent.
        """
        while True:
            if not self.outside_clients and gate.poll(_LOOK_S * 1e3):
                return _receive_exactly(control, GRANT.size)
            ready = watcher.wait(1.0)
            self._pause_floods()
            if not ready:  # paused: those who wait outside must not think we are gone
                self._send_outside_heartbeat()
            elif ready != {control}:
                self._serve_outside()
            if control in ready:
                return _receive_exactly(control, GRANT.size)

    def _promised(self, coordinator: socket.socket, until_us: int) -> bytes:
        """Return the next datagram of the coordinator, which has been sent."""
        try:
            return coordinator.recv(_DATAGRAM)
        except OSError:  # nothing in time, or nobody there any more
            raise VehicleError(
                f"a datagram of the coordinator was lost before {until_us / 1e6:.2f} s"
            ) from None

    def run_free(
        self,
        speed: float = 1.0,
        started: float | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Advance with the wall clock, `speed` times as fast, until told to stop.

        Vehicle time is 0 when `clock` shows `started` (default: now), so that a team can agree.
        """
        pace = SLICE_US * 1e-6 / speed
        self._max_pass_s = min(_MAX_PASS_S, 0.3 * pace)
        others = [s for s in (self._control, self._coordinator) if s]
        if self._coordinator:
            self._coordinator.setblocking(False)
        watcher = Watcher(self._endpoints, *others)
        alone = _STRIDE if self._coordinator else _STRIDE_ALONE
        due, slices = (clock() if started is None else started) + pace, 0
        while True:
            stride = 1 if self.outside_clients else alone
            ready = watcher.wait(max(0.0, due + (stride - 1) * pace - clock()))
            self._pause_floods()
            if self._control in ready:
                break  # nothing but end-of-file comes here
            if self._coordinator in ready:
                self._serve_coordinator()
            if ready.difference(others):
                self._serve_outside()
            for _ in range(_MAX_CATCH_UP):
                if clock() < due:
                    break
                if data := self._step():
                    self._send_to_coordinator(data)
                slices += 1
                if self._truth and self.vehicle.now_us % _FLUSH_US == 0:
                    self._truth.flush()
                lag = clock() - due
                if lag < _MAX_LAG_S:
                    self.late += lag > stride * pace
                    due += pace
                else:
                    self.late += int(lag / pace)
                    self._skipped_s += (lag - pace) * speed
                    due += lag
        if self._control:
            with suppress(OSError):
                self._control.sendall(
                    DONE.pack(self.vehicle.now_us, slices, self.outside_clients, self.late)
                )

    def close(self) -> None:
        """Finish the logs and close every socket."""
        if self._truth:
            self._truth.close()
        for endpoint in self._endpoints:
            endpoint.close()

    def _step(self) -> bytes:
        """Advance one slice, report to outside clients, return what the coordinator gets."""
        vehicle = self.vehicle
        vehicle.step()
        if self._truth:
            self._truth.write(vehicle.now_us * 1e-6 + self._skipped_s, vehicle.robot)
        broadcasts = vehicle.take_broadcasts()
        self._report_outside(broadcasts)
        return vehicle.report(self._own, broadcasts) if self._coordinator else b""

    def _report_outside(self, broadcasts: list[Message]) -> None:
        for link, client in self._outside.items():
            if data := self.vehicle.report(client.conversation, broadcasts):
                link.send(data)

    def _serve_coordinator(self) -> None:
        if self._coordinator is None:
            return
        for _ in range(64):
            try:
                data = self._coordinator.recv(_DATAGRAM)
            except BlockingIOError:
                return
            except OSError:  # "port unreachable": the coordinator is gone; time-outs handle it
                continue
            self._send_to_coordinator(self.vehicle.handle(data, self._own))

    def _send_to_coordinator(self, data: bytes) -> None:
        if data and self._coordinator:
            with suppress(OSError):
                self._coordinator.send(data)

    def _serve_outside(self) -> None:
        """Hear every outside link, but none of them for longer than is good for the others."""
        began = time.monotonic()
        self._endpoints.append(self._endpoints.pop(0))  # each is the first to be heard in turn
        for endpoint in self._endpoints:
            for link, data in endpoint.receive():
                self._hear(link, data)
                if time.monotonic() - began > self._max_pass_s:
                    self._look_outside()
                    return
        self._look_outside()

    def _pause_floods(self) -> None:
        now = time.monotonic()
        for link, client in self._outside.items():
            link.paused = client.attention.is_exhausted(now)

    def _hear(self, link: Link, data: bytes) -> None:
        began = time.thread_time()  # time in which others had the processor is not its fault
        client = self._client(link)
        conversation = client.conversation
        was_silent = not conversation.spoken
        replies: list[Message] = []
        for message, frame in conversation.codec.decode_frames(data, stream=link.stream):
            if self._forward(message, frame, link):
                replies += self.vehicle.hear(message, conversation)
        if replies:
            link.send(conversation.codec.encode(replies))
        if was_silent and conversation.spoken:  # garbage is nobody
            self.outside_clients += 1
            link.spoken = True
        client.attention.spend(time.thread_time() - began)

    def _forward(self, message: Message, frame: bytes, link: Link) -> bool:
        """Pass a frame on to the links it concerns; return whether it may concern the vehicle."""
        route = self._router.route(message, frame, link, self.vehicle.now_us * 1e-6)
        for other in route.links:
            is_readable = (
                frame[0] != V2_MARKER or self._client(other).conversation.codec.version > 1
            )
            if is_readable and not other.congested:
                other.send(frame)
        return route.stays

    def _look_outside(self) -> None:
        """Keep a conversation for each link that is open now, and only for those."""
        self._outside = {
            link: self._client(link) for end in self._endpoints for link in end.links()
        }
        self._router.keep(self._outside)

    def _client(self, link: Link) -> _Client:
        client = self._outside.get(link)
        if client is None:
            taken = {other.conversation.channel for other in self._outside.values()}
            channel = next(n for n in count() if n not in taken)
            conversation = self.vehicle.converse(channel=channel)
            client = _Client(conversation, Attention(time.monotonic()))
            self._outside[link] = client
            # At once and in MAVLink 2, from which clients that can speak both take the hint.
            link.send(client.conversation.codec.encode([self.vehicle.autopilot.heartbeat()]))
        return client

    def _send_outside_heartbeat(self) -> None:
        for link, client in self._outside.items():
            link.send(client.conversation.codec.encode([self.vehicle.autopilot.heartbeat()]))


def _datagrams(parts: list[bytes]) -> list[bytes]:
    """Return `parts` joined to as few datagrams as fit; no part is torn."""
    out: list[bytes] = []
    for part in filter(None, parts):
        if out and len(out[-1]) + len(part) <= _MAX_SENT:
            out[-1] += part
        else:
            out.append(part)
    return out


def _receive_exactly(sock: socket.socket, size: int) -> bytes | None:
    """Return `size` bytes, None at end-of-file."""
    data = b""
    while len(data) < size:
        try:
            part = sock.recv(size - len(data))
        except ConnectionError:
            return None
        if not part:
            return None
        data += part
    return data
