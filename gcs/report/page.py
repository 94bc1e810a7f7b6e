"""The report of a run as one self-contained web page: light, dark, on a phone, on paper."""

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from .outcome import FAILED, PASSED, TIMED_OUT, broken_off
from .page_figures import figure
from .page_parts import NONE, Tile, number, size, tiles, unit
from .page_robots import links, robots
from .page_separation import collisions, separations, smallest
from .page_style import document

FIGURES = {
    "plan": (
        "All tracks from above",
        "Tracks from above, a dot every five seconds, robots drawn to size with the circle in "
        "which they may touch others.",
    ),
    "space": (
        "All tracks in space",
        "Tracks in space until the last one had arrived, with their shadows on the ground.",
    ),
    "separation": (
        "Smallest separation of each class of pairs over time",
        "Smallest separation of each class over time; at the dashed line robots touch.",
    ),
    "conflicts": (
        "Space-time diagrams: who was in whose way, and when",
        "Space-time diagrams of those who came nearest to others. The line is how far the robot "
        "had gone; a region is where another one was in its way. A line above a region went "
        "first, one below let the other pass, one through the dark part collided.",
    ),
    "speeds": (
        "Speed of each robot over time",
        "Speeds: in the plane for rovers, in space for quadcopters.",
    ),
    "errors": (
        "Distance of each robot from where it should be, over time",
        "Distance left to the target, or from the place asked for at that moment.",
    ),
}
_MARKS = {
    True: ("good", "✓ pass"),
    False: ("bad", "✕ FAIL"),
    None: ("soft", f"{NONE} open"),  # not decided
}
_NAV = {
    "numbers": "Numbers",
    "separation": "Separation",
    "collisions": "Collisions",
    "robots": "Robots",
    "links": "Links",
    "timing": "Timing",
    "figures": "Figures",
    "again": "Run it again",
}


def page(report: Mapping[str, Any], pictures: Sequence[Path], about: str = "") -> str:
    """Return the whole page; the pictures (PNGs, with an SVG beside each) are inside it.

    `about` is what a reader should know of the pictures: why there are none, how old they are.
    """
    r = report
    body = [
        *_numbers(r),
        *separations(r),
        *collisions(r),
        *robots(r),
        *links(r),
        *_timing(r),
        *_figures(pictures, about),
        *_again(r),
    ]
    there = "\n".join(line for line in body if line.startswith("<h2"))
    nav = "".join(
        f'<li><a href="#{key}">{text}</a></li>'
        for key, text in _NAV.items()
        if f'id="{key}"' in there
    )
    title = f"{r['scenario']}: {_word(r)[1][2:].lower()}"
    return document(
        title,
        [
            *_verdict(r),
            f'<nav aria-label="Sections"><ul>{nav}</ul></nav>',
            "<main>",
            *body,
            "</main>",
            *_footer(r),
        ],
    )


def _verdict(r: Mapping[str, Any]) -> Iterator[str]:
    tone, word = _word(r)
    yield f'<header><p class="verdict {tone}">{word}</p>'
    yield f"<h1>{escape(r['scenario'])}</h1>"
    if r["description"]:
        yield f"<p>{escape(r['description'])}</p>"
    begun = (r.get("started_at") or "").replace("T", " ").replace("Z", " UTC")
    facts = (f"law {r['law']}", f"seed {r['seed']}", begun, f"run {r['run_id']}")
    yield f'<p class="soft">{" · ".join(escape(fact) for fact in facts if fact)}</p>'
    if r["error"]:
        yield f'<p class="note bad">{escape(r["error"])}</p>'
    yield from _reservations(r)
    yield '<ul class="checks">'
    for a in r["assertions"]:
        tone, word = _MARKS[a["passed"]]
        yield f'<li><b class="{tone}">{word}</b><span>{escape(a["text"])}</span></li>'
    if not r["assertions"]:
        yield '<li class="soft">The scenario asserts nothing (no <code>expect</code>).</li>'
    yield "</ul></header>"


def _word(r: Mapping[str, Any]) -> tuple[str, str]:
    """Return the verdict in a word, with its tone."""
    if r["passed"]:
        return "good", "✓ Passed"
    undecided = all(a["passed"] is not False for a in r["assertions"])
    broke = undecided and broken_off(r["error"], r["exit_code"])
    return "bad", "✕ Broken off" if broke else "✕ Failed"


def _reservations(r: Mapping[str, Any]) -> Iterator[str]:
    """Yield what a reader has to know before trusting the numbers."""
    if r["partial"]:
        yield '<div class="note"><p class="bad">Partial: some of this run is missing.</p>'
        if missing := r.get("missing"):
            yield f"<ul>{''.join(f'<li>{escape(text)}</li>' for text in missing)}</ul>"
        yield "</div>"
    if n := r["outside_clients"]:
        yield f'<p class="note">{n} outside client{"s" * (n > 1)} took part, and may have steered: '
        yield "another run of this seed may differ.</p>"


def _numbers(r: Mapping[str, Any]) -> Iterator[str]:
    fleet, team = r.get("fleet") or {}, r["robots"]
    kinds = [x["kind"] for x in team]
    counts = [
        f"{kinds.count(kind)}&nbsp;{kind}{'s' * (kinds.count(kind) > 1)}"
        for kind in dict.fromkeys(kinds)
    ]
    sent = [x for x in team if x["arrived"] is not None]
    there = sum(bool(x["arrived"]) for x in sent)
    last = fleet.get("last_arrival_s")
    if last is None:
        last = max((x["arrival_s"] for x in team if x["arrival_s"] is not None), default=None)
    near, between = smallest(r)
    hits = r["collisions"]
    late = escape(fleet.get("last_arrival_robot") or "")
    stuck = f"all at once {unit(fleet.get('deadlock_all_s'), 1, 's')}"
    measured = (
        Tile("Path-length ratio, mean", number(fleet.get("path_ratio_mean"), 3)),
        Tile("Worst tracking RMSE", unit(fleet.get("tracking_rmse_max_m"), 3, "m")),
        Tile("Control effort", unit(fleet.get("control_effort_m2_s3"), 1, "m²/s³"), "all robots"),
        Tile("Deadlock", unit(fleet.get("deadlock_any_s"), 1, "s"), stuck),
    )
    yield '<h2 id="numbers">Numbers</h2>'
    yield from tiles(
        (
            Tile("Robots", f"{len(team)}", ", ".join(counts)),
            Tile("Collisions", f'<b class="bad">✕ {hits}</b>' if hits else "0"),
            Tile("Smallest separation", near, between),
            Tile("Arrived", f"{there} of {len(sent)}" if sent else NONE),
            Tile("Last arrival", unit(last, 1, "s"), late),
            *(tile for tile in measured if tile.value != NONE),
            Tile("Simulated", unit(r["duration_s"], 1, "s")),
        )
    )


def _timing(r: Mapping[str, Any]) -> Iterator[str]:
    fleet, cpu = r.get("fleet") or {}, r.get("cpu") or {}
    shares = ("launcher", "vehicles", "coordinators", "recorder")
    known = [f"{s} {cpu[f'{s}_s']:.1f}" for s in shares if cpu.get(f"{s}_s") is not None]
    mode = "lockstep" if r["lockstep"] else "free-running"
    pace = "as fast as it goes" if r["speed"] is None else f"at {r['speed']:g} x"
    known_pace = f", {pace}" if r["wall_s"] is not None else ""
    rate, gap = fleet.get("setpoint_rate_min_hz"), unit(fleet.get("setpoint_longest_gap_s"), 3, "s")
    digest = r["digest"] or "none (the run did not finish, or was not in lockstep)"
    late = (
        NONE if r["late_ticks"] is None or not r["ticks"] else f"{r['late_ticks']} of {r['ticks']}"
    )
    measured = (
        Tile("Wall clock", unit(r["wall_s"], 1, "s")),
        Tile("Late ticks", late),
        Tile("CPU", unit(cpu.get("total_s"), 1, "s"), ", ".join(known)),
        Tile("Slowest setpoints", unit(rate, 2, "Hz"), f"longest gap {gap}"),
        Tile("Lost frames", number(fleet.get("lost_frames"), 0)),
        Tile("Longest silence", unit(fleet.get("longest_silence_s"), 2, "s"), "of a vehicle"),
        Tile("MAVLink", size(fleet.get("link_bytes")), "both ways"),
    )
    yield '<h2 id="timing">Timing and repeatability</h2>'
    yield from tiles(
        (
            Tile("Real-time factor", unit(r["real_time_factor"], 1, "x"), mode + known_pace),
            *(tile for tile in measured if tile.value != NONE),
        )
    )
    yield f'<p class="soft">Digest <code>{escape(digest)}</code></p>'


def _figures(pictures: Sequence[Path], about: str) -> Iterator[str]:
    if pictures or about:
        yield '<h2 id="figures">Figures</h2>'
        files = " Also as PNG and SVG in <code>figures/</code>." if pictures else ""
        yield f'<p class="soft">{escape(about, quote=False)}{files}</p>'
    for picture in pictures:
        yield from figure(picture, *FIGURES.get(picture.stem, (picture.stem, picture.stem)))


def _again(r: Mapping[str, Any]) -> Iterator[str]:
    mode = "" if r["lockstep"] else " --free-run"
    mode += " --in-process" if r.get("in_process") else ""
    script = r.get("script")
    lines = [] if script else [f"mavherd run scenario.yaml --seed {r['seed']}{mode}"]
    lines += [] if r.get("in_process") else ["mavherd view ."]
    lines += ["mavherd digest ."] if r["digest"] else []
    lines += ["mavherd diff . ANOTHER_RUN", "mavherd compare . ANOTHER_RUN"]
    yield '<h2 id="again">Run it again</h2>'
    if script:
        yield "<p>A script steered this run: run your script again. In this folder:</p>"
    else:
        yield "<p>In this folder; scenario.yaml holds every setting of this run, "
        yield f"law {escape(r['law'])} and what <code>--set</code> changed among them.</p>"
    yield f"<pre>{chr(10).join(lines)}</pre>"
    if _is_repeatable(r):
        yield "<p>With the same version of mavherd the second run has the same digest.</p>"


def _is_repeatable(r: Mapping[str, Any]) -> bool:
    """Return whether the same command gives the same digest: all was in the scenario."""
    whole = r["exit_code"] in (PASSED, FAILED, TIMED_OUT) and r["digest"] is not None
    return whole and r.get("script") is False and r["outside_clients"] == 0


def _footer(r: Mapping[str, Any]) -> Iterator[str]:
    by = "Report by " if r["wall_s"] is None else ""  # the run itself left none
    yield f"<footer><p>{by}mavherd {escape(r['version'])} ({escape(r['compiled'])}), "
    yield f"Python {escape(r['python'])}, {escape(r['platform'])}.</p></footer>"
