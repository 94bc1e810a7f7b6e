"""How our pages look: one style sheet, light, dark and printed, and the frame of a page.

A page is one file that loads nothing and runs no script. Figures inside it take their colours from
here too (`INK`, `PALETTE`, ...: see figure_svg.py), so that they are dark where the page is dark.
"""

from collections.abc import Iterable
from html import escape

# Colour by variable: in light, in dark. Okabe and Ito's palette, dark ones lightened.
COLOURS = {
    "page": ("#ffffff", "#13171b"),
    "card": ("#f6f8fa", "#1d2329"),
    "line": ("#d5dae0", "#39414a"),
    "text": ("#1b1f24", "#e8ebee"),
    "soft": ("#59636e", "#a5afb9"),
    "good": ("#0b6b3a", "#56c98b"),
    "bad": ("#b3261e", "#ff8a80"),
    "link": ("#0b5cad", "#7ab8f5"),
    "grid": ("#e4e7eb", "#2a3138"),
    "path": ("#9aa4ae", "#6f7983"),
    "shade": ("#000000", "#ffffff"),
    "edge": ("#bcc4cc", "#5a656f"),
    "blue": ("#0072b2", "#4ba3e3"),
    "vermilion": ("#d55e00", "#ff8c42"),
    "green": ("#009e73", "#35c99b"),
    "pink": ("#cc79a7", "#ee9cc8"),
    "ochre": ("#b07a00", "#e0b04a"),
    "sky": ("#56b4e9", "#a8dcff"),
    "grey": ("#444444", "#c9ced3"),
    "violet": ("#8a6fbf", "#b8a1ea"),
    "teal": ("#00795a", "#2bb58c"),
}
HEAT = {  # how near a pair came: background and text, the nearest first
    "light": ("#8c2d04 #fff", "#f2a057 #1b1f24", "#fbd0a6 #1b1f24", "#fdeedd #1b1f24"),
    "dark": ("#ffb27a #13171b", "#a5541b #fff", "#663a1b #fff", "#3a2a1f #e8ebee"),
}


def _variables(theme: str) -> str:
    column = ("light", "dark").index(theme)
    plain = [f"--{name}: {colours[column]};" for name, colours in COLOURS.items()]
    heat = [pair.split() for pair in HEAT[theme]]
    warm = [f"--heat{k}: {back}; --on{k}: {front};" for k, (back, front) in enumerate(heat)]
    return " ".join(plain + warm)


STYLE = (
    f"""
:root {{ color-scheme: light dark; {_variables("light")} }}
@media screen and (prefers-color-scheme: dark) {{ :root {{ {_variables("dark")} }} }}
"""
    + """
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; text-size-adjust: 100%; }
body { margin: 0 auto; padding: 2rem 1.25rem 4rem; max-width: 66rem; color: var(--text);
  background: var(--page); font: 16px/1.5 system-ui, sans-serif; }
h1 { margin: 0; font-size: 1.7rem; line-height: 1.25; overflow-wrap: anywhere; }
h2 { margin: 2.6rem 0 .5rem; font-size: 1.2rem; }
h3 { margin: 1.6rem 0 .4rem; font-size: 1rem; }
p { margin: .35rem 0; max-width: 46rem; overflow-wrap: anywhere; }
a { color: var(--link); }
code, pre { font-family: ui-monospace, monospace; font-size: .9em; }
.soft { color: var(--soft); } .good { color: var(--good); } .bad { color: var(--bad); }
.best { font-weight: 700; } .num { text-align: right; }
.verdict { font-weight: 700; letter-spacing: .02em; }
.note { border-left: 3px solid var(--bad); padding: .1rem 0 .1rem .8rem; margin: .5rem 0; }
.note ul { margin: .2rem 0; padding-left: 1.2rem; overflow-wrap: anywhere; }
ul.checks { list-style: none; padding: 0; margin: 1rem 0; border-top: 1px solid var(--line); }
ul.checks li { display: flex; gap: .8rem; padding: .35rem 0; border-bottom: 1px solid var(--line); }
ul.checks b { flex: 0 0 4rem; white-space: nowrap; }
ul.checks span { overflow-wrap: anywhere; min-width: 0; }
nav ul { display: flex; flex-wrap: wrap; gap: .2rem 1.1rem; list-style: none; padding: 0;
  margin: 1rem 0; font-size: .92rem; }
nav a { display: inline-block; padding: .25rem 0; }
dl.tiles { display: grid; grid-template-columns: repeat(auto-fill, minmax(9.6rem, 1fr));
  gap: .6rem; margin: 1rem 0; }
dl.tiles div { background: var(--card); border-radius: 8px; padding: .55rem .75rem; }
dt { color: var(--soft); font-size: .85rem; }
dd { margin: 0; font-size: 1.2rem; line-height: 1.35; overflow-wrap: anywhere; }
dd small { display: block; color: var(--soft); font-size: .8rem; }
figure { margin: 1.2rem 0 2rem; break-inside: avoid; }
figcaption { color: var(--soft); font-size: .9rem; max-width: 46rem; }
figure img, figure svg { display: block; width: 100%; height: auto; min-width: 42rem; }
figure svg { fill: var(--shade); } /* what SVG draws black by default */
figure img { background: #fff; border-radius: 6px; }
svg text { font-family: system-ui, sans-serif; }
svg .halo { stroke: var(--page); stroke-width: 2.5px;
  stroke-linejoin: round; }
.wide { overflow: auto; max-height: 44rem; margin: .4rem 0 1rem; background:
  linear-gradient(to left, var(--page) 2rem, transparent) right / 4rem 100% local,
  linear-gradient(to top, var(--page) 2rem, transparent) bottom / 100% 4rem local,
  linear-gradient(to left, var(--edge), transparent) right / .8rem 100% scroll,
  linear-gradient(to top, var(--edge), transparent) bottom / 100% .8rem scroll;
  background-repeat: no-repeat; } /* an edge is shaded where there is more beyond it */
figure .wide { max-height: none; margin: 0 0 .4rem; }
.wide:focus-visible, a:focus-visible { outline: 2px solid var(--link); outline-offset: 2px; }
table { border-collapse: separate; border-spacing: 0; font-variant-numeric: tabular-nums;
  font-size: .92rem; }
caption { text-align: left; color: var(--soft); font-size: .85rem; padding: 0 0 .3rem;
  max-width: calc(100vw - 2rem); }
th, td { text-align: left; padding: .28rem .9rem .28rem 0; white-space: nowrap;
  border-bottom: 1px solid var(--line); vertical-align: baseline; }
th { font-weight: 500; } thead th { color: var(--soft); font-size: .85rem; vertical-align: bottom;
  position: sticky; top: 0; z-index: 2; background: var(--page); }
tbody th { position: sticky; left: 0; z-index: 1; background: var(--page); }
thead th:first-child { left: 0; z-index: 3; }
td.num, th.num { text-align: right; }
table.matrix { font-size: .85rem; }
table.matrix th, table.matrix td { padding: .28rem .5rem; text-align: right; }
table.matrix td { border: 1px solid var(--page); min-width: 3.3rem; }
table.matrix tbody th { text-align: left; padding-left: 0; border: 0; }
table.matrix thead th:first-child { text-align: left; padding-left: 0; }
.heat0 { background: var(--heat0); color: var(--on0); font-weight: 700; }
.heat1 { background: var(--heat1); color: var(--on1); }
.heat2 { background: var(--heat2); color: var(--on2); }
.heat3 { background: var(--heat3); color: var(--on3); }
ul.key { display: flex; flex-wrap: wrap; gap: .4rem 1rem; list-style: none; padding: 0;
  margin: .3rem 0 1rem; font-size: .85rem; color: var(--soft); }
ul.key i { display: inline-block; font-style: normal; padding: 0 .5rem; border-radius: 3px;
  margin-right: .35rem; }
pre { background: var(--card); border-radius: 8px; padding: .8rem; overflow-x: auto;
  white-space: pre-wrap; overflow-wrap: anywhere; }
footer { margin-top: 2.5rem; border-top: 1px solid var(--line); padding-top: .6rem;
  font-size: .88rem; color: var(--soft); }
@media (max-width: 30rem) {
  body { padding: 1.2rem .9rem 3rem; } dl.tiles { grid-template-columns: 1fr 1fr; }
  h1 { font-size: 1.35rem; } dd { font-size: 1.05rem; }
}
@media print {
  @page { margin: 14mm; }
  html { font-size: 10pt; } body { padding: 0; max-width: none; font-size: 1rem; }
  nav { display: none; }
  h2, h3 { break-after: avoid; } h2 { margin-top: 1.6rem; }
  .wide { overflow: visible; max-height: none; background: none; } .scroll { display: none; }
  figure img, figure svg { min-width: 0; }
  table { font-size: 7.5pt; max-width: 100%; } caption, thead th { font-size: inherit; }
  th, td { padding: .15rem .5rem .15rem 0; white-space: normal; }
  thead th, tbody th { position: static; } thead { display: table-header-group; }
  tr, li, dl { break-inside: avoid; }
  table.matrix { font-size: 6.5pt; } table.matrix th, table.matrix td { padding: .1rem .2rem;
  min-width: 0; }
  .heat0, .heat1, .heat2, .heat3, dl.tiles div, pre { print-color-adjust: exact; }
}
"""
)


def document(title: str, body: Iterable[str]) -> str:
    """Return a whole page; `title` is plain text, `body` is HTML."""
    return "\n".join(
        [
            "<!doctype html>",
            '<html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{escape(title)}</title>",
            f"<style>{STYLE}</style></head>",
            "<body>",
            *body,
            "</body></html>",
            "",
        ]
    )
