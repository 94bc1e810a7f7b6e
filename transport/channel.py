"""Lines of JSON over a Unix stream socket: how the launcher talks to the processes it started."""

import json
import select
import socket
from collections.abc import Sequence
from typing import Any

MAX_LINE = 1 << 22
MAX_FDS = 250  # files in one message; Linux passes no more than 253


class ChannelClosed(Exception):  # noqa: N818 - an end, not an error
    """The other end has closed the channel or died."""


class Channel:
    """One end of a conversation in JSON objects, which open files may go with."""

    def __init__(self, sock: socket.socket) -> None:
        self.socket = sock
        sock.setblocking(True)
        self.fds: list[int] = []  # files that have come along; whoever takes one owns it
        self._buffer = b""
        self._poll = select.poll()  # select() knows 1024 files only
        self._poll.register(sock, select.POLLIN)

    def send(self, message: dict[str, Any], fds: Sequence[int] = ()) -> None:
        """Send one object, and up to MAX_FDS files with it.

        Raises ChannelClosed when nobody is there any more.
        """
        line = json.dumps(message).encode() + b"\n"
        try:
            if fds:
                line = line[socket.send_fds(self.socket, [line], fds) :]
            self.socket.sendall(line)
        except OSError:
            raise ChannelClosed from None

    def receive(self, timeout: float | None = None) -> dict[str, Any] | None:
        """Return the next object, None after `timeout` seconds without a whole one."""
        while True:
            line, newline, rest = self._buffer.partition(b"\n")
            if newline:
                self._buffer = rest
                message: dict[str, Any] = json.loads(line)
                return message
            if len(self._buffer) > MAX_LINE:
                raise ChannelClosed
            if timeout is not None and not self._poll.poll(timeout * 1000):
                return None
            try:
                data, fds, _, _ = socket.recv_fds(self.socket, 1 << 16, MAX_FDS)
            except OSError:
                data, fds = b"", []
            self.fds += fds
            if not data:
                raise ChannelClosed
            self._buffer += data

    @property
    def ended(self) -> bool:
        """Whether the other end has closed the channel or died, and nothing is left to read."""
        if self._buffer:
            return False
        try:
            return not self.socket.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT)
        except BlockingIOError:
            return False
        except OSError:
            return True

    def close(self) -> None:
        """Close this end; the other one sees end-of-file."""
        self.socket.close()
