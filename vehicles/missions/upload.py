"""One list on its way up, item by item, until it is whole. The list it replaces stays till then."""

from typing import NamedTuple

from .items import Item, MissionType

ASK_AGAIN = 1.0  # s without the item that was asked for
GIVE_UP = 8.0  # s without any item


class Sender(NamedTuple):
    """Who uploads: a component, and the link that it is heard on."""

    system: int
    component: int
    link: object


class Upload:
    """Collects items `first` to `last` of one list, in order. `now` is seconds since boot."""

    def __init__(
        self,
        sender: Sender,
        mission_type: MissionType,
        first: int,
        last: int,
        now: float,
        *,
        partial: bool = False,
    ) -> None:
        self.sender = sender
        self.mission_type = mission_type
        self.first = first
        self.last = last
        self.partial = partial
        self.items: list[Item] = []
        self._heard_at = self._asked_at = now

    @property
    def wanted(self) -> int:
        """Return the number of the item that is asked for."""
        return self.first + len(self.items)

    @property
    def complete(self) -> bool:
        """Whether no item is missing."""
        return self.wanted > self.last

    def is_repeated(self, seq: int, item: Item) -> bool:
        """Return whether this is the last item once more: the answer to a second asking."""
        return seq == self.wanted - 1 and bool(self.items) and repr(self.items[-1]) == repr(item)

    def take(self, item: Item, now: float) -> None:
        """Take the wanted item; the next one is asked for at once."""
        self.items.append(item)
        self._heard_at = self._asked_at = now

    def is_stale(self, now: float) -> bool:
        """Return whether nothing has come for so long that the upload is over."""
        return now - self._heard_at > GIVE_UP

    def asks_again(self, now: float) -> bool:
        """Return whether to ask for the wanted item once more, which begins a new wait."""
        if now - self._asked_at <= ASK_AGAIN:
            return False
        self._asked_at = now
        return True
