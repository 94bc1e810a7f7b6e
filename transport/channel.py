"""Lines of JSON over a stream socket: how the launcher talks to the processes it started."""

import json
import select
import socket
from typing import Any

MAX_LINE = 1 << 22


class ChannelClosed(Exception):  # noqa: N818 - an end, not an error
    """The other end has closed the channel or died."""


class Channel:
    """One end of a conversation in JSON objects."""

    def __init__(self, sock: socket.socket) -> None:
        self.socket = sock
        sock.setblocking(True)
        self._buffer = b""
        self._poll = select.poll()  # select() knows 1024 files only
        self._poll.register(sock, select.POLLIN)

    def send(self, message: dict[str, Any]) -> None:
        """Send one object; raise ChannelClosed when nobody is there any more."""
        try:
            self.socket.sendall(json.dumps(message).encode() + b"\n")
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
                data = self.socket.recv(1 << 16)
            except OSError:
                data = b""
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
