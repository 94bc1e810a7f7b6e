"""`mavherd compare`: runs side by side, at the terminal, as a page and as a recording."""

import argparse
import json
from pathlib import Path

from ...transport.errors import MavherdError
from ..complaint import complain, deliver

EPILOG = """\
examples:
  mavherd compare runs/crossing-targets-*                 all of them
  mavherd compare RUN_OFF RUN_PAPER RUN_SAFE -o laws      into a folder of that name
  mavherd compare RUN_A RUN_B --json | jq .measures

Printed is one table: what differs in the settings names the runs. Written are compare.html (the
table, overlaid tracks and separations), compare.json, and compare.rrd (all runs on one timeline
that begins when all were ready). Runs without a report are judged by their logs. Where two runs
part, message by message, is what `mavherd diff` says.

exit codes: 0 compared, 2 wrong input
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of `mavherd compare`."""
    parser.add_argument("runs", type=Path, nargs="+", metavar="RUN", help="run folders, in order")
    parser.add_argument(
        "-o", "--out", type=Path, metavar="DIR", help="where to write it (comparisons/...)"
    )
    parser.add_argument("--force", action="store_true", help="replace the comparison in DIR")
    parser.add_argument("--json", action="store_true", help="print compare.json, alone, to stdout")


def run(args: argparse.Namespace) -> int:
    """Compare the runs, and say where it was written."""
    from ..compare.compare import check_place, compare, new_folder
    from ..compare.lineup import line_up
    from ..compare.table import comparison
    from ..patience import Patience
    from ..run.console import QuietConsole

    if args.out:
        check_place(args.out, force=args.force)
    with Patience() as step:
        step("reading the runs")
        found = line_up(args.runs)
        folder = args.out or new_folder(found.scenarios)
        try:
            written = compare(found, folder, step)
        except OSError as error:
            raise MavherdError(f"{folder}: cannot write there: {error.strerror}") from None
    console = QuietConsole()
    console.print(comparison(found, written.standings, console))
    for path in written.files:
        console.print(f"[dim]written[/dim] {path}", highlight=False, soft_wrap=True)
    for note in written.notes:
        complain(f"note: {note}")
    if args.json:
        deliver(json.dumps(written.data, indent=2, allow_nan=False) + "\n")
    return 0
