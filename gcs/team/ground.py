"""The ground around one coordinator: its vehicles' sockets, its logs, its part of the bus.

A coordinator process owns one, and so does a script: whoever owns it calls it once a tick.
"""

import socket
import time
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from ...scenarios.schema import Scenario
from ...transport.bus import Bus
from ...transport.connect import parse_connect
from ...transport.errors import VehicleError
from ...transport.links import patience
from ...transport.switchboard import Switchboard
from ...vehicles.config import SIMULATED_EPOCH_US
from ...vehicles.grants import LIVENESS_S
from .coordinator import MakeConduct
from .mission import Mission
from .seat import Seat
from .telemetry_track import TelemetryTrack

_DATAGRAM = 65535


class Ground:
    """Drives a `Coordinator` with real sockets and a real bus. `now` is fleet time.

    `own` holds our end of every own vehicle's socket, None for an external one, whose line is
    opened here (LinkError when it cannot be). Free-running, fleet time is 0 at `started` on the
    monotonic clock.
    """

    def __init__(
        self,
        scenario: Scenario,
        own: Mapping[str, socket.socket | None],
        *,
        folder: Path,
        bus: Bus,
        lockstep: bool,
        started: float = 0.0,
        conduct: MakeConduct = Mission,
        strict: bool = True,
        lines: Switchboard | None = None,
    ) -> None:
        self._sockets = {name: sock for name, sock in own.items() if sock is not None}
        abroad = [spec for spec in scenario.robots if spec.name in own and spec.connect]
        self._lines = lines or Switchboard(
            {s.name: (parse_connect(s.connect), s.system_id) for s in abroad if s.connect}
        )
        self._tracks = {s.name: TelemetryTrack(folder / "vehicles" / s.name, s) for s in abroad}
        self._seat = Seat(
            scenario,
            tuple(own),
            bus,
            lockstep=lockstep,
            folder=folder,
            epoch_us=SIMULATED_EPOCH_US if lockstep else round(time.time() * 1e6),
            conduct=conduct,
            strict=strict,
        )
        self.core = self._seat.core
        self.exchange = self._seat.exchange
        self._bus = bus
        for sock in self._sockets.values():
            if lockstep:
                patience(sock, LIVENESS_S)
            else:
                sock.setblocking(False)

    def sockets(self) -> list[socket.socket]:
        """Return what to wait for between two ticks, at this moment: lines come and go."""
        return [*self._sockets.values(), *self._lines.sockets()]

    def receive_counted(self, expect: Iterable[int], now: float) -> None:
        """Lockstep: take in so many datagrams from each vehicle; raise VehicleError when lost."""
        for (name, sock), expected in zip(self._sockets.items(), expect, strict=True):
            for _ in range(expected):
                try:
                    self.core.receive(name, sock.recv(_DATAGRAM), now)
                except BlockingIOError:
                    raise VehicleError(f"a datagram of {name} was lost at {now:.2f} s") from None
        for name, member in self.core.members.items():
            if member.station.codec.lost:
                raise VehicleError(f"{name}: a MAVLink frame was lost in lockstep")

    def drain(self, now: float, ready: Collection[Any] | None = None) -> None:
        """Free-running: take in what has arrived, on the sockets that are `ready` (None: any)."""
        for name, sock in self._sockets.items():
            if ready is not None and sock not in ready:
                continue
            with suppress(OSError):  # nothing more, or the vehicle is gone: ages tell
                for _ in range(64):
                    self.core.receive(name, sock.recv(_DATAGRAM), now)
        for name, frames in self._lines.receive():
            self.core.receive(name, frames, now)

    def exchange_and_tick(self, now: float) -> dict[str, int]:
        """Share states, decide, send; return the number of datagrams for each own vehicle."""
        self._seat.offer(now)
        sent = dict.fromkeys(self._sockets, 0)
        for name, data in self._seat.decide(now).items():
            if data and name in self._sockets:
                with suppress(ConnectionError):  # a dead vehicle is the launcher's business
                    self._sockets[name].send(data)
                    sent[name] = 1
            elif data:
                self._lines.send(name, data)
        return sent

    def tick_free(self, now: float) -> None:
        """Free-running: take in what has arrived, then share, decide and send."""
        self.drain(now)
        for name, track in self._tracks.items():
            member = self.core.members[name]
            member.complaint = "" if member.prepared else self._lines.complaint(name)
            track.add(member.station.status)
        self.exchange_and_tick(now)

    def close(self) -> None:
        """Finish the logs, leave the bus and close every socket and line."""
        self._seat.close()
        for track in self._tracks.values():
            track.close()
        self._bus.close()
        self._lines.close()
        for sock in self._sockets.values():
            sock.close()
