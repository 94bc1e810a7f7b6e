"""The table printed when a run starts: where outside programs can connect."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

MAX_LINES = 8  # of one vehicle each; more become ranges
_HEADS = ("vehicle", "id", "MAVLink sent to (UDP)", "served at (TCP)")
_TCP_APART = 10  # between the ports of one vehicle and the next
Ports = Mapping[str, Any]  # of one vehicle, as ports.json has them
_Steps = tuple[int, ...]  # from one vehicle to the next: of each UDP port, and of the TCP port


def ports_table(ports: Mapping[str, Any]) -> RenderableType:
    """Return a line per vehicle, or of many vehicles a line per range."""
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="dim")
    for head in _HEADS:
        table.add_column(head, no_wrap=True)
    vehicles = [(name, p) for name, p in ports.items() if isinstance(p, Mapping)]
    if len(vehicles) <= MAX_LINES:
        for name, p in vehicles:
            table.add_row(name, str(p["system_id"]), *_places(p))
        return table
    ranges = _ranges(vehicles)
    for members in ranges[:MAX_LINES]:
        table.add_row(*_row(members))
    rest = sum(map(len, ranges[MAX_LINES:]))
    note = f"and {rest} more; " if rest else ""
    if any(len(members) > 1 and members[0][1]["tcp"] for members in ranges[:MAX_LINES]):
        note += f"TCP ports in a range are {_TCP_APART} apart; "
    return Group(table, Text(f"{note}each vehicle's own: ports.json", style="dim"))


def _places(p: Ports) -> tuple[str, str]:
    if "connect" in p:
        return "external", p["connect"]
    return ", ".join(p["udp"]) or "-", p["tcp"] or "-"


def _ranges(vehicles: Sequence[tuple[str, Ports]]) -> list[list[tuple[str, Ports]]]:
    """Return the vehicles in groups whose names, ids and ports count up, one by one."""
    groups: list[list[tuple[str, Ports]]] = []
    steps: _Steps | None = None  # in the last group, of more than one
    for vehicle in vehicles:
        found = _steps(groups[-1][-1], vehicle) if groups else None
        if found is None or (len(groups[-1]) > 1 and found != steps):
            groups.append([vehicle])
        else:
            groups[-1].append(vehicle)
            steps = found
    return groups


def _steps(one: tuple[str, Ports], other: tuple[str, Ports]) -> _Steps | None:
    """Return how the ports go on from one vehicle to the next, None where that is no range."""
    (prefix, number), (other_prefix, other_number) = _split(one[0]), _split(other[0])
    p, q = one[1], other[1]
    if (
        "connect" in p
        or "connect" in q
        or (other_prefix, other_number) != (prefix, number + 1)
        or q["system_id"] != p["system_id"] + 1
        or len(q["udp"]) != len(p["udp"])
    ):
        return None
    udp = [_apart(a, b) for a, b in zip(p["udp"], q["udp"], strict=True)]
    tcp = _apart(p["tcp"] or "", q["tcp"] or "")
    if tcp not in (0, _TCP_APART) or any(step not in (0, 1) for step in udp):
        return None
    return (*(step or 0 for step in udp), tcp)


def _apart(one: str, other: str) -> int | None:
    """Return how far apart the ports of two addresses are, None for those of different hosts."""
    if one == other:
        return 0
    (host, _, port), (other_host, _, other_port) = one.rpartition(":"), other.rpartition(":")
    return int(other_port) - int(port) if host == other_host else None


def _split(name: str) -> tuple[str, int]:
    """Return a name without the number at its end, and that number."""
    digits = re.search(r"\d{0,9}$", name)
    tail = digits.group() if digits else ""
    return name.removesuffix(tail), int(tail or -2)


def _row(members: Sequence[tuple[str, Ports]]) -> tuple[str, str, str, str]:
    (name, p), (last_name, q) = members[0], members[-1]
    if len(members) == 1:
        return (name, str(p["system_id"]), *_places(p))
    udp = [_span(a, b) for a, b in zip(p["udp"], q["udp"], strict=True)]
    host = udp[0].rpartition(":")[0] + ":" if udp else ""
    more = [text.removeprefix(host) for text in udp[1:]]
    return (
        f"{name}..{last_name}",
        _span(str(p["system_id"]), str(q["system_id"])),
        ", ".join([*udp[:1], *more]) or "-",
        _span(p["tcp"], q["tcp"]) if p["tcp"] else "-",
    )


def _span(first: str, last: str) -> str:
    """Return `host:1..9` for two addresses, or the one that both are."""
    return first if first == last else f"{first}..{last.rpartition(':')[2]}"
