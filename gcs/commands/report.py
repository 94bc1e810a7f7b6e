"""`mavherd report`: the report of a run, its tables and figures, written again from its logs."""

import argparse
from pathlib import Path

from ...transport.errors import MavherdError
from ..complaint import complain, deliver

EPILOG = """\
examples:
  mavherd report runs/crossing-targets-...-ab12      of a run that was killed, or to have it anew
  mavherd report RUN --json > report.json

Written are report.json, report.html, states.parquet, events.parquet and figures/. A run that was
killed left none of them: its logs hold what happened until then, and the report says what is
missing. Of a run that has ended by itself report.json comes out as it was, unless mavherd has
learned to say more since; what only the run itself knew (wall time, CPU time) is kept.

exit codes: those of the run: 0 passed, 1 an assertion failed, 3 it died or was killed, 4 timed
out, 130 interrupted; 2 wrong input
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of `mavherd report`."""
    parser.add_argument("folder", type=Path, metavar="RUN", help="a run folder")
    parser.add_argument("--json", action="store_true", help="print report.json, alone, to stdout")


def run(args: argparse.Namespace) -> int:
    """Write everything again and return the exit code of the run."""
    from ..flown.again import report_again
    from ..flown.flown import open_flown
    from ..patience import Patience
    from ..run.terminal import print_outcome

    flown = open_flown(args.folder)
    if flown.goes_on():
        raise MavherdError(f"{args.folder}: this run still goes on (it reports when it ends)")
    try:
        with Patience() as step:
            outcome = report_again(flown, step)
    except OSError as error:
        raise MavherdError(f"{args.folder}: cannot write the report: {error.strerror}") from None
    print_outcome(outcome)
    if told := outcome.report["error"]:
        complain(f"mavherd: {told}")
    if args.json:
        deliver((outcome.folder / "report.json").read_text(encoding="utf-8"))
    return outcome.exit_code
