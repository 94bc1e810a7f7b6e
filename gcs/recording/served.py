"""Where a recording is served: two ports on loopback, held from when they are chosen.

They are listened at by other processes, and not at once. Until then the system gives them to nobody
who asks for any port, and no other run of ours takes them for free.
"""

import socket
from contextlib import ExitStack
from dataclasses import dataclass
from urllib.parse import quote

from .viewers import LOOPBACK, ViewerError, Viewing, check_viewers

_DATA_PORT, _PAGE_PORT = 9876, 9090  # Rerun's own
_TRIES = 100  # of ports, from there on


@dataclass(frozen=True, slots=True)
class Ports:
    """The ports of one recording that is served, ours until they are released."""

    data: int
    page: int  # 0: there is no page
    held: ExitStack

    @property
    def source(self) -> str:
        """Where a viewer gets the data."""
        return proxy_url(self.data)

    @property
    def url(self) -> str:
        """What to open in a browser."""
        return f"http://{LOOPBACK}:{self.page}/?url={quote(self.source, safe='')}"

    def release(self) -> None:
        """Let others have them as soon as nobody listens there; once is enough."""
        self.held.close()


def prepare(viewing: Viewing) -> Ports:
    """Return the ports to use; raise ViewerError when what is wanted cannot be had here."""
    check_viewers(viewing)
    if viewing.web and viewing.web_port and viewing.web_port == viewing.view_port:
        raise ViewerError(f"--web-port {viewing.web_port}: --view-port has it (give another)")
    with ExitStack() as tried:
        data = _hold(tried, "--view-port", viewing.view_port, _DATA_PORT)
        page = _hold(tried, "--web-port", viewing.web_port, _PAGE_PORT) if viewing.web else 0
        held = tried.pop_all()
    return Ports(data, page, held)


def proxy_url(port: int) -> str:
    """Return where a viewer gets what is served at a port of this machine."""
    return f"rerun+http://{LOOPBACK}:{port}/proxy"


def _hold(held: ExitStack, option: str, wanted: int | None, standard: int) -> int:
    """Hold the port that was asked for, any if that is 0, or the first free one; return it."""
    ports = range(standard, standard + _TRIES) if wanted is None else [wanted]
    for port in ports:
        with ExitStack() as tried:
            sock = tried.enter_context(socket.socket())
            token = tried.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM))
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # who serves, too, binds it
            try:
                sock.bind((LOOPBACK, port))
                found: int = sock.getsockname()[1]
                token.bind(f"\0mavherd-tcp-{found}")  # a name, no file
            except OSError:
                continue
            held.enter_context(tried.pop_all())
            return found
    if wanted:
        raise ViewerError(f"{option} {wanted}: the port is taken (give another, or 0 for any)")
    raise ViewerError(f"no port is free, {ports[0]}..{ports[-1]} (give one with {option})")
