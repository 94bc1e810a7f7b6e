"""`mavherd diff`: the first message, field, vehicle and time at which two runs part."""

import argparse
import json
from pathlib import Path

EPILOG = """\
examples:
  mavherd diff runs/crossing-targets-...-ab12 runs/crossing-targets-...-cd34
  mavherd diff RUN_A RUN_B --json

Compared are the coordinators' links, both directions, as in the digest: message by message, in
order of fleet time; within a tick what vehicles said comes before what the ground answered, then
by system id. Values are A | B.

exit codes: 0 equal, 1 different, 2 wrong input
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of `mavherd diff`."""
    parser.add_argument("a", type=Path, metavar="RUN_A", help="a run folder")
    parser.add_argument("b", type=Path, metavar="RUN_B", help="another one")
    parser.add_argument("--json", action="store_true", help="print it all as JSON, alone")


def run(args: argparse.Namespace) -> int:
    """Print where the runs part; return 1 when they do."""
    from ..diff.as_json import as_json
    from ..diff.run_folder import open_run
    from ..diff.runs import difference
    from ..diff.wording import lines

    found = difference(open_run(args.a), open_run(args.b))
    if args.json:
        print(json.dumps(as_json(found), indent=2, allow_nan=False))
    else:
        print("\n".join(lines(found)))
    return 0 if found.equal else 1
