"""One parameter as ground stations see it, and how its value on the wire becomes ours."""

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import copysign, isfinite

from ...transport.mavlink import mav

INT8: int = mav.MAV_PARAM_TYPE_INT8
INT16: int = mav.MAV_PARAM_TYPE_INT16
INT32: int = mav.MAV_PARAM_TYPE_INT32
REAL32: int = mav.MAV_PARAM_TYPE_REAL32

_BITS = {INT8: 8, INT16: 16, INT32: 32}
_FLOAT32 = struct.Struct("<f")
_ROUNDING = 0.01  # what ArduPilot adds before it cuts off the fraction of an integer
NAME_LENGTH = 16


class ParameterRefused(ValueError):  # noqa: N818 - reads as what it is
    """A value that a parameter cannot take. The text is one sentence that names the parameter."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A name with its meaning; values are in the unit that clients use, not in SI.

    `path` says where a value goes: `settings.x` at once, `tuning.x` at once into the robot's
    controllers, `body.x` into its physics at the next boot; nothing goes nowhere, and the
    parameter says so.
    """

    name: str
    type: int  # MAV_PARAM_TYPE
    default: float
    low: float
    high: float
    text: str  # for people, without the full stop
    unit: str = ""
    path: str = ""
    scale: float = 1.0  # SI units per unit of the wire
    values: Mapping[int, str] = field(default_factory=dict)  # labels
    bits: Mapping[int, str] = field(default_factory=dict)  # labels by bit; no other may be set
    codes: Mapping[int, object] = field(default_factory=dict)  # meanings; no other value may be
    read_only: bool = False
    live: bool = False  # the vehicle itself writes it
    reboot: bool = False  # counts from the next boot on
    group: str = ""
    follows: str = ""  # the `tuning.x` or `body.x` that gives the default

    def __post_init__(self) -> None:
        if not 0 < len(self.name) <= NAME_LENGTH:
            raise ValueError(f"{self.name!r} has not 1 to {NAME_LENGTH} characters")

    @property
    def is_integer(self) -> bool:
        """Whether values are whole numbers."""
        return self.type != REAL32

    @property
    def is_setting(self) -> bool:
        """Whether values go to the settings."""
        return self.path.startswith("settings.")

    @property
    def is_robots(self) -> bool:
        """Whether values go to the robot's controllers or physics."""
        return bool(self.path) and not self.is_setting

    @property
    def robot_name(self) -> str:
        """Return our name for what it sets of the robot."""
        return self.path.partition(".")[2]

    @property
    def is_kept_only(self) -> bool:
        """Whether a user may set it although it changes nothing here."""
        return not (self.path or self.read_only)

    @property
    def note(self) -> str:
        """Return what a user should know beside `text`."""
        if self.is_kept_only:
            return "Kept for ground stations: this vehicle does not use it."
        if self.live:
            return "Written by the vehicle itself."
        if self.read_only:
            return "A fact about this vehicle that cannot be changed while it runs."
        return "Counts from the next boot on." if self.reboot else "Counts at once."

    def stored(self, value: float) -> float:
        """Return `value` as the parameter's type keeps it; raise ParameterRefused."""
        if not isfinite(value):
            raise ParameterRefused(f"{self.name}: {value} is not a number to set")
        if self.is_integer:
            value = float(int(value + copysign(_ROUNDING, value)))
            half = 1 << (_BITS[self.type] - 1)
            low, high = max(self.low, -half), min(self.high, half - 1)
        else:
            low, high = self.low, self.high
            value = float32(value) if low <= value <= high else value
        if not float32(low) <= value <= max(high, float32(high)):
            unit = f" {self.unit}" if self.unit else ""
            raise ParameterRefused(
                f"{self.name}: {value:g} is not within {low:g} to {high:g}{unit}"
            )
        if self.codes and int(value) not in self.codes:
            known = ", ".join(f"{code} ({self.values[code]})" for code in self.codes)
            raise ParameterRefused(f"{self.name}: {value:g} is not supported, only {known}")
        if self.bits:
            allowed = sum(1 << bit for bit in self.bits)
            if int(value) & ~allowed:
                raise ParameterRefused(
                    f"{self.name}: {value:g} has bits that are not supported, only {allowed}"
                )
        return value

    def to_ours(self, value: float) -> object:
        """Return what a stored value means inside: SI units, or the meaning of a code."""
        if self.codes:
            return self.codes[int(value)]
        return value * self.scale

    def to_wire(self, ours: object) -> float:
        """Return the stored value of a meaning or SI value, as near as the type can keep it."""
        if self.codes:
            return float(next(code for code, meaning in self.codes.items() if meaning == ours))
        if not isinstance(ours, int | float):
            raise TypeError(f"{self.name} is a number, not {ours!r}")
        value = ours / self.scale
        return float(round(value)) if self.is_integer else float32(value)


def float32(value: float) -> float:
    """Return the IEEE 754 single nearest to `value`: what a MAVLink float can carry."""
    if abs(value) > 3.4028234e38:
        return float("inf") if value > 0 else float("-inf")
    nearest: float = _FLOAT32.unpack(_FLOAT32.pack(value))[0]
    return nearest


def shortest(value: float) -> str:
    """Return the shortest text that reads back as the same single."""
    for digits in range(6, 10):
        text = f"{value:.{digits}g}"
        if float32(float(text)) == value:
            return text
    return repr(value)
