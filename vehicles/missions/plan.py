"""A plan as files hold it: the mission, the fence, the rally points and home."""

from dataclasses import dataclass
from typing import NamedTuple

from ...transport.errors import MavherdError
from ...transport.mavlink import mav
from .items import Item

_JUMP: int = mav.MAV_CMD_DO_JUMP


class MissionError(MavherdError):
    """A mission that cannot be read or flown. The text names the place and the cure."""

    def __init__(self, where: str, problem: str, hint: str = "") -> None:
        super().__init__(f"{where}: {problem}" + (f" ({hint})" if hint else ""))


class Place(NamedTuple):
    """A point on the map."""

    lat_deg: float
    lon_deg: float
    alt_m: float = 0.0  # above mean sea level


@dataclass(frozen=True, slots=True)
class Plan:
    """What a file asks to fly. Its items are numbered from 1, as DO_JUMP counts; home is 0."""

    mission: tuple[Item, ...] = ()
    fence: tuple[Item, ...] = ()
    rally: tuple[Item, ...] = ()
    home: Place | None = None  # where the planner stood; it moves no vehicle

    def numbered_from(self, first: int) -> tuple[Item, ...]:
        """Return the mission with its jumps counted as if the first item were `first`."""
        return tuple(
            item._replace(param1=item.param1 - 1 + first) if item.command == _JUMP else item
            for item in self.mission
        )
