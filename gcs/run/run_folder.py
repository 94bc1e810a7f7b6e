"""The folder of one run, with what is known before the run begins."""

import secrets
import time
from collections.abc import Sequence
from pathlib import Path
from shutil import rmtree

from ...scenarios.dump import scenario_to_yaml
from ...scenarios.schema import RobotSpec, Scenario
from ...transport.errors import LinkError
from ..recording.robots import write_robots


def name_folder(out: Path, scenario: Scenario) -> Path:
    """Return a path below `out` that no other run has."""
    stamp = time.strftime("%Y%m%d-%H%M%S")
    return out / f"{scenario.name}-{stamp}-{secrets.token_hex(2)}"


def make_folder(folder: Path, scenario: Scenario, starts: Sequence[RobotSpec]) -> None:
    """Make `folder` with one for each robot, the resolved scenario, and who takes part.

    Nothing is left of one that cannot be made.
    """
    try:
        for spec in starts:
            (folder / "vehicles" / spec.name).mkdir(parents=True)
        (folder / "scenario.yaml").write_text(scenario_to_yaml(scenario), encoding="utf-8")
        write_robots(folder, starts, scenario.team)
    except OSError as error:
        rmtree(folder, ignore_errors=True)
        raise LinkError(f"{folder}: cannot write the run folder: {error.strerror}") from None
