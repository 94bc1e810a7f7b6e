"""How far a mission has got: which item is next, and how often jumps have been taken."""

from collections.abc import Sequence
from typing import NamedTuple

from ...transport.mavlink import mav
from .items import Item

_JUMP: int = mav.MAV_CMD_DO_JUMP
_LAST_NAV: int = mav.MAV_CMD_NAV_LAST
_FOR_EVER = -1
_MAX_STEPS = 3000  # items looked at in one advance: jumps that only lead to jumps come to an end
_MAX_OTHERS = 750


class Advance(NamedTuple):
    """What comes next: DO and CONDITION items in order, then a NAV item (None: the end)."""

    others: tuple[int, ...]
    nav: int | None


class Progress:
    """The place in a mission. It outlives AUTO, so that a paused mission can go on.

    All numbers are places in the stored list, from 0. `first_seq` is the number that the ground
    gives to place 0 and that DO_JUMP counts in: 1 where item 0 is home.
    """

    def __init__(self, first_seq: int) -> None:
        self._first_seq = first_seq
        self.complete = False
        self.reset()

    def reset(self) -> None:
        """Go back to the beginning and wait. That the last mission was completed stays known."""
        self.started = False  # MISSION_START was heard, or AUTO was entered in the air
        self._rewind()

    def begin_again(self) -> None:
        """Go back to the beginning, and forget how the last time ended."""
        self.complete = False
        self._rewind()

    def _rewind(self) -> None:
        self.current: int | None = None  # the NAV item under way, or the last one begun
        self.wanted: int | None = None  # where to go on instead of after `current`
        self.jumps: dict[int, int] = {}  # how often each DO_JUMP was taken
        self.speed_limits: dict[str, float | None] = {}  # by the name of the robot's attribute

    @property
    def shown(self) -> int | None:
        """Return the item that counts as current, None before the first."""
        return self.current if self.wanted is None else self.wanted

    def go_to(self, index: int) -> None:
        """Go on with the item at `index`, whatever is under way."""
        self.wanted = index
        self.complete = False

    def advance(self, items: Sequence[Item]) -> Advance:
        """Move on to the next NAV item, and return it with those to run on the way there.

        A jump that leads nowhere is passed over.
        """
        at = 0 if self.current is None else self.current + 1
        if self.wanted is not None:
            at, self.wanted = self.wanted, None
        others: list[int] = []
        for _ in range(_MAX_STEPS):
            if not 0 <= at < len(items) or len(others) > _MAX_OTHERS:
                break
            command = items[at].command
            if command == _JUMP:
                at = self._jump(at, items)
            elif command <= _LAST_NAV:
                self.current = at
                return Advance(tuple(others), at)
            else:
                others.append(at)
                at += 1
        return Advance(tuple(others), None)

    def _jump(self, at: int, items: Sequence[Item]) -> int:
        """Return where the DO_JUMP at `at` leads now."""
        target = int(items[at].param1) - self._first_seq
        times = int(items[at].param2)
        taken = self.jumps.get(at, 0)
        if not 0 <= target < len(items) or (times != _FOR_EVER and taken >= times):
            return at + 1
        self.jumps[at] = taken + 1
        return target
