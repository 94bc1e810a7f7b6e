"""Mission files: QGroundControl's `.plan` (JSON) and the `QGC WPL 110` text of them all."""

from pathlib import Path

from ...transport.errors import os_reason
from .plan import MissionError, Plan
from .plan_json import parse_plan
from .waypoints import format_wpl, parse_wpl

_LARGEST = 10_000_000  # bytes


def read(path: Path) -> Plan:
    """Return the plan in a `.plan` or `QGC WPL 110` file, whatever its name, or raise MissionError.

    Whether a vehicle flies it is for `MissionStore.load` to say.
    """
    try:
        data = path.read_bytes() if path.stat().st_size <= _LARGEST else None
    except OSError as error:
        raise MissionError(str(path), os_reason(error)) from None
    if data is None:
        raise MissionError(str(path), "is too large for a mission")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise MissionError(str(path), "is not text", "save it as .plan or QGC WPL 110") from None
    return (parse_plan if text.lstrip().startswith("{") else parse_wpl)(text, str(path))


def write_wpl(path: Path, plan: Plan) -> None:
    """Write a plan as `QGC WPL 110`; fence and rally items follow the mission."""
    path.write_text(format_wpl(plan), encoding="ascii")
