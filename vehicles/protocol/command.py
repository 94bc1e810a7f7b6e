"""A command as the handlers see it, whether it came as COMMAND_LONG or COMMAND_INT."""

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite

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
            return cls(m.command, params, m.x * scale, m.y * scale, m.z, m.frame, True)
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

    def place(self, origin: Origin, home_down: float) -> Vec3:
        """Return the place in local NED; raise Refused when there is none such."""
        lat_deg, lon_deg, altitude = self.x, self.y, self.z
        if not (abs(lat_deg) <= 90 and abs(lon_deg) <= 180 and isfinite(altitude)):
            raise Refused
        if lat_deg == lon_deg == 0:
            raise Refused
        if self.frame in _AMSL:
            down = origin.alt_m - altitude
        elif self.frame in _ABOVE_HOME:
            down = home_down - altitude
        else:
            raise Refused
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
