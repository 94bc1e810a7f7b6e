"""`QGC WPL 110`: one item a line, in tab-separated columns; the first is home."""

from math import isfinite, isnan

from ...transport.mavlink import mav
from .items import AMSL, Item, MissionType, plain_frame
from .plan import MissionError, Place, Plan
from .supported import SUPPORTED, is_located

_HEADER = "QGC WPL 110"
_PARAMS = ("param1", "param2", "param3", "param4")
_COLUMNS = ("seq", "current", "frame", "command", *_PARAMS, "x", "y", "z", "autocontinue")
_WHOLE = frozenset({"seq", "current", "frame", "command", "autocontinue"})
_LARGEST = {"frame": 255.0, "command": 65535.0, "x": 2**31 - 1, "y": 2**31 - 1}
_MAX = 3e38  # what a float on the wire holds
_HOME_COMMAND: int = mav.MAV_CMD_NAV_WAYPOINT


def parse_wpl(text: str, where: str) -> Plan:
    """Return the plan in `text`; fence and rally items are known by their commands.

    Item 0 is home where it is a waypoint, as every ground station writes it; MAVProxy's fence
    and rally files have none.
    """
    lines = text.splitlines()
    if not lines or " ".join(lines[0].split()) != _HEADER:
        hint = f"the first line must be {_HEADER!r}, or the file a .plan of QGroundControl"
        raise MissionError(where, "is no mission file", hint)
    home = None
    lists: dict[MissionType, list[Item]] = {kind: [] for kind in MissionType}
    for number, line in enumerate(lines[1:], start=2):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        seq, item = _item(words, f"{where}:{number}")
        if seq == 0 and item.command == _HOME_COMMAND:
            home = Place(item.lat_deg, item.lon_deg, item.z)
            continue
        row = SUPPORTED.get(item.command)
        lists[row.mission_type if row else MissionType.MISSION].append(item)
    mission, fence, rally = (tuple(lists[kind]) for kind in MissionType)
    return Plan(mission, fence, rally, home)


def format_wpl(plan: Plan) -> str:
    """Return `plan` as text that `parse_wpl` reads, and every ground station."""
    home = plan.home or Place(0.0, 0.0)
    first = Item(
        _HOME_COMMAND, AMSL, x=round(home.lat_deg * 1e7), y=round(home.lon_deg * 1e7), z=home.alt_m
    )
    lines = [_HEADER]
    for seq, item in enumerate((first, *plan.mission, *plan.fence, *plan.rally)):
        place = f"{item.x}\t{item.y}"
        if is_located(item.command):
            place = f"{item.lat_deg:.7f}\t{item.lon_deg:.7f}"
        params = "\t".join(_number(value) for value in item[2:6])
        head = f"{seq}\t{int(seq == 0)}\t{item.frame}\t{item.command}"
        lines.append(f"{head}\t{params}\t{place}\t{_number(item.z)}\t{item.autocontinue}")
    return "\n".join(lines) + "\n"


def _item(words: list[str], where: str) -> tuple[int, Item]:
    """Return the number and the item on one line."""
    if len(words) != len(_COLUMNS):
        hint = "seq current frame command param1..4 x y z autocontinue"
        raise MissionError(where, f"{len(words)} columns, expected {len(_COLUMNS)}", hint)
    values = {name: _value(name, word, where) for name, word in zip(_COLUMNS, words, strict=True)}
    command = int(values["command"])
    scale = 1e7 if is_located(command) else 1.0
    x, y = values["x"] * scale, values["y"] * scale
    for name, value in (("x", x), ("y", y)):
        if not abs(value) <= _LARGEST[name]:
            raise MissionError(where, f"{name} {values[name]:g} is out of range", "use degrees")
    p1, p2, p3, p4 = (values[name] for name in _PARAMS)
    frame, auto = plain_frame(int(values["frame"])), int(values["autocontinue"])
    item = Item(command, frame, p1, p2, p3, p4, round(x), round(y), values["z"], auto)
    return int(values["seq"]), item


def _value(name: str, word: str, where: str) -> float:
    try:
        value = float(word)
    except ValueError:
        raise MissionError(where, f"{name} {word!r} is not a number") from None
    if name not in _WHOLE:
        if not isnan(value) and not abs(value) <= _MAX:
            raise MissionError(where, f"{name} {word} is out of range")
        return value
    if not (isfinite(value) and value == int(value) and 0 <= value <= _LARGEST.get(name, 65535)):
        raise MissionError(where, f"{name} {word!r} is not a whole number in range")
    return value


def _number(value: float) -> str:
    """Return a float in as few digits as give it back, as a 32-bit float needs."""
    return f"{value:.9g}"
