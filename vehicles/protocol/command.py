"""A command as the handlers see it, whether it came as COMMAND_LONG or COMMAND_INT."""

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite, nan

from ...transport.frames import Origin
from ...transport.mavlink import Message, mav
from ..flight.autopilot import Autopilot
from ..robot import Vec3

ACCEPTED: int = mav.MAV_RESULT_ACCEPTED
DENIED: int = mav.MAV_RESULT_DENIED
FAILED: int = mav.MAV_RESULT_FAILED
UNSUPPORTED: int = mav.MAV_RESULT_UNSUPPORTED

_AMSL = (mav.MAV_FRAME_GLOBAL, mav.MAV_FRAME_GLOBAL_INT)
_ABOVE_HOME = (
    mav.MAV_FRAME_GLOBAL_RELATIVE_ALT,
    mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
    mav.MAV_FRAME_GLOBAL_TERRAIN_ALT,  # the ground is flat
    mav.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT,
)
_FARTHEST = 1e6  # m
_NO_PLACE = 2**31 - 1  # in COMMAND_INT, what NaN is in COMMAND_LONG


class Refused(Exception):  # noqa: N818 - reads as what it is
    """A command that cannot be done as given; carries the MAV_RESULT."""

    def __init__(self, result: int = DENIED) -> None:
        super().__init__(result)
        self.result = result


@dataclass(frozen=True, slots=True)
class Command:
    """One command: `x` and `y` are degrees in a global frame, whichever message brought them."""

    number: int
    params: tuple[float, float, float, float]  # param1 to param4
    x: float
    y: float
    z: float
    frame: int
    is_int: bool

    @classmethod
    def read(cls, m: Message) -> "Command":
        """Return the command in a COMMAND_LONG or COMMAND_INT."""
        params = (m.param1, m.param2, m.param3, m.param4)
        if m.get_type() == "COMMAND_INT":
            scale = 1e-7 if m.frame in _AMSL or m.frame in _ABOVE_HOME else 1e-4
            x, y = (nan if v == _NO_PLACE else v * scale for v in (m.x, m.y))
            return cls(m.command, params, x, y, m.z, m.frame, True)
        frame = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT
        if m.command == mav.MAV_CMD_DO_SET_HOME:
            frame = mav.MAV_FRAME_GLOBAL
        return cls(m.command, params, m.param5, m.param6, m.param7, frame, False)

    def number_at(self, index: int) -> float:
        """Return a parameter (1 to 4) that must be finite."""
        value = self.params[index - 1]
        if not isfinite(value):
            raise Refused
        return value

    def whole(self, index: int) -> int:
        """Return a parameter (1 to 4) that must be a whole number."""
        return int(self.number_at(index))

    @property
    def is_global(self) -> bool:
        """Whether the command counts in a global frame."""
        return self.frame in _AMSL or self.frame in _ABOVE_HOME

    @property
    def is_amsl(self) -> bool:
        """Whether the altitude counts from the sea."""
        return self.frame in _AMSL

    def down(self, origin: Origin, home_down: float) -> float:
        """Return the altitude in local NED; raise Refused when there is none such."""
        if not (isfinite(self.z) and abs(self.z) <= _FARTHEST):
            raise Refused
        if self.frame in _AMSL:
            return origin.alt_m - self.z
        if self.frame in _ABOVE_HOME:
            return home_down - self.z
        raise Refused

    def place(self, origin: Origin, home_down: float) -> Vec3:
        """Return the place in local NED; raise Refused when there is none such."""
        lat_deg, lon_deg = self.x, self.y
        if not (abs(lat_deg) <= 90 and abs(lon_deg) <= 180):
            raise Refused
        if lat_deg == lon_deg == 0:
            raise Refused
        down = self.down(origin, home_down)
        north, east = origin.from_geodetic(lat_deg, lon_deg)
        if max(abs(north), abs(east), abs(down)) > _FARTHEST:
            raise Refused
        return Vec3(north, east, down)


@dataclass(frozen=True, slots=True)
class FlightRow:
    """A command to the autopilot: what does it, who has it, and what the docs say."""

    run: Callable[[Autopilot, Command], int]
    note: str
    kinds: tuple[str, ...] = ("quadcopter", "rover")
    partly: bool = False  # less than the flight stacks do; the note says how
