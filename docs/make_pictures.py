"""Make the pictures of README and docs: `python docs/make_pictures.py [NAME...]`.

All of them come out of runs that are flown now. Names are those of the parts below; all unless
some are given. What cannot be made here, for want of a browser or a graphics driver, is told and
left as it is, and the rest is made.
"""

import argparse
import sys
from collections.abc import Callable

import laws_picture
import live_pictures
import page_pictures
import paper_figures
import recorded_pictures
import step_response

from mavherd.transport.errors import MavherdError

PARTS: dict[str, tuple[str, Callable[[], None]]] = {
    "step": ("step responses of both vehicles", step_response.main),
    "laws": ("both traffic missions under every law", laws_picture.main),
    "paper": ("the paper's Figures 4, 5 and 6 beside law safe", paper_figures.main),
    "pages": ("report and comparison in Chromium", page_pictures.main),
    "live": ("the dashboard in a live run, in its window and in Chromium", live_pictures.main),
    "recorded": ("the dashboard of one robot and of a hundred", recorded_pictures.main),
}
MOST_BYTES = 2_500_000  # of all pictures, which everybody downloads


def main() -> int:
    """Make them; return 1 when something could not be made."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        epilog="\n".join(f"{name:9} {text}" for name, (text, _) in PARTS.items()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(PARTS))
    args = parser.parse_args()
    if unknown := [name for name in args.names if name not in PARTS]:
        parser.error(f"no such pictures: {', '.join(unknown)} (there are {', '.join(PARTS)})")
    missing = []
    for name in args.names or PARTS:
        text, make = PARTS[name]
        try:
            make()
        except (SystemExit, MavherdError, OSError, RuntimeError) as error:
            missing.append(name)
            print(f"{name}: left as it is, {text}: {error}", file=sys.stderr)
    total = sum(path.stat().st_size for path in paper_figures.PICTURES.iterdir())
    print(f"{total // 1000} kB of pictures")
    if total > MOST_BYTES:
        print(f"more than {MOST_BYTES // 1000} kB: make some smaller", file=sys.stderr)
    if missing:
        names = " ".join(missing)
        print(f"once that is there: python docs/make_pictures.py {names}", file=sys.stderr)
    return 1 if missing or total > MOST_BYTES else 0


if __name__ == "__main__":
    sys.exit(main())
