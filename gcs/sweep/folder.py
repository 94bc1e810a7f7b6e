"""A sweep's folder: what is called how in it, how it begins, and how it is found again."""

import secrets
import time
from collections.abc import Sequence
from pathlib import Path

from ...scenarios.schema import Scenario
from ...transport.errors import MavherdError
from ..new_file import write_text
from .plan import Plan, difference, plan_from_json, plan_to_json

PLAN = "sweep.json"
SCENARIO = "scenario.yaml"  # as it was written when the sweep began
STREAM = "results.arrows"  # while the sweep goes on
TABLE = "results.parquet"  # when it is complete
SUMMARY = "summary.json"
FIGURES = "figures"
SCRATCH = "underway"  # run folders of runs through processes


def new_folder(scenario: str) -> Path:
    """Return the name of a folder that nobody has."""
    stamp = time.strftime("%Y%m%d-%H%M%S")
    return Path("sweeps") / f"{scenario}-{stamp}-{secrets.token_hex(2)}"


def read_plan(folder: Path) -> Plan:
    """Return the plan of the sweep in `folder`."""
    path = folder / PLAN
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not text"
        raise MavherdError(f"{path}: {reason} (is {folder} a sweep's folder?)") from None
    return plan_from_json(text, path)


def begin(folder: Path, plan: Plan, points: Sequence[Scenario], text: str) -> None:
    """Make the folder of a sweep, with its plan and its scenario's text.

    A folder that has the same plan stays as it is; raise MavherdError when it has another one.
    """
    if (folder / PLAN).exists():
        if unlike := difference(read_plan(folder), plan):
            raise MavherdError(
                f"--out {folder}: has another sweep: {unlike} (choose another folder, or"
                f" go on with that one: mavherd sweep --resume {folder})"
            )
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
        ours = {SCENARIO, f"{PLAN}.part"}
        if strange := sorted({path.name for path in folder.iterdir()} - ours):
            raise MavherdError(
                f"--out {folder}: has files that are no sweep's, {strange[0]!r} first"
            )
        (folder / SCENARIO).write_text(text, encoding="utf-8")
        write_text(folder / PLAN, plan_to_json(plan, points))
    except OSError as error:
        raise MavherdError(f"{folder}: cannot make this folder: {error.strerror}") from None
