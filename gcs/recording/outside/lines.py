"""The lines on which outside vehicles are heard, and what is said on them."""

import socket
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from typing import NamedTuple

from ....transport.connect import Address, parse_connect
from ....transport.errors import LinkError
from ....transport.lines import Line, open_line
from ....transport.links import Link
from ....transport.mavlink import AUTOPILOT_COMPONENT, Codec, Message
from ...station.station import SYSTEM_ID
from .asking import COMPONENT_ID, RATE_HZ, SLOW_RATE_HZ, Asking, heartbeat
from .vehicle import SeenVehicle

_HEARTBEAT_S = 1.0
_UNASKED_S = 3.0  # in which a vehicle may tell something by itself
_MOST_LINKS = 1024  # remembered; a flood of invented senders must not grow us
_NOISE = 200  # bytes
_LOOPBACK = "127.0.0.1"

Tap = Callable[[bytes], None]
"""Sees every frame, heard or sent."""


class Heard(NamedTuple):
    """A message, and where it came from."""

    message: Message
    source: str


def listen_address(text: str) -> Address:
    """Return the address in what `--listen` is given: `udp:PORT`, `udp:HOST:PORT` or `udpin:...`.

    Without a host it is this machine only. Raises LinkError as `parse_connect` does.
    """
    scheme, _, rest = text.strip().partition(":")
    if scheme.isdecimal():
        scheme, rest = "udp", text.strip()
    if scheme.lower() in ("udp", "udpin"):
        rest = rest.removeprefix("//").removeprefix(":")
        return parse_connect(f"udpin:{f'{_LOOPBACK}:' if rest.isdecimal() else ''}{rest}")
    if scheme.lower() in ("tcp", "udpout", "serial"):
        raise LinkError(f"listen {text!r}: that is called, not listened to (use --connect {text})")
    return parse_connect(text)


class Lines:
    """Opens lines to `addresses`; a vehicle that tells nothing by itself is asked, unless `silent`.

    Raises LinkError for a line that cannot be had. On lines that call somebody all is asked for at
    once; where we listen, only of a vehicle that told neither place nor attitude for a while.
    """

    def __init__(self, addresses: Sequence[Address], *, silent: bool, tap: Tap | None) -> None:
        self._silent = silent
        self._tap = tap
        self._lines: dict[Address, Line] = {}
        self._codecs: dict[str, Codec] = {}
        self._links: dict[str, tuple[Link, Address]] = {}
        self._asking: dict[tuple[str, int], Asking] = {}
        self._reboots: dict[int, int] = {}
        self._heartbeat_due = 0.0
        self._codec = Codec(SYSTEM_ID, COMPONENT_ID)
        with ExitStack() as undo:
            for address in addresses:
                if address not in self._lines:
                    self._lines[address] = line = open_line(address)
                    undo.callback(line.close)
            undo.pop_all()

    def sockets(self) -> list[socket.socket]:
        """Return what to wait for at this moment: lines come and go."""
        return [s for line in self._lines.values() for s in line.sockets()]

    def receive(self, now: float) -> Iterator[Heard]:
        """Yield what has arrived, without waiting."""
        for address, line in self._lines.items():
            for link, data in line.receive():
                yield from self._read(link, address, data, now)

    def tend(self, vehicles: Sequence[SeenVehicle], now: float) -> None:
        """Send what is due."""
        if self._silent:
            return
        if now >= self._heartbeat_due:
            self._heartbeat_due = now + _HEARTBEAT_S
            self._greet()
        for vehicle in vehicles:
            self._ask(vehicle, now)

    def silences(self, vehicles: Sequence[SeenVehicle]) -> list[str]:
        """Return a line for each address where none of these vehicles is heard, with the reason."""
        spoken = {address for _, address in self._links.values()}
        sources = (self._links.get(vehicle.source) for vehicle in vehicles)
        heard = {known[1] for known in sources if known}
        found = []
        for address, line in self._lines.items():
            if address in heard:
                continue
            if address in spoken:
                problem = "MAVLink comes, but no heartbeat of an autopilot"
            elif self._codec_of(line).bad_bytes > _NOISE:
                problem = "bytes come, but no MAVLink (is the baud rate right?)"
            else:
                problem = line.problem or "nothing is heard (is it started, and sends it here?)"
            found.append(f"{address.text}: {problem}")
        return found

    def close(self) -> None:
        """Close every line."""
        for line in self._lines.values():
            line.close()

    def _read(self, link: Link, address: Address, data: bytes, now: float) -> Iterator[Heard]:
        label = link.label
        if label not in self._codecs and len(self._codecs) >= _MOST_LINKS:
            self._codecs.clear()
            self._links.clear()
        codec = self._codecs.setdefault(label, Codec(SYSTEM_ID))
        for message, frame in codec.decode_frames(data, stream=link.stream):
            self._links[label] = link, address
            if self._tap:
                self._tap(frame)
            if message.get_type() == "HEARTBEAT":
                link.spoken = True
            if message.get_srcComponent() == AUTOPILOT_COMPONENT:
                asking = self._asking.get((label, message.get_srcSystem()))
                if asking:
                    asking.hear(message, now)
            yield Heard(message, label)

    def _codec_of(self, line: Line) -> Codec:
        """Return the codec that has read most rubbish on a line."""
        codecs = [self._codecs.get(link.label) for link in line.links()]
        return max(filter(None, codecs), key=lambda c: c.bad_bytes, default=Codec(SYSTEM_ID))

    def _greet(self) -> None:
        """Send a heartbeat to those that we call, and to those that we ask."""
        asked = {label for label, _ in self._asking}
        called = [link for a, line in self._lines.items() if _calls(a) for link in line.links()]
        listened = [
            link for label, (link, a) in self._links.items() if label in asked and not _calls(a)
        ]
        data = self._codec.encode([heartbeat()])
        for link in (*called, *listened):
            self._send(link, data)

    def _ask(self, vehicle: SeenVehicle, now: float) -> None:
        link, address = self._links.get(vehicle.source, (None, None))
        if link is None or address is None:
            return
        key = vehicle.source, vehicle.system_id
        asking = self._asking.get(key)
        if asking is None:
            told = now - max(vehicle.first_at, vehicle.moves_at) < _UNASKED_S
            if told and not _calls(address):
                return
            rate = SLOW_RATE_HZ if address.scheme == "serial" else RATE_HZ
            asking = self._asking[key] = Asking(vehicle.system_id, rate)
            self._reboots[vehicle.system_id] = vehicle.reboots
        if vehicle.reboots != self._reboots.get(vehicle.system_id):
            self._reboots[vehicle.system_id] = vehicle.reboots
            asking.restart()
        for frame in asking.due(now):
            self._send(link, frame)

    def _send(self, link: Link, data: bytes) -> None:
        link.send(data)
        if self._tap:
            self._tap(data)


def _calls(address: Address) -> bool:
    """Return whether we speak first on a line."""
    return address.scheme != "udpin"
