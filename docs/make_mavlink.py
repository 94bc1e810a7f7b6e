"""Write docs/mavlink.md: what a vehicle speaks, from the tables that it speaks by.

python docs/make_mavlink.py
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from mavherd.transport.mavlink import mav
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.flight.personality import PERSONALITIES
from mavherd.vehicles.missions.items import MissionType
from mavherd.vehicles.missions.supported import SUPPORTED, Effect
from mavherd.vehicles.protocol.commands import LINK_COMMANDS
from mavherd.vehicles.protocol.flight_commands import FLIGHT_COMMANDS
from mavherd.vehicles.protocol.telemetry import name_of, note_of
from mavherd.vehicles.vehicle import Vehicle

PAGE = Path(__file__).parent / "mavlink.md"
KINDS = {"quadcopter": "copter", "rover": "rover"}

_INTRODUCTION = """\
# What a vehicle speaks

Written by `python docs/make_mavlink.py` from the tables in the code; a test compares the two. What
each thing does is told in [vehicles.md](vehicles.md). Everything that is not listed is refused:
commands with UNSUPPORTED, mission items with MAV_MISSION_UNSUPPORTED, modes with FAILED and a
STATUSTEXT that names them, FTP requests with a NAK.

`ardupilot` is ArduPilot 4.6 (the default), `px4` PX4 1.16, `generic` MAV_AUTOPILOT_GENERIC with
ArduPilot's modes and parameters."""


def page() -> str:
    """Return the whole page."""
    parts = [_INTRODUCTION]
    for title, table in (
        ("Modes", _modes()),
        ("Commands", _commands()),
        ("Mission, fence and rally items", _items()),
        ("Messages that a vehicle heeds", _heard()),
        ("Messages that a vehicle sends", _sent()),
        ("Parameters", _parameters()),
    ):
        parts.append(f"## {title}\n\n{table}")
    return "\n\n".join(parts) + "\n"


def _modes() -> str:
    parts = [
        "`custom_mode` of each mode. Every number of the real flight stack that is missing here is"
        " refused by name, any other as unknown."
    ]
    for personality in ("ardupilot", "px4"):
        rows = []
        for kind, table in PERSONALITIES[personality].modes.items():
            for mode, (number, name) in table.rows.items():
                rows.append((KINDS[kind], name, _mode_number(number), mode.value, "flown"))
            for number, name in table.refused.items():
                rows.append((KINDS[kind], name, _mode_number(number), "", "refused"))
        header = ("vehicle", "mode", "custom_mode", "what it is", "")
        parts.append(f"### {personality}\n\n{_table(header, rows)}")
    return "\n\n".join(parts)


def _mode_number(number: int) -> str:
    if number < 1 << 16:
        return str(number)
    main, sub = number >> 16 & 0xFF, number >> 24
    return f"main {main}, sub {sub}" if sub else f"main {main}"


def _commands() -> str:
    rows = []
    for number, row in sorted(FLIGHT_COMMANDS.items()):
        rows.append((f"{_command(number)} ({number})", _kinds(row.kinds), row.note))
    for number, link_row in sorted(LINK_COMMANDS.items()):
        rows.append((f"{_command(number)} ({number})", "both", link_row.note))
    text = "As COMMAND_LONG and as COMMAND_INT; the answer comes within 10 ms."
    return f"{text}\n\n{_table(('MAV_CMD', 'vehicle', 'how'), rows)}"


def _items() -> str:
    rows = []
    for item in SUPPORTED.values():
        effect = "" if item.effect is Effect.FLOWN else "accepted without effect: "
        where = MissionType(item.mission_type).name.lower()
        name = f"{item.name.removeprefix('MAV_CMD_')} ({item.command})"
        rows.append((name, where, _kinds(item.kinds), effect + item.note))
    return _table(("item", "list", "vehicle", "how"), rows)


def _heard() -> str:
    rows = []
    for personality in PERSONALITIES:
        vehicle = Vehicle(VehicleConfig(kind="quadcopter", system_id=1, autopilot=personality))
        rows.append((personality, ", ".join(sorted(vehicle.converse().heeds))))
    return _table(("personality", "messages"), rows)


def _sent() -> str:
    vehicle = Vehicle(VehicleConfig(kind="quadcopter", system_id=1))
    px4 = Vehicle(VehicleConfig(kind="quadcopter", system_id=1, autopilot="px4"))
    streams = [v.converse(spoken=True).streams for v in (vehicle, px4)]
    rows = []
    for message_id in sorted(vehicle.telemetry.ids | px4.telemetry.ids):
        who = [v for v in (vehicle, px4) if message_id in v.telemetry.ids]
        only = "" if len(who) == 2 else f"not {vehicle.config.autopilot}"
        interval_us = max(s.interval_us(message_id) for s in streams)
        rate = f"{1e6 / interval_us:g}" if interval_us > 0 else "on request"
        note = "; ".join(filter(None, (only, note_of(message_id))))
        rows.append((f"{name_of(message_id)} ({message_id})", rate, note))
    text = (
        "At any rate up to 100 Hz with SET_MESSAGE_INTERVAL, or once with REQUEST_MESSAGE. Hz: sent"
        " unasked on a link that has spoken, each link on its own."
    )
    return f"{text}\n\n{_table(('message', 'Hz', ''), rows)}"


def _parameters() -> str:
    parts = ["Values are in the unit that clients see. *Kept*: shown and stored, but not used."]
    for personality in ("ardupilot", "px4"):
        for kind, shown in KINDS.items():
            config = VehicleConfig(
                kind=kind, system_id=1, autopilot=personality, profile="ardupilot"
            )
            vehicle = Vehicle(config)
            rows = [
                (
                    p.name,
                    f"{default:g}",
                    p.unit,
                    "kept" if p.is_kept_only else "read-only" if p.read_only else "",
                    p.text,
                )
                for _, p, _, default in vehicle.parameters
            ]
            header = ("name", "default", "unit", "", "what it is")
            parts.append(f"### {personality}, {shown}\n\n{_table(header, rows)}")
    return "\n\n".join(parts)


def _command(number: int) -> str:
    return str(mav.enums["MAV_CMD"][number].name).removeprefix("MAV_CMD_")


def _kinds(kinds: Iterable[str]) -> str:
    kinds = sorted(kinds)
    return "both" if len(kinds) == len(KINDS) else KINDS[kinds[0]]


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    def lines() -> Iterator[str]:
        yield _line(header)
        yield _line(["---"] * len(header))
        yield from map(_line, rows)

    return "\n".join(lines())


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |".replace("|  |", "| |")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
