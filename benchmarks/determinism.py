"""The full proof that one scenario and one seed give the same bytes, whatever else is different.

    python benchmarks/determinism.py                        some ten minutes
    python benchmarks/determinism.py --repeats 3 --scenario one-quad
    python benchmarks/determinism.py --pythons ~/venv312/bin/python ~/venv313/bin/python
    python benchmarks/determinism.py --write                the table into docs/determinism.md

Every run is a `mavherd run` of its own. Where one differs, `mavherd diff` says where, and the exit
code is 1.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import page
from fields import write_field
from machine import facts
from tables import Table

PAGE = Path(__file__).parent.parent / "docs" / "determinism.md"
CORES = sorted(os.sched_getaffinity(0))
CASES = (  # beside the one that is flown in every way: other laws, flight stacks, paths, gusts
    ("crossing-targets", "team.law=paper", "duration=12"),
    ("crossing-targets", "team.law=off", "disturbance=white", "duration=12"),
    ("crossing-targets", "team.autopilot=px4", "disturbance=held", "duration=12"),
    ("circle-traffic", "disturbance=held", "duration=12"),
    ("tracking", "team.autopilot=generic", "duration=12"),
    ("one-quad", "robots.quad1.profile=paper"),
    ("one-rover",),
)
_PORTS = tuple(word for name in ("--gcs-udp", "--api-udp", "--tcp") for word in (name, "0"))
_STAY = "import os, sys; os.sched_setaffinity(0, [{}]); os.execv(sys.argv[1], sys.argv[1:])"


class Way(NamedTuple):
    """One way to run a scenario, so many times."""

    text: str
    runs: int = 1
    options: tuple[str, ...] = ()
    prefix: tuple[str, ...] = ()
    python: str = sys.executable
    loaded: bool = False  # every core has more to do than it can


def ways(repeats: int, pythons: Sequence[str]) -> Iterator[Way]:
    """Yield all ways, beginning with the one that the others are compared with."""
    yield Way("again and again", repeats)
    yield Way("while every core is loaded by other work", repeats, loaded=True)
    one = (sys.executable, "-c", _STAY.format(CORES[0]))
    yield Way("on one core", prefix=one)
    yield Way("on one core, loaded", prefix=one, loaded=True)
    for speed in ("1", "5", "max"):
        yield Way(f"--speed {speed}", options=("--speed", speed))
    yield Way("a coordinator for each robot", options=("--set", "team.coordinators=per-robot"))
    yield Way("--in-process", options=("--in-process",))
    both = ("--in-process", "--set", "team.coordinators=per-robot")
    yield Way("--in-process, a coordinator for each robot", options=both)
    for seed in ("0", "1"):
        yield Way(f"PYTHONHASHSEED={seed}", prefix=("env", f"PYTHONHASHSEED={seed}"))
    for python in pythons:
        version = _said([python, "-m", "mavherd", "version"]).strip()
        yield Way(version.partition(", Linux")[0], python=python)


def short_ways(pythons: Sequence[str], sets: Sequence[str]) -> Iterator[Way]:
    """Yield the ways in which each of the further cases is flown."""
    options = tuple(word for text in sets for word in ("--set", text))
    yield Way("", options=options)
    for python in (sys.executable, *pythons):
        yield Way("", options=("--in-process", *options), python=python)


def fly(scenario: str, way: Way, folder: Path) -> Path:
    """Run it once; return the run folder."""
    command = [*way.prefix, way.python, "-m", "mavherd", "run", scenario, "--no-record"]
    command += ["--out", str(folder), *way.options]
    if "--in-process" not in command:
        command += _PORTS
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1, 4):
        raise SystemExit(f"{way.text}: exit code {done.returncode}: {done.stderr}")
    (found,) = folder.iterdir()
    return found


def prove(scenario: str, todo: Iterator[Way], folder: Path) -> tuple[list[tuple[str, ...]], str]:
    """Run all ways; return a row for each, and where the first that differs does so."""
    rows: list[tuple[str, ...]] = []
    first: Path | None = None
    difference = ""
    for number, way in enumerate(todo):
        print(f"{scenario}: {way.text or way.python} ...", file=sys.stderr, flush=True)
        digests = []
        for repeat in range(way.runs):
            with _load(way.loaded):
                run = fly(scenario, way, folder / f"{number}-{repeat}")
            first = first or run
            digests.append(json.loads((run / "report.json").read_text())["digest"] or "none")
            if digests[-1] != _digest(first) and not difference:
                command = [sys.executable, "-m", "mavherd", "diff", str(first), str(run)]
                difference = _said(command)
        shown = ", ".join(sorted({digest[:16] for digest in digests}))
        same = all(digest == _digest(first) for digest in digests) if first else False
        rows.append((way.text, str(way.runs), shown, "yes" if same else "NO"))
    return rows, difference


def prove_cases(pythons: Sequence[str], folder: Path) -> tuple[list[tuple[str, ...]], str]:
    """Fly the further cases; return a row for each, and where the first that differs does so."""
    rows: list[tuple[str, ...]] = []
    difference = ""
    for number, (name, *sets) in enumerate(CASES):
        flown, told = prove(name, short_ways(pythons, sets), folder / f"case{number}")
        shown = ", ".join(sorted({row[2] for row in flown}))
        equal = "yes" if all(row[-1] == "yes" for row in flown) else "NO"
        rows.append((" ".join((name, *sets)), str(len(flown)), shown, equal))
        difference = difference or told
    return rows, difference


def main() -> int:
    """Prove it, print the table, and return 1 where something differed."""
    parser = argparse.ArgumentParser(description="The same bytes, whatever else is different.")
    parser.add_argument("--scenario", default="crossing-targets")
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--field", type=int, default=100, help="a large team too (0: none)")
    parser.add_argument("--pythons", nargs="*", default=[], help="others that have mavherd")
    parser.add_argument("--write", action="store_true", help="put the tables into the docs")
    args = parser.parse_args()
    heads = "how it was run", "runs", "digest", "equal"
    known = _said([sys.executable, "-m", "mavherd", "version"]).strip()
    parts = [f"Measured with {known}, {facts()['processor']}, {len(CORES)} cores.", ""]
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        rows, difference = prove(args.scenario, ways(args.repeats, args.pythons), folder / "runs")
        parts.append(Table(args.scenario, heads, rows).markdown())
        if args.field:
            scenario = str(write_field(args.field, folder))
            todo = iter(
                [
                    Way("again and again", 3),
                    Way("while every core is loaded by other work", loaded=True),
                    Way("--in-process", options=("--in-process",)),
                ]
            )
            more, other = prove(scenario, todo, folder / "field")
            parts.append(Table(f"{args.field} vehicles", heads, more).markdown())
            rows, difference = rows + more, difference or other
        cases, other = prove_cases(args.pythons, folder)
        note = "As processes, in one process, and in one process of each other Python."
        heads = "scenario", *heads[1:]
        parts.append(Table("Other laws, stacks, paths and gusts", heads, cases, note).markdown())
        difference = difference or other
    told = "\n".join(parts)
    print(told + difference)
    if args.write:
        page.write(PAGE, "proof", told)
    return 1 if any(row[-1] != "yes" for row in (*rows, *cases)) else 0


def _digest(run: Path) -> str:
    return json.loads((run / "report.json").read_text())["digest"] or "none"


def _said(command: Sequence[str]) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout


@contextmanager
def _load(wanted: bool) -> Iterator[None]:
    """Keep every core busy with two loops, while it is wanted."""
    count = 2 * len(CORES) if wanted else 0
    loops = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()


if __name__ == "__main__":
    sys.exit(main())
