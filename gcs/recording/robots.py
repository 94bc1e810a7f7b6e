"""Who takes part in a run, for those who read its folder: `robots.json`."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from ...scenarios.paths import end_point
from ...scenarios.schema import RobotSpec, Team
from ...transport.frames import Triple


class ListedRobot(NamedTuple):
    """An entry of `robots.json`; ENU."""

    name: str
    kind: str
    system_id: int
    start: Triple
    target: Triple  # where its path ends


def write_robots(folder: Path, starts: Iterable[RobotSpec], team: Team) -> None:
    """Write `robots.json` into the folder of a run."""
    robots = [
        ListedRobot(
            spec.name,
            spec.kind,
            spec.system_id,
            (spec.start.east, spec.start.north, spec.start.up or 0.0),
            end_point(spec, team),
        )
        for spec in starts
    ]
    text = json.dumps([robot._asdict() for robot in robots], indent=1)
    (folder / "robots.json").write_text(text + "\n", encoding="utf-8")
