"""What the pages that are made from tables in the code have in common."""

import textwrap
from collections.abc import Iterable, Sequence

from mavherd.transport.mavlink import mav
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.vehicle import Vehicle

KINDS = {"quadcopter": "copter", "rover": "rover"}
NONE = "\N{EN DASH}"
_WIDTH = 100


def vehicle(kind: str, personality: str) -> Vehicle:
    """Return a vehicle such as `mavherd vehicle` makes, to be asked."""
    config = VehicleConfig(kind=kind, system_id=1, autopilot=personality, profile="ardupilot")
    return Vehicle(config)


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(map(_line, lines))


def paragraph(text: str) -> str:
    """Return text in lines of the usual width."""
    indent = "  " if text.startswith("- ") else ""
    return textwrap.fill(
        text, _WIDTH, subsequent_indent=indent, break_on_hyphens=False, break_long_words=False
    )


def command(number: int) -> str:
    """Return a command's name and number."""
    return f"{command_name(number)} ({number})"


def command_name(number: int) -> str:
    """Return a command's name without what all of them begin with."""
    return str(mav.enums["MAV_CMD"][number].name).removeprefix("MAV_CMD_")


def _line(cells: Sequence[str]) -> str:
    return "|" + "|".join(f" {cell.replace('|', '/')} " if cell else " " for cell in cells) + "|"
