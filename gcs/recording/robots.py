"""What the recorder must know of the robots before they move."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from ...scenarios.paths import end_point
from ...scenarios.schema import RobotSpec, Team
from ...transport.frames import Triple


class RecordedRobot(NamedTuple):
    """What a recording must know of a robot beforehand (ENU); an entry of `robots.json`."""

    name: str
    kind: str
    system_id: int
    start: Triple
    target: Triple  # where its path ends


def write_robots(folder: Path, starts: Iterable[RobotSpec], team: Team) -> None:
    """Write `robots.json` for the recorder that will be started on `folder`."""
    robots = [
        RecordedRobot(
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


def read_robots(folder: Path) -> list[RecordedRobot]:
    """Return the robots that `write_robots` wrote."""
    entries = json.loads((folder / "robots.json").read_text(encoding="utf-8"))
    return [
        RecordedRobot(**{**entry, "start": tuple(entry["start"]), "target": tuple(entry["target"])})
        for entry in entries
    ]
