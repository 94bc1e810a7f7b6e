"""The comparison at a terminal: what differs from the start, a table, what is to be known."""

from collections.abc import Iterator, Sequence

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from .labels import place
from .lineup import LineUp
from .measures import Standing
from .words import LEGEND, head, mark, setting, shown

FEW = 5  # runs that stand side by side; more stand below one another
MAX_SETTINGS = 8
MAX_LABEL = 26  # letters on one line
_FIRST = "collisions", "nearest_rovers", "nearest_quads", "last_arrival_s"


def comparison(found: LineUp, standings: Sequence[Standing]) -> RenderableType:
    """Return what a terminal shows of a comparison."""
    few = len(found.runs) <= FEW
    table = _side_by_side(found, standings) if few else _below_one_another(found, standings)
    marked = any(standing.best or standing.worst for standing in standings)
    legend = [Text(LEGEND, style="dim")] if marked else []
    return Group(table, *legend, *_settings(found), *notes(found))


def notes(found: LineUp) -> Iterator[Text]:
    """Yield what is to be known of single runs."""
    for run in found.runs:
        if run.flown.partial:
            text = f"{run.label} is partial: {'; '.join(run.flown.missing)}"
            yield Text(text, style="yellow")
        elif error := run.report.get("error"):
            yield Text(f"{run.label} ended with: {error}", style="yellow")
    if len(found.scenarios) > 1:
        yield Text(f"different scenarios: {', '.join(found.scenarios)}", style="yellow")


def _side_by_side(found: LineUp, standings: Sequence[Standing]) -> Table:
    table = _table()
    table.add_column("", no_wrap=True)
    for run in found.runs:
        table.add_column(run.label, justify="right", overflow="fold")
    table.add_row("verdict", *(_verdict(bool(run.report["passed"])) for run in found.runs))
    for standing in standings:
        cells = [_cell(standing, k) for k in range(len(found.runs))]
        table.add_row(head(standing.measure), *cells)
    return table


def _below_one_another(found: LineUp, standings: Sequence[Standing]) -> Table:
    table = _table()
    longest = max(len(run.label) for run in found.runs)
    table.add_column("run", overflow="fold", no_wrap=longest <= MAX_LABEL)
    table.add_column("verdict", no_wrap=True)
    chosen = [s for s in standings if s.measure.key in _FIRST]
    for standing in chosen:
        longest = max(len(word) for word in head(standing.measure).split())
        table.add_column(head(standing.measure), justify="right", min_width=longest)
    for k, run in enumerate(found.runs):
        cells = [_cell(standing, k) for standing in chosen]
        table.add_row(run.label, _verdict(bool(run.report["passed"])), *cells)
    return table


def _settings(found: LineUp) -> Iterator[RenderableType]:
    """Yield a table of what the runs were told differently."""
    if not found.settings:
        yield Text("no setting differs")
        return
    few = len(found.runs) <= FEW
    table = _table()
    table.add_column("differs", no_wrap=False, overflow="fold")
    for run in found.runs if few else ():
        table.add_column(run.label, justify="right", overflow="fold")
    if not few:
        table.add_column("values", overflow="fold")
    alike = len(found.scenarios) == 1
    keys = [key for key in found.settings if alike or place(key) == 0][:MAX_SETTINGS]
    for key in keys:
        values = found.settings[key]
        if few:
            table.add_row(key, *map(setting, values))
        else:
            table.add_row(key, ", ".join(dict.fromkeys(map(setting, values))))
    yield Text("")
    yield table
    if (more := len(found.settings) - len(keys)) > 0:
        yield Text(f"and {more} more keys, on the page", style="dim")


def _cell(standing: Standing, run: int) -> Text:
    sign = mark(standing, run)
    text = shown(standing.measure, standing.values[run])
    style = "bold green" if run in standing.best else "red" if run in standing.worst else ""
    return Text(f"{text} {sign or ' '}", style=style)


def _verdict(passed: bool) -> Text:
    return Text("PASS  " if passed else "FAIL  ", style="bold green" if passed else "bold red")


def _table() -> Table:
    return Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="dim")
