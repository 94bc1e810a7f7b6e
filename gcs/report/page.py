"""The report as one self-contained web page, light or dark as the reader's system is."""

import base64
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

NONE = "&ndash;"
MAX_ROWS = 200  # of a table
_CAPTIONS = {
    "plan": "Tracks from above, a tick every five seconds, robots drawn to size.",
    "separation": "Smallest separation of each class over time; at the dashed line robots touch.",
}
_STYLE = """
:root { color-scheme: light dark; --text: #1b1f24; --soft: #59636e; --line: #d5dae0;
  --card: #f6f8fa; --page: #fff; --good: #0b6b3a; --bad: #b3261e; }
@media (prefers-color-scheme: dark) { :root { --text: #e8ebee; --soft: #9aa4ae; --line: #353c44;
  --card: #1c2127; --page: #13171b; --good: #56c98b; --bad: #ff8a80; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2rem 1.25rem 4rem; max-width: 60rem; color: var(--text);
  background: var(--page); font: 16px/1.5 system-ui, sans-serif; }
h1 { margin: 0; font-size: 1.6rem; } h2 { margin: 2.2rem 0 .6rem; font-size: 1.1rem; }
p { margin: .3rem 0; } .soft { color: var(--soft); }
.good { color: var(--good); } .bad { color: var(--bad); }
.verdict { font-weight: 700; }
ul.checks { list-style: none; padding: 0; margin: 1rem 0; }
ul.checks li { padding: .35rem 0; border-top: 1px solid var(--line); }
ul.checks b { display: inline-block; width: 4rem; }
dl { display: grid; grid-template-columns: repeat(auto-fit, minmax(10.5rem, 1fr)); gap: .75rem;
  margin: 1rem 0; }
dl div { background: var(--card); border-radius: 8px; padding: .6rem .8rem; }
dt { color: var(--soft); font-size: .85rem; } dd { margin: 0; font-size: 1.15rem; }
figure { margin: 1rem 0; } figcaption { color: var(--soft); font-size: .9rem; }
img { width: 100%; height: auto; background: #fff; border: 1px solid var(--line);
  border-radius: 8px; display: block; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .3rem .9rem .3rem 0; border-bottom: 1px solid var(--line);
  white-space: nowrap; }
th { color: var(--soft); font-weight: 500; font-size: .85rem; }
td.n, th.n { text-align: right; }
pre { background: var(--card); border-radius: 8px; padding: .8rem; overflow-x: auto;
  font-size: .9rem; }
"""


def page(report: Mapping[str, Any], pictures: Sequence[Path]) -> str:
    """Return the whole page; the pictures are inside it."""
    r = report
    title = f"{escape(r['scenario'])}: {'passed' if r['passed'] else 'failed'}"
    return "\n".join(
        [
            "<!doctype html>",
            '<html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{title}</title><style>{_STYLE}</style></head><body>",
            *_verdict(r),
            *_numbers(r),
            *_figures(pictures),
            *_robots(r),
            *_separations(r),
            *_collisions(r),
            *_again(r),
            "</body></html>",
            "",
        ]
    )


def _verdict(r: Mapping[str, Any]) -> Iterator[str]:
    tone, word = ("good", "Passed") if r["passed"] else ("bad", "Failed")
    yield f'<p class="verdict {tone}">{word}</p>'
    yield f"<h1>{escape(r['scenario'])}</h1>"
    if r["description"]:
        yield f'<p class="soft">{escape(r["description"])}</p>'
    if r["error"]:
        yield f'<p class="bad">{escape(r["error"])}</p>'
    if r["partial"]:
        yield '<p class="bad">Partial: some files of this run are missing or incomplete.</p>'
    if n := r["outside_clients"]:
        yield f"<p>{n} outside client{'s' * (n > 1)} took part, and may have steered: another run "
        yield "of this seed may differ.</p>"
    yield '<ul class="checks">'
    for a in r["assertions"]:
        tone, word = ("good", "pass") if a["passed"] else ("bad", "FAIL")
        yield f'<li><b class="{tone}">{word}</b>{escape(a["text"])}</li>'
    if not r["assertions"]:
        yield '<li class="soft">The scenario asserts nothing (no <code>expect</code>).</li>'
    yield "</ul>"


def _numbers(r: Mapping[str, Any]) -> Iterator[str]:
    arrivals = [x["arrival_s"] for x in r["robots"] if x["arrival_s"] is not None]
    last = f"{max(arrivals):.1f} s" if arrivals else NONE
    yield "<dl>"
    for name, value in (
        ("Robots", f"{len(r['robots'])}"),
        ("Collisions", f"{r['collisions']}"),
        ("Smallest separation", _metres(r["min_separation_m"])),
        ("All arrived", "yes" if r["all_arrived"] else "no"),
        ("Last arrival", last),
        ("Simulated", f"{r['duration_s']:.1f} s"),
        ("Real-time factor", f"{_number(r['real_time_factor'], 1)}&times;"),
        ("Coordination law", escape(r["law"])),
    ):
        yield f"<div><dt>{name}</dt><dd>{value}</dd></div>"
    yield "</dl>"


def _figures(pictures: Sequence[Path]) -> Iterator[str]:
    for picture in pictures:
        data = base64.b64encode(picture.read_bytes()).decode()
        caption = _CAPTIONS.get(picture.stem, picture.stem)
        yield f'<figure><img alt="{caption}" src="data:image/png;base64,{data}">'
        yield f"<figcaption>{caption}</figcaption></figure>"


def _robots(r: Mapping[str, Any]) -> Iterator[str]:
    yield "<h2>Robots</h2>"
    yield from _table(
        ("robot", "kind", "goal", "arrived", "after s", "miss m", "way ratio", "RMSE m", "nearest"),
        [
            (
                escape(x["name"]) + ("*" if x["source"] == "telemetry" else ""),
                x["kind"],
                x["goal"],
                {True: "yes", False: '<span class="bad">no</span>', None: NONE}[x["arrived"]],
                _number(x["arrival_s"], 1),
                _number(x["miss_m"], 2),
                _number(x["path_ratio"], 2),
                _number(x["tracking_rmse_m"], 3),
                f"{_metres(x['nearest_separation_m'])} {escape(x['nearest'] or '')}",
            )
            for x in r["robots"]
        ],
        numbers=range(4, 8),
    )
    if any(x["source"] == "telemetry" for x in r["robots"]):
        yield '<p class="soft">* External: judged by its own telemetry, not by truth.</p>'


def _separations(r: Mapping[str, Any]) -> Iterator[str]:
    if not r["classes"]:
        return
    yield "<h2>Separation, centre to centre</h2>"
    yield (
        '<p class="soft">From the moment when all were ready. In space between quadcopters; in '
        "the plane between rovers, and between a rover and a quadcopter low enough to meet it.</p>"
    )
    yield from _table(
        ("class", "pairs", "smallest m", "contact at m", "collisions", "between", "at s"),
        [
            (
                x["class"],
                str(x["pairs"]),
                _number(x["min_separation_m"], 3),
                _number(x["contact_m"], 3),
                str(x["collisions"]),
                escape(" and ".join(x["robots"])) if x["robots"] else NONE,
                _number(x["time_s"], 1),
            )
            for x in r["classes"]
        ],
        numbers=(1, 2, 3, 4, 6),
    )


def _collisions(r: Mapping[str, Any]) -> Iterator[str]:
    if not r["collision_events"]:
        return
    yield "<h2>Collisions</h2>"
    yield from _table(
        ("at s", "robots", "class", "east m", "north m", "up m"),
        [
            (
                _number(x["time_s"], 2),
                escape(" and ".join(x["robots"])),
                x["class"],
                *(_number(x[axis], 2) for axis in ("east_m", "north_m", "up_m")),
            )
            for x in r["collision_events"]
        ],
        numbers=(0, 3, 4, 5),
    )


def _again(r: Mapping[str, Any]) -> Iterator[str]:
    mode = "" if r["lockstep"] else " --free-run"
    yield "<h2>Look closer, run again</h2>"
    yield '<p class="soft">In this folder:</p>'
    yield f"<pre>rerun run.rrd\nmavherd run scenario.yaml --seed {r['seed']}{mode}</pre>"
    digest = r["digest"] or "none (the run did not finish, or was not in lockstep)"
    yield f'<p class="soft">Run {escape(r["run_id"])}, mavherd {escape(r["version"])} '
    yield f"({escape(r['compiled'])}), Python {escape(r['python'])}, {escape(r['platform'])}. "
    yield f"{r['late_ticks']} of {r['ticks']} ticks late; {r['outside_clients']} outside clients."
    yield f'<br>Digest <span style="overflow-wrap:anywhere">{escape(digest)}</span></p>'


def _table(
    heads: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int]
) -> Iterator[str]:
    tone = ["n" if k in numbers else "" for k in range(len(heads))]
    yield '<div class="wide"><table><tr>'
    yield "".join(f'<th class="{t}">{h}</th>' for t, h in zip(tone, heads, strict=True)) + "</tr>"
    for row in rows[:MAX_ROWS]:
        cells = (f'<td class="{t}">{cell}</td>' for t, cell in zip(tone, row, strict=True))
        yield f"<tr>{''.join(cells)}</tr>"
    yield "</table></div>"
    if len(rows) > MAX_ROWS:
        yield f'<p class="soft">… and {len(rows) - MAX_ROWS} more in report.json.</p>'


def _number(value: float | None, digits: int) -> str:
    return NONE if value is None else f"{value:.{digits}f}"


def _metres(value: float | None) -> str:
    return NONE if value is None else f"{value:.2f} m"
