"""Waiting for any of many sockets."""

import selectors
import socket

from .links import Endpoint


class Watcher:
    """Waits for any of some endpoints and file descriptors."""

    def __init__(self, endpoints: list[Endpoint], *others: socket.socket) -> None:
        self._endpoints = endpoints
        self._others = others
        self._selector = selectors.DefaultSelector()
        self._registered: set[socket.socket] = set()

    def wait(self, timeout: float | None) -> set[object]:
        """Return the sockets that are ready after at most `timeout` seconds."""
        wanted = {s for e in self._endpoints for s in e.sockets()}.union(self._others)
        if wanted != self._registered:
            # Closed sockets cannot be unregistered one by one, and changes are rare.
            self._selector.close()
            self._selector = selectors.DefaultSelector()
            for sock in wanted:
                self._selector.register(sock, selectors.EVENT_READ)
            self._registered = wanted
        return {key.fileobj for key, _ in self._selector.select(timeout)}
