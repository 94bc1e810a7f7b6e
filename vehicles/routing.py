"""Which frames go on to which other links: the routing rules of the MAVLink guide, sans I/O.

https://mavlink.io/en/guide/routing.html. Messages of other dialects are not forwarded: their
checksums cannot be verified, so that they cannot be told from garbage.
"""

from collections.abc import Collection
from typing import Generic, NamedTuple, TypeVar

from ..transport.mavlink import AUTOPILOT_COMPONENT, Message, mav

Address = tuple[int, int]  # system id, component id
AnyLink = TypeVar("AnyLink")

_EXPIRY_S = 60.0  # of silence after which nobody is looked for on a link any more
_MAX_ADDRESSES = 16  # on one link; an inventor of senders crowds out its own only
_ECHO_S = 0.5  # how long a frame that went round in a loop is recognised
_MAX_RECENT = 128
_ABOUT_ONE_LINK = {mav.MAVLINK_MSG_ID_RADIO, mav.MAVLINK_MSG_ID_RADIO_STATUS}


class Route(NamedTuple, Generic[AnyLink]):
    """Where a frame goes."""

    links: list[AnyLink]
    stays: bool = True
    """Whether the vehicle itself is to look at it, which knows its own address."""


class Router(Generic[AnyLink]):
    """Learns who is heard on which link and says where a frame goes. `now` is vehicle time, s."""

    def __init__(self, system_id: int) -> None:
        self._own: Address = system_id, AUTOPILOT_COMPONENT
        self._heard: dict[AnyLink, dict[Address, float]] = {}
        self._recent: dict[bytes, float] = {}  # frames that were forwarded, the oldest first

    def route(self, message: Message, frame: bytes, link: AnyLink, now: float) -> Route[AnyLink]:
        """Learn from a frame that came in on `link`; return where it goes.

        Broadcasts go to every link on which somebody was heard, the others where their target
        was; none where its own sender was heard, and none twice, so that clients who hold two
        of our links make no loop.
        """
        sender = message.get_srcSystem(), message.get_srcComponent()
        if sender == self._own or sender[0] == 0:
            return Route([])
        self._learn(sender, link, now)
        target = target_of(message)
        if target == self._own or message.get_msgId() in _ABOUT_ONE_LINK:
            return Route([])
        others = []
        for other, heard in self._heard.items():
            there = [address for address, last in heard.items() if now - last <= _EXPIRY_S]
            if other != link and sender not in there and self._is_among(target, there):
                others.append(other)
        stays = not others or target[0] != self._own[0] or target[1] == 0
        return Route(others if others and self._is_new(frame, now) else [], stays)

    def keep(self, links: Collection[AnyLink]) -> None:
        """Forget every link but these."""
        for gone in self._heard.keys() - set(links):
            del self._heard[gone]

    def _learn(self, sender: Address, link: AnyLink, now: float) -> None:
        heard = self._heard.setdefault(link, {})
        heard.pop(sender, None)
        if len(heard) >= _MAX_ADDRESSES:
            del heard[next(iter(heard))]
        heard[sender] = now  # at the end: the first one is the one heard longest ago

    def _is_among(self, target: Address, there: list[Address]) -> bool:
        """Return whether a frame for `target` concerns those who are heard on a link."""
        system, component = target
        if system == 0:
            return bool(there)
        if system == self._own[0] and component:
            return target in there
        return any(address[0] == system for address in there)

    def _is_new(self, frame: bytes, now: float) -> bool:
        last = self._recent.pop(frame, None)
        if len(self._recent) >= _MAX_RECENT:
            del self._recent[next(iter(self._recent))]
        self._recent[frame] = now
        return last is None or now - last > _ECHO_S


def target_of(message: Message) -> Address:
    """Return the system and component that a message is for; 0 is everybody."""
    if message.get_msgId() == mav.MAVLINK_MSG_ID_MANUAL_CONTROL:
        return message.target, 0
    return message.target_system, message.target_component
