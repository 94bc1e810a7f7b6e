"""Which of several runs on this machine has the standard UDP ports.

A ground station tells vehicles apart by system id alone: two runs that send to one would be mixed
up. So the first has 14550 and 14540 + i, and whoever comes while it lasts has ports 1000 higher.
"""

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from ...transport.errors import LinkError
from .ports import API_UDP, GCS_UDP, PortPlan

_APART = 1000
_RUNS = 18  # at the same time; beyond are the ports that the system gives away


@contextmanager
def leased(plan: PortPlan) -> Iterator[PortPlan]:
    """Have UDP ports to ourselves, those in `plan` that were not set by hand; yield all of them.

    Raises LinkError when so many runs go on that there are none left.
    """
    if None not in (plan.gcs_udp, plan.api_udp):
        yield plan
        return
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as token:
        shift = _APART * _take(token)
        yield (
            plan
            if not shift
            else replace(
                plan,
                gcs_udp=GCS_UDP + shift if plan.gcs_udp is None else plan.gcs_udp,
                api_udp=API_UDP + shift if plan.api_udp is None else plan.api_udp,
            )
        )


def _take(token: socket.socket) -> int:
    """Return the first number that nobody has; it is ours until the socket is closed."""
    for number in range(_RUNS):
        try:
            token.bind(f"\0mavherd-udp-{GCS_UDP + _APART * number}")  # a name, no file
        except OSError:
            continue
        return number
    raise LinkError(
        f"{_RUNS} runs on this machine have UDP {GCS_UDP}, {GCS_UDP + _APART} and so on already"
        " (end some, or set --gcs-udp and --api-udp)"
    )
