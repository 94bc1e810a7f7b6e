"""Waiting for any of many sockets."""

import select
import socket

from .links import Endpoint


class Watcher:
    """Waits for any of some endpoints and sockets."""

    def __init__(self, endpoints: list[Endpoint], *others: socket.socket) -> None:
        self._endpoints = endpoints
        self._others = list(others)
        self._poll = select.poll()
        self._asked: list[socket.socket] = []
        self._registered: set[socket.socket] = set()
        self._by_fd: dict[int, socket.socket] = {}

    def wait(self, timeout: float | None) -> set[object]:
        """Return the sockets that are ready after at most `timeout` seconds."""
        wanted = self._others.copy()
        for endpoint in self._endpoints:
            wanted += endpoint.sockets()
        if wanted != self._asked:
            self._asked = wanted
            if (changed := set(wanted)) != self._registered:
                self._register(changed)
        milliseconds = None if timeout is None else timeout * 1e3
        return {self._by_fd[fd] for fd, _ in self._poll.poll(milliseconds)}

    def _register(self, sockets: set[socket.socket]) -> None:
        # Closed sockets cannot be unregistered one by one, and changes are rare.
        self._poll = select.poll()
        self._by_fd = {sock.fileno(): sock for sock in sockets}
        for fd in self._by_fd:
            self._poll.register(fd, select.POLLIN)
        self._registered = sockets
