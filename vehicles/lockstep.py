"""One vehicle's part of a tick in lockstep, whatever carries its bytes."""

from collections.abc import Callable, Iterable

from ..transport.message import Message
from .protocol.conversation import Conversation
from .truth import PlaceLog, TruthLog
from .vehicle import Vehicle

Others = Callable[[list[Message]], None]
"""Reports to everybody but the coordinator; takes what is for all of them."""


def advance(
    vehicle: Vehicle,
    link: Conversation,
    heard: Iterable[bytes],
    until_us: int,
    truth: TruthLog | PlaceLog | None,
    others: Others | None = None,
) -> list[bytes]:
    """Take in what the coordinator sent on `link`, live until `until_us`, return what it gets."""
    out = [vehicle.handle(data, link) for data in heard]
    while vehicle.now_us < until_us:
        vehicle.step()
        if truth:
            truth.write(vehicle.now_us * 1e-6, vehicle.robot)
        broadcasts = vehicle.take_broadcasts()
        if others:
            others(broadcasts)
        out.append(vehicle.report(link, broadcasts))
    return [data for data in out if data]
