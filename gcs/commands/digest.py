"""`mavherd digest`: a run's digest again from its tlogs, or why they do not give one."""

import argparse
from collections.abc import Mapping
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
    from ..flown.flown import open_flown

    flown = open_flown(args.folder)
    folder, report = flown.folder, flown.report or {}
    if why := _has_none(report):
        raise MavherdError(f"{folder}: {why}")
    names = [spec.name for spec in sorted(flown.starts, key=lambda spec: spec.system_id)]
    logs = [folder / "vehicles" / name / f"{name}.tlog" for name in names]
    try:
        for log in logs:
            if (at := torn_at(log)) is not None:
                raise MavherdError(f"{log}: {tear(at)} (a digest needs every log whole)")
        found = digest(logs)
    except OSError as error:
        raise MavherdError(
            f"{error.filename}: {error.strerror} (is {folder} a finished run's folder?)"
        ) from None
    print(found)
    if flown.damaged:
        complain(f"mavherd: {folder}: {flown.damaged}")
    told = report.get("digest")
    if isinstance(told, str) and told != found:
        complain(
            f"mavherd: {folder}: report.json has digest {told[:16]}..., its logs give"
            f" {found[:16]}... (they were changed after the run)"
        )
    return 0


def _has_none(report: Mapping[str, Any]) -> str:
    """Return why a run has no digest, as its report tells; "" when it has one."""
    if report.get("lockstep") is False:
        return (
            "the run was free, on the wall clock, and has no digest (only lockstep runs have one)"
        )
    if report.get("digest", "") is None:
        return "the run left no digest (it ended before its first tick, or lost a log)"
    return ""
