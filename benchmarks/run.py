"""What mavherd costs: every table beside its floor, and the targets reached or missed.

    python benchmarks/run.py             everything: about a quarter of an hour
    python benchmarks/run.py --quick     the small ones: two minutes
    python benchmarks/run.py --only fleets ticks
    python benchmarks/run.py --write     the tables into docs/performance.md, as far as measured

Machines differ and are noisy, so figures are medians, and what counts is their ratio to the floors.
"""

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path

import page
import targets
from alone import floors
from machine import facts
from sections import QUICK, SECTIONS, Effort
from tables import Table

from mavherd.gcs.compiled import state

__all__ = ["floors"]

PAGE = Path(__file__).parent.parent / "docs" / "performance.md"


def main() -> int:
    """Measure, print, and write what is asked for; return the exit code."""
    parser = argparse.ArgumentParser(description="What mavherd costs.")
    parser.add_argument("--quick", action="store_true", help="few repeats, small teams")
    parser.add_argument("--repeats", type=int, help="of what is short (5)")
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=list(SECTIONS))
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures as JSON too")
    parser.add_argument("--write", action="store_true", help="put the tables into the docs")
    args = parser.parse_args()
    effort = QUICK if args.quick else Effort()
    if args.repeats:
        effort = replace(effort, repeats=args.repeats)
    known = {"mavherd": state(), **facts()}
    part = "compiled" if known["mavherd"].startswith("compiled") else "pure"  # of the page
    parts: dict[str, list[Table]] = {}
    figures: dict[str, float] = {}
    told = ", ".join(f"{name} {value}" for name, value in known.items())
    print(f"Measured on: {told}.\n", flush=True)
    for name in args.only:
        section = SECTIONS[name](effort)
        parts.setdefault(name if name == "recording" else part, []).extend(section.tables)
        figures |= section.figures
        print("\n".join(table.markdown() for table in section.tables), flush=True)
    summary = targets.table(figures, compiled=part == "compiled")
    print(summary.markdown())
    if args.json:
        tables = [summary, *(table for tables in parts.values() for table in tables)]
        data = {"machine": known, "figures": figures, "tables": [t._asdict() for t in tables]}
        args.json.write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")
    if args.write:
        for name, tables in parts.items():
            first = [summary] if name == part else []
            lines = [f"Measured on: {told}.\n", *(t.markdown() for t in (*first, *tables))]
            page.write(PAGE, name, "\n".join(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
