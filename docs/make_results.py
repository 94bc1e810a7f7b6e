"""Fly the paper's missions under every law and write docs/results.csv and docs/results.md.

    python docs/make_results.py             all of it: about 20 minutes on two cores
    python docs/make_results.py --seeds 3   a taste, printed only

Every run is a real one: a process for each vehicle, MAVLink over UDP, the coordinator on Zenoh.
"""

import argparse
import csv
import itertools
import math
import statistics
import sys
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from mavherd.gcs.run.launcher import Run, RunOptions
from mavherd.gcs.run.ports import PortPlan
from mavherd.scenarios.loader import load_scenario

HERE = Path(__file__).parent
MISSIONS = ("tracking", "crossing-targets", "circle-traffic")
LAWS = ("safe", "paper", "off")
DISTURBANCES = ("off", "held")

CLOSER_NAME = "crossing, closer starts"
"""The prototype flew the quadcopters from where the rovers start; here the rovers make room."""
CLOSER = (
    "crossing-targets",
    [
        change
        for i, (start, goal) in enumerate(((0, 4), (-1.3, 7), (-2.6, 10)), 1)
        for change in (
            f"robots.quad{i}.start.east={start}",
            f"robots.quad{i}.start.north={start}",
            f"robots.rover{i}.start.east={start + 40}",
            f"robots.rover{i}.goto.east={goal + 40}",
        )
    ],
)
FIELDS = (
    "mission",
    "law",
    "disturbance",
    "seed",
    "exit_code",
    "collisions",
    "colliding_pairs",
    "all_arrived",
    "rovers_arrived_s",
    "quads_arrived_s",
    "nearest_rovers_m",
    "nearest_quads_m",
    "nearest_mixed_m",
    "rmse_rover1_m",
    "rmse_rover2_m",
    "rmse_quad1_m",
    "rmse_quad2_m",
    "rmse_quad3_m",
    "duration_s",
    "digest",
)

Row = dict[str, Any]


def fly(mission: str, law: str, disturbance: str, seed: int, out: Path) -> Row:
    """Run once and return what the table is made of."""
    name, changes = (CLOSER[0], CLOSER[1]) if mission == CLOSER_NAME else (mission, [])
    settings = [f"team.law={law}", f"disturbance={disturbance}", *changes]
    scenario = load_scenario(name, settings, seed=seed)
    options = RunOptions(
        out=out, record=False, figures=False, ports=PortPlan(gcs_udp=0, api_udp=0, tcp=0)
    )
    report = Run(scenario, options).execute().report
    robots = {robot["name"]: robot for robot in report["robots"]}
    classes = {c["class"]: c for c in report["classes"]}

    def arrival(kind: str) -> float | None:
        times = [
            r["arrival_s"] for r in robots.values() if r["kind"] == kind and r["goal"] == "goto"
        ]
        return max(times) if times and None not in times else None

    def nearest(name: str) -> float | None:
        return classes[name]["min_separation_m"] if name in classes else None

    events = report["collision_events"]
    row: Row = {
        "mission": mission,
        "law": law,
        "disturbance": disturbance,
        "seed": seed,
        "exit_code": report["exit_code"],
        "collisions": len(events),
        "colliding_pairs": len({tuple(e["robots"]) for e in events}),
        "all_arrived": int(report["all_arrived"]),
        "rovers_arrived_s": arrival("rover"),
        "quads_arrived_s": arrival("quadcopter"),
        "nearest_rovers_m": nearest("rover-rover"),
        "nearest_quads_m": nearest("quadcopter-quadcopter"),
        "nearest_mixed_m": nearest("mixed"),
        "duration_s": report["duration_s"],
        "digest": report["digest"],
    }
    for name in ("rover1", "rover2", "quad1", "quad2", "quad3"):
        row[f"rmse_{name}_m"] = robots.get(name, {}).get("tracking_rmse_m")
    return row


def wilson(hits: int, n: int) -> tuple[float, float]:
    """Return the 95 % Wilson score interval of a rate."""
    z = 1.96
    centre = (hits + z * z / 2) / (n + z * z)
    half = z / (n + z * z) * math.sqrt(hits * (n - hits) / n + z * z / 4)
    return max(0.0, centre - half), min(1.0, centre + half)


def mean(rows: Sequence[Row], key: str, digits: int = 2) -> str:
    """Return the mean of what is known in a column, or a dash."""
    values = [float(r[key]) for r in rows if r[key] not in (None, "")]
    return f"{statistics.mean(values):.{digits}f}" if values else "-"


def least(rows: Sequence[Row], key: str) -> str:
    """Return the smallest value in a column, or a dash."""
    values = [float(r[key]) for r in rows if r[key] not in (None, "")]
    return f"{min(values):.2f}" if values else "-"


def table(header: str, lines: Iterable[str]) -> str:
    """Return a Markdown table."""
    rule = "|" + "---|" * (header.count("|") - 1)
    return "\n".join([header, rule, *lines])


def collisions_table(rows: Sequence[Row]) -> str:
    """Return the comparison of the laws."""
    lines = []
    for mission, law, disturbance in itertools.product(MISSIONS, LAWS, DISTURBANCES):
        part = select(rows, mission, law, disturbance)
        if not part:
            continue
        hit = sum(int(r["collisions"]) > 0 for r in part)
        low, high = wilson(hit, len(part))
        events = sum(int(r["collisions"]) for r in part)
        arrived = sum(int(r["all_arrived"]) for r in part)
        force = "-" if disturbance == "off" else "±0.4 N"
        lines.append(
            f"| {mission} | `{law}` | {force} | **{hit} / {len(part)}** "
            f"| {low:.0%} to {high:.0%} | {events} | {arrived} / {len(part)} "
            f"| {least(part, 'nearest_rovers_m')} | {least(part, 'nearest_quads_m')} |"
        )
    return table(
        "| mission | law | force | runs with a collision | 95 % interval | collisions "
        "| all arrived | nearest rovers, m | nearest quadcopters, m |",
        lines,
    )


def targets_table(rows: Sequence[Row]) -> str:
    """Return what law `safe` reaches beside what was asked for."""
    wanted = [
        ("tracking", "rmse_rover2_m", "rover, circle: RMSE, m", 0.05),
        ("tracking", "rmse_rover1_m", "rover, rectangle: RMSE, m", 0.14),
        ("tracking", "rmse_quad2_m", "quadcopter, circle: RMSE, m", 0.05),
        ("tracking", "rmse_quad1_m", "quadcopter, rectangle: RMSE, m", 0.09),
        ("crossing-targets", "rovers_arrived_s", "last rover arrives, s", 20.0),
        ("crossing-targets", "quads_arrived_s", "last quadcopter arrives, s", 18.0),
        (CLOSER_NAME, "quads_arrived_s", "last quadcopter arrives, s", 18.0),
        ("crossing-targets", "nearest_rovers_m", "nearest two rovers, m", 1.09),
        ("crossing-targets", "nearest_quads_m", "nearest two quadcopters, m", 0.73),
        ("circle-traffic", "rmse_rover1_m", "rover 1: RMSE, m", 0.18),
        ("circle-traffic", "rmse_rover2_m", "rover 2: RMSE, m", 0.18),
        ("circle-traffic", "rmse_quad1_m", "quadcopter 1: RMSE, m", 0.42),
        ("circle-traffic", "rmse_quad2_m", "hovering quadcopter 2: RMSE, m", 0.09),
        ("circle-traffic", "rmse_quad3_m", "hovering quadcopter 3: RMSE, m", 0.09),
        ("circle-traffic", "nearest_rovers_m", "nearest two rovers, m", 0.99),
        ("circle-traffic", "nearest_quads_m", "nearest two quadcopters, m", 1.02),
    ]
    lines = []
    for mission, key, text, target in wanted:
        calm, windy = (select(rows, mission, "safe", d) for d in DISTURBANCES)
        lines.append(
            f"| {mission} | {text} | {target:g} | {mean(calm, key)} | {mean(windy, key)} "
            f"| {least([*calm, *windy], key)} |"
        )
    return table(
        "| mission | quantity | prototype | mean, no force | mean, ±0.4 N | smallest of all |",
        lines,
    )


def select(rows: Sequence[Row], mission: str, law: str, disturbance: str) -> list[Row]:
    """Return the rows of one cell of the experiment."""
    return [
        r for r in rows if (r["mission"], r["law"], r["disturbance"]) == (mission, law, disturbance)
    ]


def write_page(rows: Sequence[Row]) -> None:
    """Put the tables between the markers of results.md."""
    page = HERE / "results.md"
    text = page.read_text(encoding="utf-8")
    for name, content in (("collisions", collisions_table(rows)), ("targets", targets_table(rows))):
        begin, end = f"<!-- {name} -->", f"<!-- end {name} -->"
        head, _, rest = text.partition(begin)
        _, _, tail = rest.partition(end)
        text = f"{head}{begin}\n\n{content}\n\n{end}{tail}"
    page.write_text(text, encoding="utf-8")


def main() -> None:
    """Fly everything, or rebuild the page from the file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--seeds", type=int, help="only so many, printed and not written")
    parser.add_argument("--page", action="store_true", help="only rebuild results.md")
    args = parser.parse_args()
    csv_path = HERE / "results.csv"
    if not args.page:
        rows = []
        seeds = range(1, (args.seeds or 20) + 1)
        cells = [
            *itertools.product(MISSIONS, LAWS, DISTURBANCES, seeds),
            *itertools.product([CLOSER_NAME], ["safe"], DISTURBANCES, seeds),
        ]
        for k, cell in enumerate(cells, 1):
            with tempfile.TemporaryDirectory() as folder:
                row = fly(*cell, Path(folder))
            rows.append(row)
            print(f"{k}/{len(cells)}", *cell, row["collisions"], file=sys.stderr)
        if args.seeds:
            print(collisions_table(rows), targets_table(rows), sep="\n\n")
            return
        with csv_path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    with csv_path.open(newline="", encoding="utf-8") as file:
        write_page(list(csv.DictReader(file)))


if __name__ == "__main__":
    main()
