"""How near robots came, as tables: a matrix of all pairs, the nearest pairs, the collisions."""

from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

from .page_parts import NONE, names, number, scrolled, since_ready, table, time_base, unit

MATRIX = 24  # robots; of a larger team only the nearest pairs are listed
NEAREST = 30
_HEAT = (1.0, 1.5, 2.0, 3.0)  # contact distances
_KEY = ("touched", "nearer than 1.5 contact distances", "than 2", "than 3")


def separations(r: Mapping[str, Any]) -> Iterator[str]:
    """Yield the smallest separation by class and by pair."""
    if not r.get("classes"):
        return
    yield '<h2 id="separation">Separation</h2>'
    yield (
        "<p>Centre to centre, from when all were ready: in space between quadcopters, "
        "in the plane between rovers, and in the plane between a rover and a quadcopter that is "
        "low enough to meet it.</p>"
    )
    yield from table(
        f"Smallest separation of each class; {time_base(r)}",
        ("class", "pairs", "smallest, m", "contact at, m", "collisions", "between", "time, s"),
        [
            (
                x["class"],
                str(x["pairs"]),
                number(x["min_separation_m"], 3),
                number(x["contact_m"], 3),
                str(x["collisions"]),
                names(x["robots"]),
                number(since_ready(r, x["time_s"]), 1),
            )
            for x in r["classes"]
        ],
        words=(0, 5),
    )
    every_pair = len(r["pairs"]) == r.get("pairs_total", len(r["pairs"]))
    if len(r["robots"]) <= MATRIX and every_pair:
        yield from _matrix(r)
    else:
        yield from _nearest(r)


def _matrix(r: Mapping[str, Any]) -> Iterator[str]:
    cells = {frozenset(p["robots"]): _cell(p, _touched(r)) for p in r["pairs"]}
    team = [x["name"] for x in r["robots"]]
    heads = "".join(f'<th scope="col">{escape(name)}</th>' for name in team)
    yield from scrolled("Smallest separation of each pair")
    yield '<table class="matrix"><caption>Smallest separation of each pair, m</caption>'
    yield f'<thead><tr><th scope="col">pair</th>{heads}</tr></thead><tbody>'
    for one in team:
        row = "".join(cells.get(frozenset((one, other)), "<td></td>") for other in team)
        yield f'<tr><th scope="row">{escape(one)}</th>{row}</tr>'
    yield "</tbody></table></section>"
    swatches = (
        f'<li><i class="heat{k}">{"✕ m" if k == 0 else "m"}</i>{text}</li>'
        for k, text in enumerate(_KEY)
    )
    yield f'<ul class="key">{"".join(swatches)}<li>{NONE} never at one level</li></ul>'


def _touched(r: Mapping[str, Any]) -> set[frozenset[str]]:
    return {frozenset(c["robots"]) for c in r["collision_events"]}


def _cell(pair: Mapping[str, Any], touched: set[frozenset[str]]) -> str:
    """Return one pair's cell: warmer the nearer, and marked where they touched."""
    apart = pair["min_separation_m"]
    if frozenset(pair["robots"]) in touched:
        return f'<td class="heat0">✕&nbsp;{number(apart, 2)}</td>'
    if apart is None:
        return f"<td>{NONE}</td>"
    heat = next((k for k, n in enumerate(_HEAT) if apart < n * pair["contact_m"]), len(_HEAT))
    tone = f' class="heat{max(1, heat)}"' if heat < len(_HEAT) else ""
    return f"<td{tone}>{apart:.2f}</td>"


def _nearest(r: Mapping[str, Any]) -> Iterator[str]:
    pairs = [p for p in r["pairs"] if p["min_separation_m"] is not None][:NEAREST]
    touched = _touched(r)
    yield from table(
        f"The {len(pairs)} nearest of {r.get('pairs_total', len(pairs))} pairs; {time_base(r)}",
        ("pair", "class", "smallest, m", "contact at, m", "time, s", "touched"),
        [
            (
                names(p["robots"]),
                p["class"],
                number(p["min_separation_m"], 3),
                number(p["contact_m"], 3),
                number(since_ready(r, p["time_s"]), 1),
                "✕ yes" if frozenset(p["robots"]) in touched else "no",
            )
            for p in pairs
        ],
        words=(0, 1, 5),
    )


def collisions(r: Mapping[str, Any]) -> Iterator[str]:
    """Yield when and where robots touched."""
    if not r["collision_events"]:
        return
    yield '<h2 id="collisions">Collisions</h2>'
    yield from table(
        "When and where robots touched; one event until they are clear of each other again; "
        f"{time_base(r)}",
        ("robots", "class", "time, s", "east, m", "north, m", "up, m"),
        [
            (
                names(x["robots"]),
                x["class"],
                number(since_ready(r, x["time_s"]), 2),
                *(number(x[axis], 2) for axis in ("east_m", "north_m", "up_m")),
            )
            for x in r["collision_events"]
        ],
        words=(0, 1),
        label="Collisions",
    )


def smallest(r: Mapping[str, Any]) -> tuple[str, str]:
    """Return the smallest separation of all, and between whom."""
    near = [c for c in r.get("classes", ()) if c["min_separation_m"] is not None]
    if not near:
        return NONE, ""
    least = min(near, key=lambda c: c["min_separation_m"])
    note = f"{names(least['robots'])}; contact at {least['contact_m']:.3g}&nbsp;m"
    return unit(least["min_separation_m"], 2, "m"), note
