"""Mission files: QGroundControl's `.plan` (JSON) and the `QGC WPL 110` text of them all."""

from pathlib import Path

from .plan import MissionError, Plan
from .plan_json import parse_plan
from .waypoints import format_wpl, parse_wpl

_LARGEST = 10_000_000  # bytes


def read(path: Path) -> Plan:
    """Return the plan in a `.plan` or `QGC WPL 110` file, whatever its name, or raise MissionError.

    Whether a vehicle flies it is for `MissionStore.load` to say.
    """
    try:
        with path.open("rb") as file:
            data = file.read(_LARGEST + 1)
    except OSError as error:
        raise MissionError(str(path), error.strerror or str(error)) from None
    if len(data) > _LARGEST:
        raise MissionError(str(path), "is too large for a mission")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise MissionError(str(path), "is not text", "save it as .plan or QGC WPL 110") from None
    return (parse_plan if text.lstrip().startswith("{") else parse_wpl)(text, str(path))


def write_wpl(path: Path, plan: Plan) -> None:
    """Write a plan as `QGC WPL 110`; fence and rally items follow the mission."""
    path.write_text(format_wpl(plan), encoding="ascii")
