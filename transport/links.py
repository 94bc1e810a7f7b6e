"""UDP and TCP links for MAVLink: non-blocking, bounded, deaf to strangers.

An endpoint (a port that listens or an address that is sent to) yields links; a link is one
conversation with one peer. A vehicle keeps codec and stream rates per link.
"""

import errno
import socket
import struct
from collections.abc import Iterator
from contextlib import suppress
from typing import Protocol

from .errors import LinkError
from .mavlink import datagrams

MAX_PEERS = 16  # conversations per listening endpoint
_DATAGRAM = 4096  # nobody sends longer ones; what a receiver must read is bounded
_MAX_PORT = 65535
_READ = 2048  # bytes that one TCP peer may have us read at a time
_MAX_UNSENT = 1 << 18  # bytes a TCP peer may leave unread before it is dropped
_RECEIVE_BUFFER = 1 << 20
_LEAST_BUFFER = 1 << 17  # what a tick may bring, and the kernel's own part of it


class Link(Protocol):
    """One conversation. `stream` says whether frames may be split across reads."""

    stream: bool
    spoken: bool  # the peer has said something sensible: it is not a stranger
    open: bool
    paused: bool  # set by the owner, who has heard enough: TCP waits, datagrams are dropped
    label: str

    @property
    def congested(self) -> bool:
        """Whether the peer has not taken all that was sent to it."""
        ...

    def send(self, data: bytes) -> None:
        """Send `data`, or drop it when the peer does not take it."""
        ...


class Endpoint(Protocol):
    """Something that is waited on and yields what its peers sent."""

    label: str

    def sockets(self) -> list[socket.socket]:
        """Return the sockets to wait for."""
        ...

    def links(self) -> list[Link]:
        """Return the conversations that are open."""
        ...

    def receive(self) -> Iterator[tuple[Link, bytes]]:
        """Yield what has arrived, without waiting."""
        ...

    def close(self) -> None:
        """Close every socket."""
        ...


class UdpOut:
    """Sends to one address; hears only that address."""

    stream = False
    open = True
    congested = False

    def __init__(self, host: str, port: int) -> None:
        self.label = f"udpout:{host}:{port}"
        self.problem = ""  # what the network said of our last datagrams
        self.spoken = self.paused = False
        if not 0 < port <= _MAX_PORT:
            raise LinkError(f"{self.label}: nobody can listen there (ports are 1..{_MAX_PORT})")
        self._socket = _udp_socket()
        try:
            self._socket.connect((host, port))
        except OSError as error:
            self._socket.close()
            raise LinkError(f"{self.label}: {error.strerror or error}") from None

    def send(self, data: bytes) -> None:
        """Send frames in datagrams; nobody listening is a `problem`, no error."""
        for datagram in datagrams(data):
            try:
                self._socket.send(datagram)
            except OSError as error:
                self._complain(error)

    def sockets(self) -> list[socket.socket]:
        """Return the one socket."""
        return [self._socket]

    def links(self) -> list[Link]:
        """Return the one conversation."""
        return [self]

    def receive(self) -> Iterator[tuple[Link, bytes]]:
        """Yield the datagrams that have arrived."""
        for _ in range(64):  # a flood must not hold up the caller
            try:
                data = self._socket.recv(_DATAGRAM)
            except BlockingIOError:
                return
            except OSError as error:  # "port unreachable" of an earlier send
                self._complain(error)
                continue
            self.spoken = True
            self.problem = ""
            if not self.paused:
                yield self, data

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _complain(self, error: OSError) -> None:
        if not isinstance(error, BlockingIOError):  # the queue is full: dropped, as on any network
            self.problem = (error.strerror or str(error)).lower()


class UdpPeer:
    """One of those who have sent to a `UdpIn` port."""

    stream = False
    congested = False

    def __init__(self, sock: socket.socket, address: tuple[str, int]) -> None:
        self.label = f"udp:{address[0]}:{address[1]}"
        self.spoken = self.paused = False
        self.open = True
        self._socket = sock
        self._address = address

    def send(self, data: bytes) -> None:
        """Send frames in datagrams."""
        for datagram in datagrams(data):
            with suppress(OSError):
                self._socket.sendto(datagram, self._address)


class UdpIn:
    """Listens on a port and answers whoever sends there."""

    problem = ""

    def __init__(self, host: str, port: int, max_peers: int = MAX_PEERS) -> None:
        self._socket = _udp_socket()
        self._max_peers = max_peers
        _bind(self._socket, host, port, f"udpin:{host}:{port}")
        self.port: int = self._socket.getsockname()[1]
        self.label = f"udpin:{host}:{self.port}"
        self._peers: dict[tuple[str, int], UdpPeer] = {}

    def sockets(self) -> list[socket.socket]:
        """Return the one socket."""
        return [self._socket]

    def links(self) -> list[Link]:
        """Return the peers, the one heard longest ago first."""
        return list(self._peers.values())

    def receive(self) -> Iterator[tuple[Link, bytes]]:
        """Yield the datagrams that have arrived.

        Beyond `max_peers` the stalest peer goes, strangers first.
        """
        for _ in range(64):
            try:
                data, address = self._socket.recvfrom(_DATAGRAM)
            except BlockingIOError:
                return
            except OSError:
                continue
            peer = self._peers.pop(address, None) or UdpPeer(self._socket, address)
            if len(self._peers) >= self._max_peers:
                strangers = (a for a, p in self._peers.items() if not p.spoken)
                stalest = next(strangers, None) or next(iter(self._peers))
                self._peers.pop(stalest).open = False
            self._peers[address] = peer
            if not peer.paused:
                yield peer, data

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class TcpPeer:
    """One accepted TCP connection."""

    stream = True
    spoken = True  # connecting is speaking

    def __init__(self, sock: socket.socket, address: tuple[str, int]) -> None:
        self.label = f"tcp:{address[0]}:{address[1]}"
        self.open = True
        self.paused = False
        self.socket = sock
        self._unsent = b""

    @property
    def congested(self) -> bool:
        """Whether the peer reads more slowly than we send."""
        return bool(self._unsent)

    def send(self, data: bytes) -> None:
        """Send as much as the peer takes; drop a peer that reads nothing for too long."""
        if not self.open:
            return
        self._unsent += data
        try:
            self._unsent = self._unsent[self.socket.send(self._unsent) :]
        except BlockingIOError:
            pass
        except OSError:
            self.close()
        if len(self._unsent) > _MAX_UNSENT:
            self.close()

    def receive(self) -> bytes:
        """Return what has arrived; closes itself when the peer has."""
        try:
            data = self.socket.recv(_READ)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self.close()
        return data

    def close(self) -> None:
        """Close the connection."""
        self.open = False
        self.socket.close()


class TcpServer:
    """Accepts connections on a socket made by `listen_tcp`, here or in a parent process."""

    def __init__(self, listening: socket.socket) -> None:
        self._socket = listening
        self._socket.setblocking(False)
        host, self.port = listening.getsockname()
        self.label = f"tcp:{host}:{self.port}"
        self._peers: list[TcpPeer] = []

    def sockets(self) -> list[socket.socket]:
        """Return the listening socket and one for each open connection that is not paused."""
        heard = (peer.socket for peer in self._peers if peer.open and not peer.paused)
        return [self._socket, *heard]

    def links(self) -> list[Link]:
        """Return the open connections."""
        return [peer for peer in self._peers if peer.open]

    def receive(self) -> Iterator[tuple[Link, bytes]]:
        """Accept, then yield what has arrived."""
        with suppress(OSError):
            while True:
                sock, address = self._socket.accept()
                if len(self._peers) >= MAX_PEERS:
                    sock.close()
                    continue
                sock.setblocking(False)
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._peers.append(TcpPeer(sock, address))
        for peer in self._peers:
            if peer.open and not peer.paused and (data := peer.receive()):
                yield peer, data
        self._peers = [peer for peer in self._peers if peer.open]

    def close(self) -> None:
        """Close the port and every connection."""
        for peer in self._peers:
            peer.close()
        self._socket.close()


def listen_tcp(host: str, port: int) -> socket.socket:
    """Return a listening socket; raise LinkError when the port cannot be had."""
    sock = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    _bind(sock, host, port, f"tcp:{host}:{port}")
    sock.listen(MAX_PEERS)
    return sock


def socket_pair_udp() -> tuple[socket.socket, socket.socket]:
    """Return two UDP sockets on loopback that hear only one another."""
    a, b = _udp_socket(), _udp_socket()
    for sock in (a, b):
        sock.bind(("127.0.0.1", 0))
        sock.setblocking(True)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)
        if (size := sock.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)) < _LEAST_BUFFER:
            raise LinkError(f"UDP buffers end at {size} bytes (raise net.core.rmem_max)")
    a.connect(b.getsockname())
    b.connect(a.getsockname())
    return a, b


def patience(sock: socket.socket, seconds: float) -> None:
    """Have a blocking socket raise BlockingIOError when nothing comes for `seconds`.

    The kernel keeps the time: half the system calls of `settimeout`.
    """
    sock.setblocking(True)
    whole, rest = divmod(seconds, 1)
    timeval = struct.pack("@ll", int(whole), int(rest * 1e6))
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, timeval)


def parse_address(text: str, what: str) -> tuple[str, int]:
    """Return host and port of `HOST:PORT` or `PORT`; raise LinkError naming `what`."""
    host, _, port = text.rpartition(":")
    if not port.isdecimal() or len(port) > 5 or int(port) > _MAX_PORT:
        raise LinkError(f"{what} {text!r}: expected HOST:PORT with a port of 0..{_MAX_PORT}")
    return host or "127.0.0.1", int(port)


def _udp_socket() -> socket.socket:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.setblocking(False)
    return sock


def _bind(sock: socket.socket, host: str, port: int, label: str) -> None:
    try:
        sock.bind((host, port))
    except OverflowError:
        sock.close()
        raise LinkError(f"{label}: ports end at {_MAX_PORT}") from None
    except OSError as error:
        sock.close()
        is_taken = error.errno in (errno.EADDRINUSE, errno.EACCES)
        cure = " (choose another port, or 0 for any free one)" if is_taken else ""
        raise LinkError(f"{label}: {error.strerror or error}{cure}") from None
