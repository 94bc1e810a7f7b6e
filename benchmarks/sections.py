"""The sections of the benchmark: each measures something and puts it beside its floor."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from statistics import median as middle

import alone
import barrier
import by_hand
import recorded
import starts
import sweeps
from coordinator_tick import tick_cost
from flights import Usage, field_scenario, fly, lone_scenario, watch
from tables import Table, digits, median, medians

from mavherd.scenarios.loader import load_scenario
from mavherd.scenarios.schema import Scenario

KINDS = ("quadcopter", "rover")


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How long to measure."""

    repeats: int = 5
    sizes: tuple[int, ...] = (1, 6, 10, 50, 100)  # of fields
    teams: tuple[int, ...] = (4, 16, 64, 128, 240)  # of the coordinator alone
    seconds: float = 20.0  # of wall time for what goes on for as long as one likes


QUICK = Effort(repeats=1, sizes=(1, 6, 10), teams=(4, 64), seconds=5.0)


@dataclass(frozen=True, slots=True)
class Section:
    """Tables, and those of their figures that have a target."""

    tables: list[Table]
    figures: dict[str, float] = field(default_factory=dict)


def vehicles(effort: Effort) -> Section:
    """Measure one vehicle: its kernel, in lockstep at full speed, by hand at real time."""
    rows = []
    figures: dict[str, float] = {}
    for kind in KINDS:
        costs = [alone.kernel(kind) for _ in range(effort.repeats)]
        physics, control, step = (
            middle(cost[part] for cost in costs) for part in ("physics", "control", "step")
        )
        long, short = (lone_scenario(kind, s * effort.seconds) for s in (30, 0.5))
        full = median(effort.repeats, partial(_full_speed, kind, long))
        paced = watch(short, speed=1.0)[1].of(kind)
        idle, _, _ = by_hand.serving(kind, 0, effort.seconds)
        served, rate, _ = by_hand.serving(kind, 1, effort.seconds)
        rows.append(
            (
                kind,
                *(f"{cost * 1e3:.3f}" for cost in (physics, control, step, full)),
                f"{full / physics:.1f}",
                *(f"{cost * 1e3:.2f}" for cost in (paced, idle, served)),
                f"{rate:.0f}",
            )
        )
        figures |= {f"{kind} full": full, f"{kind} 1x": paced}
    heads = (
        *("ms CPU per simulated s", "physics alone", "control alone", "with its autopilot"),
        *("process, full speed", "/ physics", "process, 1x", "by hand, standing"),
        *("by hand, under way, one client", "messages/s"),
    )
    note = (
        "A quadcopter hovers, a rover stands armed. Process: that of the vehicle alone in a"
        " lockstep run with its coordinator, at full speed and paced; sockets, barrier and truth"
        " log are in it. By hand: `mavherd vehicle` at 1x with nobody there, then with a ground"
        " station that has it fly and gets every stream that flows unasked."
    )
    return Section([Table("One vehicle", heads, rows, note)], figures)


def _full_speed(kind: str, scenario: Scenario) -> float:
    return watch(scenario)[1].of(kind)


def parts(effort: Effort) -> Section:
    """Measure where the time of a run goes, beside the same work in one process."""
    kernels = {kind: alone.kernel(kind) for kind in KINDS}
    with tempfile.TemporaryDirectory() as folder:
        largest = field_scenario(max(effort.sizes), Path(folder))
    scenarios = load_scenario("crossing-targets"), largest
    columns = [_shares(scenario, kernels) for scenario in scenarios]
    rows = [(part, *(column[part] for column in columns)) for part in columns[0]]
    note = (
        "CPU of every process of a lockstep run at full speed, ms per simulated s, and its share of"
        " all. Physics, control, MAVLink and coordination are measured in one process (the floor)"
        " and taken off what the processes used; what remains with the vehicles is autopilot,"
        " sockets, barrier and truth log. Waiting is what the cores had left."
    )
    heads = "", *(scenario.name for scenario in scenarios)
    return Section([Table("Where the time goes", heads, rows, note)])


def _shares(scenario: Scenario, kernels: dict[str, dict[str, float]]) -> dict[str, str]:
    floor = alone.floors(scenario)
    _, usage = watch(scenario)
    counts = {kind: sum(spec.kind == kind for spec in scenario.robots) for kind in KINDS}
    kernel = {
        part: sum(counts[kind] * kernels[kind][part] for kind in KINDS)
        for part in ("physics", "control", "step")
    }
    scale = floor["physics and control"] / kernel["step"]  # robots stand for some of the time
    physics, control = kernel["physics"] * scale, kernel["control"] * scale
    everything = sum(usage.cpu.values())
    spent = {
        "physics": physics,
        "control": control,
        "vehicles' MAVLink": floor["vehicle MAVLink"],
        "vehicles' rest": usage.of(*KINDS) - physics - control - floor["vehicle MAVLink"],
        "coordination": floor["coordination"],
        "coordinator's rest": _main(usage, "coordinator") - floor["coordination"],
        "launcher": _main(usage, "launcher"),
        "Zenoh, in all": usage.zenoh,
    }
    rows = {part: f"{s * 1e3:.2f} ({s / everything:.0%})" for part, s in spent.items()}
    idle = 1 - usage.cores / sweeps.cores()
    return rows | {
        "all processes": f"{everything * 1e3:.2f}",
        "all in one process (floor)": f"{sum(floor.values()) * 1e3:.2f}",
        "all / floor": f"{everything / sum(floor.values()):.1f}",
        "waiting, of all cores": f"{idle:.0%}",
    }


def _main(usage: Usage, role: str) -> float:
    return usage.cpu.get((role, "main"), 0.0)


def fleets(effort: Effort) -> Section:
    """Measure real-time factors, memory and, for a hundred, real time."""
    rows, held, paced = [], [], []
    figures: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as text:
        for size in effort.sizes:
            dwell_s = max(0.0, (100 if size < 10 else 30) * effort.seconds / size - 10)
            scenario = field_scenario(size, Path(text), dwell_s=dwell_s if size <= 10 else 0.0)
            runs = [fly(scenario) for _ in range(effort.repeats if size <= 10 else 1)]
            factor = middle(report["real_time_factor"] for report in runs)
            _, usage = watch(scenario)
            each = sum(usage.of(kind) for kind in KINDS) / size
            figures[f"factor {size}"] = factor
            rows.append(
                (
                    str(size),
                    digits(factor),
                    f"{each * 1e3:.2f}",
                    f"{sum(usage.cpu.values()) * 1e3:.1f}",
                    digits(usage.cores),
                )
            )
            pss = middle(memory.pss for memory in usage.memory.values())
            rss = middle(memory.rss for memory in usage.memory.values())
            held.append((str(size), digits(pss), digits(rss)))
            if size == 10:
                figures |= {"pss": pss, "rss": rss}
        largest = max(effort.sizes)
        scenario = field_scenario(largest, Path(text), dwell_s=effort.seconds)
        for mode, options in (("lockstep", {"speed": 1.0}), ("free run", {"lockstep": False})):
            report, usage = watch(scenario, **options)
            late = 100 * report["late_ticks"] / report["ticks"]
            paced.append((f"{largest}, {mode}", digits(usage.cores), f"{late:.2f}"))
            if mode == "lockstep":
                figures |= {f"cores {largest}": usage.cores, f"late {largest}": late}
    heads = "vehicles", "times real time", "ms CPU per simulated s, a vehicle", "all", "cores busy"
    return Section(
        [
            Table("Lockstep at full speed, law safe, real processes", heads, rows),
            Table("Memory of a vehicle's process", ("vehicles", "PSS, MB", "RSS, MB"), held),
            Table("At real time", ("vehicles", "cores in all", "late ticks, %"), paced),
        ],
        figures,
    )


def barriers(effort: Effort) -> Section:
    """Measure what a tick costs when nobody has anything to do."""
    rows = []
    for size in effort.sizes:
        empty = median(effort.repeats, partial(barrier.empty_barrier, size))
        ours = median(effort.repeats, partial(barrier.our_barrier, size))
        rows.append((str(size), f"{empty:.0f}", f"{ours:.0f}", f"{ours / empty:.2f}"))
    one = median(effort.repeats, barrier.bare_socket)
    note = f"A datagram of 100 bytes there and back, over UDP on loopback: {one:.0f} us."
    heads = "processes", "bare grant and answer (floor), us", "our barrier, us", "/ floor"
    return Section([Table("A barrier with nothing to do", heads, rows, note)])


def readiness(effort: Effort) -> Section:
    """Measure the time from the command until all vehicles are ready."""
    rows = []
    figures: dict[str, float] = {}
    for size in effort.sizes:
        up, ready = medians(effort.repeats, partial(starts.start, size))
        rows.append((str(size), f"{up:.2f}", f"{ready:.2f}"))
        figures[f"ready {size}"] = ready
    for kind in KINDS:
        beat = median(effort.repeats, partial(by_hand.start, kind))
        rows.append((f"one {kind} by hand, first HEARTBEAT", f"{beat:.2f}", ""))
    note = "Up: every process is there. Ready: every vehicle was heard and is told to arm."
    heads = "vehicles", "up, s", "all ready, s"
    return Section([Table("From the command to a team that is ready", heads, rows, note)], figures)


def ticks(effort: Effort) -> Section:
    """Measure the coordinator's tick."""
    rows = []
    figures: dict[str, float] = {}
    for robots in effort.teams:
        cost = tick_cost(robots)
        rows.append((str(robots), *(f"{ms:.3f}" for ms in (*cost, cost.whole))))
        figures[f"tick {robots}"] = cost.whole
    heads = "robots", "decode", "share", "decide", "encode", "whole"
    note = "Law safe, 9 m2 of field for each robot, all moving; ms of CPU, the median of 100 ticks."
    return Section([Table("A tick of the coordinator", heads, rows, note)], figures)


def sweeping(effort: Effort) -> Section:
    """Measure a sweep, in-process and as processes, beside bare loops."""
    wall, simulated = medians(effort.repeats, sweeps.one_run)
    runs = max(sweeps.cores() * 2, round(effort.seconds / wall) * sweeps.cores())
    bare = sweeps.bare_loops(runs)
    inside = sweeps.sweep(2, runs + 2)
    outside = sweeps.sweep(2, 2 + max(4, round(effort.seconds / 4)), "--processes")
    rows = [
        (text, digits(rate), digits(rate * simulated))
        for text, rate in (
            ("bare loops of simulate() (floor)", bare),
            ("mavherd sweep, in process", inside),
            ("mavherd sweep --processes", outside),
        )
    ]
    heads = f"crossing-targets, {sweeps.cores()} cores", "runs/s", "simulated s per s"
    note = f"A run lasts {simulated:.0f} simulated s, and {wall:.3f} s alone."
    return Section([Table("Sweeps", heads, rows, note)], {"sweep": inside})


def recording(effort: Effort) -> Section:
    """Measure what it costs to be recorded, at real time."""
    rows = []
    figures: dict[str, float] = {}
    for scenario in recorded.scenarios(max(effort.sizes), effort.seconds):
        robots = len(scenario.robots)
        cost = recorded.recorded(scenario, max(1, effort.repeats // 2))
        rows.append(
            (
                f"{scenario.name}, {robots}",
                digits(100 * cost.recorder),
                f"{cost.unseen * 1e3:.1f}",
                f"{cost.others * 1e3:.1f}",
                f"{cost.ratio:.3f}",
                digits(cost.megabytes),
            )
        )
        figures |= {f"recorder {robots}": 100 * cost.recorder, f"rrd {robots}": cost.megabytes}
    heads = (
        *("robots at 1x", "recorder, % of a core"),
        *("vehicles and coordinator, ms CPU per s, not recorded", "recorded", "ratio"),
        "run.rrd, MB per 60 s",
    )
    note = (
        "Truth at 50 Hz for six robots and 20 Hz for more than thirty. Runs with and without the"
        " recorder took turns. The recorder's start, about a second of CPU for importing Rerun, is"
        " not in its share."
    )
    return Section([Table("Being recorded", heads, rows, note)], figures)


SECTIONS: dict[str, Callable[[Effort], Section]] = {
    "vehicles": vehicles,
    "fleets": fleets,
    "parts": parts,
    "barriers": barriers,
    "readiness": readiness,
    "ticks": ticks,
    "sweeps": sweeping,
    "recording": recording,
}
