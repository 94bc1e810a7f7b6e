"""Ports that are free until somebody binds them, for those who must be told a number."""

import os
import random
import socket

# Below what Linux gives to those who ask for any port: nobody gets one of these by chance; above
# those of tests/e2e. Workers of one run share them out; another run at the same time takes them in
# another order.
_NUMBERS = range(27_000, 32_768)
_SHUFFLED = random.Random(os.environ.get("PYTEST_XDIST_TESTRUNUID")).sample(_NUMBERS, len(_NUMBERS))
_WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
_OURS = iter(_SHUFFLED[_WORKER :: int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))])


def free_port(kind: socket.SocketKind) -> int:
    """Return a port that nobody uses, each only once."""
    for port in _OURS:
        with socket.socket(socket.AF_INET, kind) as sock:
            try:
                sock.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise RuntimeError("no port is left")
