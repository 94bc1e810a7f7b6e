"""What `mavherd check` found out about external vehicles: as a table, as lines, as JSON."""

from collections.abc import Iterator, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from ..safety.preflight import Check
from .live_check import Finding


def progress(findings: Sequence[Finding], left: float) -> RenderableType:
    """Return who waits for what, while there is time left (s): a line or two for each vehicle."""
    grid = _grid(max(len(one.spec.name) for one in findings))
    for one in findings:
        name = Text(one.spec.name, style="bold")
        if not one.missing:
            grid.add_row(name, Text("ready", style="green"), "", "")
        for check in one.missing:
            grid.add_row(name, _word(check), check.name, check.text)
            name = Text("")
    return Group(grid, Text(f"waiting, {left:.0f} s left", style="dim"))


def table(findings: Sequence[Finding]) -> RenderableType:
    """Return every check of every vehicle, for a terminal."""
    parts: list[RenderableType] = []
    for one in findings:
        parts.append(Text.assemble((one.spec.name, "bold"), (f"  {_about(one)}", "dim")))
        grid = _grid(0)
        for check in _told(one):
            found = Text(check.text)
            if check.cure and check.ok is not True:
                found.append(f"\n{check.cure}", style="dim")
            grid.add_row("", _word(check), check.name, found)
        parts.append(grid)
    return Group(*parts)


def lines(findings: Sequence[Finding]) -> Iterator[str]:
    """Yield the same as plain lines, for files and pipes."""
    for one in findings:
        yield f"{one.spec.name}: {_about(one)}"
        for check in _told(one):
            yield f"  {_mark(check)[0]:8}{check.name:10}{check.text}"
            if check.cure and check.ok is not True:
                yield f"{'':20}{check.cure}"


def summary(findings: Sequence[Finding]) -> str:
    """Return in one line who waits for what; "" when all are ready."""
    return "; ".join(
        f"{one.spec.name} ({', '.join(check.name for check in one.missing)})"
        for one in findings
        if one.missing
    )


def as_json(scenario: str, findings: Sequence[Finding]) -> dict[str, Any]:
    """Return the findings as plain data."""
    return {
        "scenario": scenario,
        "ready": not any(one.missing for one in findings),
        "vehicles": {
            one.spec.name: {
                "connect": one.spec.connect,
                "system_id": one.spec.system_id,
                "ready": not one.missing,
                "checks": [check._asdict() for check in one.checks],
            }
            for one in findings
        },
    }


def _about(one: Finding) -> str:
    return f"{one.spec.kind} at {one.spec.connect}, system {one.spec.system_id}"


def _told(one: Finding) -> Iterator[Check]:
    """Yield the checks worth a line: without a link nothing is known of the rest."""
    return (check for check in one.checks if check.text)


def _grid(first: int) -> Table:
    grid = Table.grid(padding=(0, 2, 0, 0))
    for width in (first, len("missing"), len("position")):
        grid.add_column(no_wrap=True, width=width)
    grid.add_column(overflow="fold")
    return grid


def _word(check: Check) -> Text:
    word, style = _mark(check)
    return Text(word, style=style)


def _mark(check: Check) -> tuple[str, str]:
    """Return word and style of a check's outcome."""
    match check.ok, check.required:
        case True, _:
            return "ok", "green"
        case False, True:
            return "missing", "bold red"
        case False, False:
            return "note", "yellow"
    return ("waiting", "yellow") if check.required else ("-", "dim")
