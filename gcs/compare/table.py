"""The comparison at a terminal: what differs from the start, a table, what is to be known."""

from collections.abc import Iterator, Sequence
from textwrap import wrap

from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from .labels import place
from .lineup import LineUp
from .measures import Standing
from .words import LEGEND, head, mark, setting, shown

FEW = 5  # runs that stand side by side; more stand below one another
MAX_SETTINGS = 8
MAX_LABEL = 26  # letters on one line
_HEADS = 13, 8  # letters on a line of a column's head: what is tried
_LEAST = 3  # columns of the table that has a line for each run
_WIDE = 10_000  # columns: more than any table has
_FIRST = "collisions", "nearest_rovers", "nearest_quads", "last_arrival_s"


def comparison(found: LineUp, standings: Sequence[Standing], console: Console) -> RenderableType:
    """Return what a terminal shows of a comparison: side by side where no word has to be broken."""
    few = [_side_by_side(found, standings, least) for least in _HEADS if len(found.runs) <= FEW]
    fitting = [table for table in few if _fits(table, console)]
    table = fitting[0] if fitting else _below_one_another(found, standings, console)
    marked = any(standing.best or standing.worst for standing in standings)
    legend = [Text(LEGEND, style="dim")] if marked else []
    return Group(table, *legend, *_settings(found, console), *notes(found))


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


def _side_by_side(found: LineUp, standings: Sequence[Standing], least: int) -> Table:
    table = _table()
    table.add_column("")
    for run in found.runs:
        table.add_column(_wrapped(run.head, least), justify="right")
    table.add_row("verdict", *(_verdict(bool(run.report["passed"])) for run in found.runs))
    for standing in standings:
        cells = [_cell(standing, k) for k in range(len(found.runs))]
        table.add_row(head(standing.measure), *cells)
    return table


def _below_one_another(found: LineUp, standings: Sequence[Standing], console: Console) -> Table:
    """Return a line for each run, with as many of the first measures as there is room for."""
    chosen = [s for s in standings if s.measure.key in _FIRST]
    table = _table()
    table.add_column("run")
    table.add_column("verdict")
    for standing in chosen:
        table.add_column(_wrapped(head(standing.measure), 8), justify="right")
    for k, run in enumerate(found.runs):
        cells = [_cell(standing, k) for standing in chosen]
        name = _wrapped(run.head, MAX_LABEL)
        table.add_row(name, _verdict(bool(run.report["passed"])), *cells)
    while not _fits(table, console) and len(table.columns) > _LEAST:
        table.columns.pop()
    return table


def _settings(found: LineUp, console: Console) -> Iterator[RenderableType]:
    """Yield a table of what the runs were told differently."""
    if not found.settings:
        yield Text("no setting differs")
        return
    alike = len(found.scenarios) == 1
    keys = [key for key in found.settings if alike or place(key) == 0][:MAX_SETTINGS]
    table = _table()
    table.add_column("differs")
    for run in found.runs:
        table.add_column(_wrapped(run.label, _HEADS[0]), justify="right")
    for key in keys:
        table.add_row(key, *(_wrapped(setting(v), MAX_LABEL) for v in found.settings[key]))
    few = len(found.runs) <= FEW
    if not (few and _fits(table, console)):
        table = _table()
        table.add_column("differs", overflow="fold")
        table.add_column("values, run by run" if few else "values", overflow="fold")
        for key in keys:
            said = list(map(setting, found.settings[key]))
            table.add_row(key, " | ".join(said) if few else ", ".join(dict.fromkeys(said)))
    yield Text("")
    yield table
    if (more := len(found.settings) - len(keys)) > 0:
        yield Text(f"and {more} more keys, on the page", style="dim")


def _fits(table: Table, console: Console) -> bool:
    wide = console.options.update(width=_WIDE)
    return console.measure(table, options=wide).maximum <= console.width


def _wrapped(text: str, width: int) -> str:
    """Return lines of that width, or as wide as the longest word: none is broken."""
    longest = max(map(len, text.split()), default=1)
    return "\n".join(wrap(text, max(width, longest), break_on_hyphens=False))


def _cell(standing: Standing, run: int) -> Text:
    sign = mark(standing, run)
    text = shown(standing.measure, standing.values[run])
    style = "bold green" if run in standing.best else "red" if run in standing.worst else ""
    return Text(f"{text} {sign or ' '}", style=style)


def _verdict(passed: bool) -> Text:
    return Text("PASS  " if passed else "FAIL  ", style="bold green" if passed else "bold red")


def _table() -> Table:
    return Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="dim")
