"""What each robot did, and how its link did, as tables."""

from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

from .outcome import broken_off
from .page_parts import NONE, number, size, table, time_base


def robots(r: Mapping[str, Any]) -> Iterator[str]:
    """Yield a line per robot: how it arrived, how exactly, at what effort."""
    not_there = "not yet" if broken_off(r["error"], r["exit_code"]) else '<b class="bad">no</b>'
    yield '<h2 id="robots">Robots</h2>'
    yield from table(
        f"Way, tracking and effort of each robot; arrival: {time_base(r)}",
        (
            "robot",
            "kind",
            "goal",
            "arrived",
            "arrival<br>s",
            "miss<br>m",
            "way<br>m",
            "path-length<br>ratio",
            "RMSE<br>m",
            "worst<br>m",
            "effort<br>m²/s³",
            "deadlock<br>s",
            "nearest<br>m",
            "to",
        ),
        [_robot(x, not_there) for x in r["robots"]],
        words=(0, 1, 2, 3, 13),
    )
    if any(x["source"] == "telemetry" for x in r["robots"]):
        yield '<p class="soft">* External: judged by its own telemetry, not by truth.</p>'
    yield (
        '<p class="soft">Path-length ratio: way gone over way asked for. RMSE: from the moving '
        "reference, of robots with a path or a place to keep. Effort: integral of the squared "
        "horizontal acceleration while under way. Deadlock: standing still with a target to go "
        "to.</p>"
    )


def _robot(x: Mapping[str, Any], not_there: str) -> tuple[str, ...]:
    return (
        _name(x),
        x["kind"],
        x["goal"],
        {True: "yes", False: not_there, None: NONE}[x["arrived"]],
        number(x["arrival_s"], 1),
        number(x["miss_m"], 2),
        number(x.get("path_length_m"), 1),
        number(x["path_ratio"], 2),
        number(x["tracking_rmse_m"], 3),
        number(x.get("tracking_max_m"), 3),
        number(x.get("control_effort_m2_s3"), 2),
        number(x.get("deadlock_s"), 1),
        number(x["nearest_separation_m"], 2),
        escape(x["nearest"] or "") or NONE,
    )


def links(r: Mapping[str, Any]) -> Iterator[str]:
    """Yield a line per MAVLink link: setpoints sent, frames both ways, what was lost."""
    known = [x for x in r["robots"] if x.get("link") or x.get("setpoints")]
    if not known:
        return
    yield '<h2 id="links">Links</h2>'
    yield from table(
        "MAVLink between the coordinator and each vehicle",
        (
            "robot",
            "setpoints<br>Hz",
            "mean age<br>ms",
            "longest gap<br>ms",
            "frames<br>to",
            "frames<br>from",
            "bytes<br>to",
            "bytes<br>from",
            "lost",
            "position<br>Hz",
            "silence<br>s",
            "oldest state<br>s",
        ),
        [_link(x) for x in known],
    )
    yield (
        '<p class="soft">Age and gap are of the setpoints that a vehicle had. Silence: the longest '
        "time without a frame from it. Oldest state: of what the law went by.</p>"
    )


def _link(x: Mapping[str, Any]) -> tuple[str, ...]:
    sent, link = x.get("setpoints") or {}, x.get("link") or {}
    return (
        _name(x),
        number(sent.get("rate_hz"), 2),
        number(_thousand(sent.get("mean_age_s")), 0),
        number(_thousand(sent.get("longest_gap_s")), 0),
        number(link.get("to_vehicle_frames"), 0),
        number(link.get("from_vehicle_frames"), 0),
        size(link.get("to_vehicle_bytes")),
        size(link.get("from_vehicle_bytes")),
        number(link.get("lost_frames"), 0),
        number(link.get("position_rate_hz"), 1),
        number(link.get("longest_silence_s"), 2),
        number(link.get("oldest_state_s"), 2),
    )


def _thousand(value: float | None) -> float | None:
    return None if value is None else 1000 * value


def _name(x: Mapping[str, Any]) -> str:
    return escape(x["name"]) + ("*" if x["source"] == "telemetry" else "")
