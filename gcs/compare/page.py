"""The comparison as one self-contained page, in the style of the report."""

from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from shlex import quote

from ..report.page_figures import figure
from ..report.page_parts import table
from ..report.page_style import document
from .lineup import LineUp
from .measures import Standing
from .words import BEST, LEGEND, head, mark, setting, shown

MAX_SETTINGS = 60
FEW = 6  # runs that stand side by side; more stand below one another
_FIGURES = {
    "tracks": (
        "Tracks of all runs from above, over one another",
        "Tracks from above, from the moment when all were ready until the last robot had arrived; a"
        " dot where each was then. A collision has the colour of its run.",
    ),
    "separations": (
        "Smallest separation over time, a line for each run",
        "Smallest separation of each class of pairs, centre to centre; in the shaded part robots"
        " touch.",
    ),
}


def page(
    found: LineUp,
    measured: Sequence[Standing],
    pictures: Sequence[Path] = (),
    recording: Path | None = None,
) -> str:
    """Return the whole page; the pictures (PNGs, with an SVG beside each) are inside it."""
    scenarios = ", ".join(found.scenarios)
    return document(
        f"{len(found.runs)} runs of {scenarios}",
        [
            *_top(found, scenarios),
            "<main>",
            *_numbers(found, measured),
            *_settings(found),
            *_figures(pictures),
            *_runs(found, recording),
            "</main>",
        ],
    )


def _top(found: LineUp, scenarios: str) -> Iterator[str]:
    yield "<header>"
    yield f"<h1>{len(found.runs)} runs of {escape(scenarios)}</h1>"
    passed = sum(bool(run.report["passed"]) for run in found.runs)
    yield f'<p class="soft">{passed} of {len(found.runs)} passed</p>'
    if len(found.scenarios) > 1:
        yield '<p class="note">These are runs of different scenarios: their numbers say little of '
        yield "one another.</p>"
    for run in found.runs:
        if run.flown.partial:
            reasons = "; ".join(run.flown.missing)
            yield f'<p class="note bad">{escape(run.label)} is partial: {escape(reasons)}</p>'
    yield "</header>"


def _numbers(found: LineUp, measured: Sequence[Standing]) -> Iterator[str]:
    """Yield the one table: few runs side by side, many below one another."""
    yield '<h2 id="numbers">Numbers</h2>'
    labels = [escape(run.head) for run in found.runs]
    verdicts = [_verdict(bool(run.report["passed"])) for run in found.runs]
    heads = [escape(head(standing.measure)) for standing in measured]
    cells = [[_cell(standing, k) for standing in measured] for k in range(len(found.runs))]
    rows = [[label, v, *c] for label, v, c in zip(labels, verdicts, cells, strict=True)]
    marked = any(standing.best or standing.worst for standing in measured)
    caption = LEGEND if marked else "Numbers of each run"
    if len(found.runs) > FEW:
        yield from table(caption, ["run", "verdict", *heads], rows, words=(0, 1))
        return
    turned = [list(row) for row in zip(["number", "verdict", *heads], *rows, strict=True)]
    yield from table(caption, turned[0], turned[1:])


def _cell(standing: Standing, run: int) -> str:
    text = shown(standing.measure, standing.values[run])
    sign = mark(standing, run)
    if not sign:
        return text
    tone = "best" if sign == BEST else "soft"
    return f'<span class="{tone}"><span class="soft">{sign}</span>&nbsp;{text}</span>'


def _verdict(passed: bool) -> str:
    tone, word = ("good", "✓ passed") if passed else ("bad", "✕ failed")
    return f'<span class="{tone}">{word}</span>'


def _settings(found: LineUp) -> Iterator[str]:
    yield '<h2 id="settings">What differs between them</h2>'
    if not found.settings:
        yield "<p>No setting does: runs of one scenario and one seed.</p>"
        return
    few = len(found.runs) <= FEW
    heads = ["key", *(escape(run.label) for run in found.runs)] if few else ["key", "values"]
    rows = []
    for key, values in list(found.settings.items())[:MAX_SETTINGS]:
        said = [escape(setting(value)) for value in values]
        rows.append([f"<code>{escape(key)}</code>", *(said if few else [_each_once(said)])])
    words = (0,) if few else (0, 1)
    caption = "Keys as <code>--set</code> takes them"
    yield from table(caption, heads, rows, words=words, label="Settings")
    if (more := len(found.settings) - len(rows)) > 0:
        yield f'<p class="soft">… and {more} more in compare.json.</p>'


def _each_once(said: Sequence[str]) -> str:
    return ", ".join(dict.fromkeys(said))


def _figures(pictures: Sequence[Path]) -> Iterator[str]:
    if pictures:
        yield '<h2 id="figures">Figures</h2>'
    for picture in pictures:
        yield from figure(picture, *_FIGURES[picture.stem])


def _runs(found: LineUp, recording: Path | None) -> Iterator[str]:
    yield '<h2 id="runs">The runs</h2>'
    rows = [
        [
            escape(run.label),
            escape(run.flown.scenario.name),
            escape(str(run.report.get("run_id") or "")),
            f"<code>{escape(str(run.report.get('digest') or 'none')[:16])}</code>",
            escape(str(run.report.get("error") or "")),
        ]
        for run in found.runs
    ]
    heads = ("run", "scenario", "folder", "digest", "ended with")
    yield from table("Where they are, and how they ended", heads, rows, words=range(5))
    folders = [quote(str(run.flown.folder.resolve())) for run in found.runs]
    if recording:
        yield "<p>All of them in one recording, on one timeline:</p>"
        yield f"<pre>mavherd view {escape(quote(str(recording.resolve())))}</pre>"
    yield "<p>To compare again, and to see where two of them part, message by message:</p>"
    again, two = escape(" ".join(folders)), escape(" ".join(folders[:2]))
    yield f"<pre>mavherd compare {again}\nmavherd diff {two}</pre>"
