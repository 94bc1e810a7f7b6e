"""`mavherd digest`: a run's digest again from its tlogs, or why they do not give one."""

import argparse
import json
from pathlib import Path
from typing import Any

from ...transport.errors import MavherdError
from ..complaint import complain

EPILOG = """\
It is the SHA-256 over the coordinators' links, both directions, in order of system id. On stderr it
is said when that is not the digest which the run has left in report.json.

exit codes: 0 computed, 2 wrong input: no run's folder, a torn log, or a run without a digest
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of `mavherd digest`."""
    parser.add_argument("folder", type=Path, metavar="RUN", help="a run folder")


def run(args: argparse.Namespace) -> int:
    """Print the digest; raise MavherdError when there is none."""
    from ...transport.tlog import digest, tear, torn_at

    folder: Path = args.folder
    try:
        robots = json.loads((folder / "robots.json").read_text(encoding="utf-8"))
        names = [r["name"] for r in sorted(robots, key=lambda r: r["system_id"])]
        logs = [folder / "vehicles" / name / f"{name}.tlog" for name in names]
        report = _report(folder / "report.json")
        for log in logs:
            if (at := torn_at(log)) is not None:
                raise MavherdError(f"{log}: {tear(at)} (a digest needs every log whole)")
        found = digest(logs)
    except OSError as error:
        raise MavherdError(
            f"{error.filename}: {error.strerror} (is {folder} a finished run's folder?)"
        ) from None
    except (ValueError, KeyError, TypeError):
        raise MavherdError(f"{folder}: robots.json is not one of mavherd's") from None
    print(found)
    told = report.get("digest")
    if isinstance(told, str) and told != found:
        complain(
            f"mavherd: {folder}: report.json has digest {told[:16]}..., its logs give"
            f" {found[:16]}... (they were changed after the run)"
        )
    return 0


def _report(path: Path) -> dict[str, Any]:
    """Return the report of a run that has a digest, empty when it has left none."""
    if not path.exists():
        return {}
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        report = None
    if not isinstance(report, dict):
        raise MavherdError(f"{path}: this is not a run's report")
    if report.get("lockstep") is False:
        raise MavherdError(
            f"{path.parent}: the run was free, on the wall clock, and has no digest"
            " (only lockstep runs have one)"
        )
    if report.get("digest", "") is None:
        raise MavherdError(
            f"{path.parent}: the run left no digest (it ended before its first tick, or lost a log)"
        )
    return report
