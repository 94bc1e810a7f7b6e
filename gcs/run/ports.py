"""Which MAVLink ports each vehicle of a run uses."""

import socket
from dataclasses import dataclass

from ...transport.errors import LinkError
from ...transport.links import listen_tcp

GCS_UDP = 14550  # where ground stations listen
API_UDP = 14540  # where offboard APIs listen: this plus the instance
TCP = 5760  # served: this plus ten times the instance
LOOPBACK = "127.0.0.1"
_LAST = 65535


@dataclass(frozen=True, slots=True, kw_only=True)
class PortPlan:
    """First ports of a run; None takes the standard one or the next free, 0 opens none."""

    gcs_udp: int | None = None
    api_udp: int | None = None
    tcp: int | None = None

    def udp_targets(self, instance: int) -> list[tuple[str, int]]:
        """Return the addresses that vehicle `instance` sends to."""
        gcs = GCS_UDP if self.gcs_udp is None else self.gcs_udp
        api = API_UDP if self.api_udp is None else self.api_udp
        ports = [gcs] if gcs else []
        if api:
            port = api + instance
            # what belongs to ground stations is stepped over: all that follows moves up by one
            for reserved in sorted({GCS_UDP, gcs or GCS_UDP}):
                port += api <= reserved <= port
            ports.append(port)
        if max(ports, default=0) > _LAST:
            raise LinkError(
                f"udp:{LOOPBACK}:{max(ports)}: ports end at {_LAST} "
                f"(instance {instance} sends to {api} + {instance})"
            )
        return [(LOOPBACK, port) for port in ports]

    def listen(self, instance: int) -> socket.socket | None:
        """Return the vehicle's listening TCP socket, None when it shall have none.

        A standard port that is taken gives way to the next free one; one that was set by hand
        raises LinkError.
        """
        if self.tcp == 0:
            return None
        if self.tcp is not None:
            return listen_tcp(LOOPBACK, self.tcp + 10 * instance)
        for port in range(TCP + 10 * instance, TCP + 10 * instance + 10):
            try:
                return listen_tcp(LOOPBACK, port)
            except LinkError:
                continue
        return listen_tcp(LOOPBACK, 0)


def free_tcp_port() -> int:
    """Return a TCP port that is free at this moment."""
    with socket.socket() as sock:
        sock.bind((LOOPBACK, 0))
        port: int = sock.getsockname()[1]
        return port
