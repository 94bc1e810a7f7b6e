"""Lines to external vehicles: opened once, mended for ever, never waited for.

A line is an `Endpoint` that we call or listen at. What is wrong with it at this moment is its
`problem`; it goes on trying. `receive` must be called a few times a second, or nothing is mended.
"""

import errno
import os
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any, Protocol

from .connect import Address
from .errors import LinkError
from .links import Endpoint, Link, TcpPeer, UdpIn, UdpOut
from .retry import Backoff

_READS = 32  # of one TCP line before the caller gets a turn
_DIAL_S = 5.0  # for a connection to come about
_UNHEARD_MS = 10_000  # after which what was sent, but not acknowledged, ends a connection
_QUEUED = 16_384  # bytes: old setpoints must not pile up in a link that stands still
_RECEIVE_BUFFER = 1 << 20
_MAX_VEHICLES = 256  # behind one listening port


class Line(Endpoint, Protocol):
    """An endpoint that says what keeps it from working."""

    @property
    def problem(self) -> str:
        """What is wrong at this moment, empty when nothing is known to be."""
        ...


def open_line(address: Address) -> Line:
    """Return a line to `address`; raise LinkError for what no patience will mend.

    That is a port taken by another program, a host that nobody knows, a package not installed;
    a refused connection or an absent device is a `problem`, and tried again.
    """
    match address.scheme:
        case "tcp":
            return TcpClient(address)
        case "udpin":
            return _listen(address)
        case "udpout":
            return UdpOut(address.host, address.port)
        case "serial":
            from .serial_line import SerialLine  # pyserial is an extra

            return SerialLine(address)
    raise ValueError(f"no such scheme: {address.scheme}")


class TcpClient:
    """Calls one address in the background, again and again after each loss."""

    stream = True
    paused = False

    def __init__(self, address: Address, clock: Callable[[], float] = time.monotonic) -> None:
        self.label = f"tcp:{address.host}:{address.port}"
        self.spoken = False
        self.open = True  # the conversation outlives its connections
        self.problem = "not connected yet"
        self._clock = clock
        self._addresses = _resolve(address.host, address.port, self.label)
        self._backoff = Backoff(clock)
        self._dialling: socket.socket | None = None
        self._give_up_at = 0.0
        self._peer: TcpPeer | None = None
        self._dial()

    @property
    def congested(self) -> bool:
        """Whether the other end reads more slowly than we send."""
        return self._peer is not None and self._peer.congested

    def sockets(self) -> list[socket.socket]:
        """Return the connection's socket, if there is one."""
        return [self._peer.socket] if self._peer and self._peer.open else []

    def links(self) -> list[Link]:
        """Return the one conversation."""
        return [self]

    def send(self, data: bytes) -> None:
        """Send `data` whole; drop it while there is no connection or it stands still."""
        if self._peer and self._peer.congested:
            self._peer.send(b"")
        if self._peer and not self._peer.congested:
            self._peer.send(data)

    def receive(self) -> Iterator[tuple[Link, bytes]]:
        """Yield what has arrived; connect again when it is time to."""
        if self._peer:
            for _ in range(_READS):
                if not self._peer.open or not (data := self._peer.receive()):
                    break
                self._backoff.reset()
                yield self, data
            if not self._peer.open:
                self._peer = None
                self._fail("connection closed by the other end")
        elif self._dialling:
            self._await(self._dialling)
        elif self._backoff.is_over():
            self._dial()

    def close(self) -> None:
        """End the connection, or the attempt at one."""
        self.open = False
        if self._dialling:
            self._dialling.close()
        if self._peer:
            self._peer.close()
        self._dialling = self._peer = None

    def _dial(self) -> None:
        family, where = self._addresses[0]
        self._addresses.append(self._addresses.pop(0))  # the next time another of its addresses
        try:
            sock = socket.socket(family, socket.SOCK_STREAM)
        except OSError as error:  # IPv6 is switched off, or too many files are open
            self._fail(_reason(error))
            return
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _QUEUED)
        if hasattr(socket, "TCP_USER_TIMEOUT"):
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _UNHEARD_MS)
        self._dialling = sock
        self._give_up_at = self._clock() + _DIAL_S
        try:
            sock.connect(where)
        except BlockingIOError:
            return
        except OSError as error:
            self._hang_up(sock, _reason(error))
            return
        self._await(sock)

    def _await(self, sock: socket.socket) -> None:
        """See whether the connection has come about."""
        if code := sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
            self._hang_up(sock, _reason(OSError(code, "")))
            return
        try:
            peer = sock.getpeername()
        except OSError:
            if self._clock() > self._give_up_at:
                self._hang_up(sock, "no answer")
            return
        if peer == sock.getsockname():  # a port of loopback can be connected to itself
            self._hang_up(sock, "connection refused")
            return
        self._dialling = None
        self._peer = TcpPeer(sock, peer[:2])
        self.problem = ""

    def _hang_up(self, sock: socket.socket, problem: str) -> None:
        sock.close()
        self._dialling = None
        self._fail(problem)

    def _fail(self, problem: str) -> None:
        self.problem = problem
        self._backoff.fail()


def _resolve(host: str, port: int, label: str) -> list[tuple[int, Any]]:
    """Return family and address of each way to a host, IPv4 first."""
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise LinkError(f"{label}: host {host!r}: {str(reason).lower()}") from None
    ways = [(family, where) for family, _, _, _, where in found]
    return sorted(ways, key=lambda way: way[0] != socket.AF_INET)


def _reason(error: OSError) -> str:
    return os.strerror(error.errno).lower() if error.errno else str(error)


def _listen(address: Address) -> UdpIn:
    try:
        line = UdpIn(address.host, address.port, _MAX_VEHICLES)
    except LinkError as error:
        if getattr(error.__context__, "errno", None) == errno.EADDRINUSE:
            cure = "close it, or have the vehicle send to another port"
            taken = "another program listens here, a ground station perhaps"
            raise LinkError(f"{address.text}: {taken} ({cure})") from None
        raise
    with suppress(OSError):
        line.sockets()[0].setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)
    return line
