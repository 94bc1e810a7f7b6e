"""Scenarios with any number of robots, for benchmarks: quadcopters and rovers on crossing ways.

    python benchmarks/fields.py 100 > field-100.yaml
    mavherd run field-100.yaml

The robots stand on a square grid, kinds like the colours of a chessboard. All go east; every
other row also goes north, the rows between them south, so that ways cross and goals are apart.
"""

import sys
from math import ceil, sqrt
from pathlib import Path

SPACING_M = 5.0  # of the grid
DURATION_S = 120


def field(robots: int, *, spacing: float = SPACING_M) -> str:
    """Return the YAML of a scenario of so many robots, all within reach of their goals in 20 s."""
    width = ceil(sqrt(robots))
    lines = [
        f"name: field-{robots}",
        f"duration: {DURATION_S}",
        "team: {law: safe}",
        "robots:",
    ]
    for index in range(robots):
        row, column = divmod(index, width)
        east, north = column * spacing, row * spacing
        goal_north = north + (1.0 if row % 2 else -1.5) * spacing  # never the same for two rows
        is_rover = (row + column) % 2
        kind, name = ("rover", "rover") if is_rover else ("quadcopter", "quad")
        goal = f"east: {east + 1.5 * spacing:g}, north: {goal_north:g}"
        goal += "" if is_rover else ", up: 3"
        lines.append(
            f"  - {{name: {name}{index + 1}, kind: {kind}, "
            f"start: {{east: {east:g}, north: {north:g}}}, goto: {{{goal}}}}}"
        )
    return "\n".join([*lines, "expect: {collisions: 0}", ""])


def write_field(robots: int, folder: Path) -> Path:
    """Write such a scenario into a folder; return its path."""
    path = folder / f"field-{robots}.yaml"
    path.write_text(field(robots), encoding="utf-8")
    return path


if __name__ == "__main__":
    print(field(int(sys.argv[1])), end="")
