"""`mavherd view`: a recording again, or vehicles from outside, in Rerun's viewer."""

import argparse
import re
import tempfile
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from ...transport.errors import MavherdError
from ..complaint import complain
from .record import add_sources
from .vehicle import port

if TYPE_CHECKING:
    from ..recording.viewers import Viewer, Viewing

EPILOG = """\
examples:
  mavherd view runs/crossing-targets-20260101-120000-1a2b     what a run has recorded
  mavherd view runs/crossing-* --web                          in a browser, several runs
  mavherd view RUN --select quad1                             with that robot's plots in front
  mavherd view RUN --screenshot at16.png --time 16            a picture; needs no display
  mavherd view --listen udp:14550                             live: whoever sends to that port
  mavherd view --connect tcp:127.0.0.1:5760 --web             live, in a browser

It ends with the viewer's window, or with Ctrl-C. Everything is served on loopback only. A run
while it goes on is watched with `mavherd run --view`; one without a recording gets it from
`mavherd convert RUN`.
"""
_SMALLEST, _LARGEST = 200, 8000  # pixels


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of `mavherd view`."""
    parser.add_argument(
        "runs", type=Path, nargs="*", metavar="RUN", help="a run's folder, or an .rrd"
    )
    parser.add_argument("--select", metavar="ROBOT", help="show this robot's plots")
    picture = parser.add_argument_group("picture")
    picture.add_argument(
        "--screenshot", type=Path, metavar="FILE.png", help="write a picture and open nothing"
    )
    picture.add_argument(
        "--size", type=_size, default=(1400, 800), metavar="WxH", help="in pixels (1400x800)"
    )
    picture.add_argument(
        "--time", type=_time, metavar="S", help="the moment, in seconds of the run (its end)"
    )
    add_sources(parser.add_argument_group("live, instead of RUN"))
    add_web(parser)


def add_web(parser: argparse.ArgumentParser, watch: str = "") -> None:
    """Add what says how to view; `watch` is what `--view` does, where there is a choice."""
    viewers = parser.add_argument_group("viewers (port 0: any that is free)")
    if watch:
        viewers.add_argument("--view", action="store_true", help=watch)
    viewers.add_argument("--web", action="store_true", help="serve a page for a browser")
    viewers.add_argument(
        "--view-port", type=port, metavar="PORT", help="viewers get the data at (9876 or next free)"
    )
    viewers.add_argument(
        "--web-port", type=port, metavar="PORT", help="browsers get the page at (9090 or next free)"
    )


def run(args: argparse.Namespace) -> int:
    """Show what is asked for until the user has seen enough."""
    from ..recording.viewers import Viewing

    ports = ("--view-port", args.view_port), ("--web-port", args.web_port)
    live = args.connect or args.listen
    for option, number in ports:
        if number is not None and not args.web and not (live and option == "--view-port"):
            raise MavherdError(f"{option} {number}: there is no page (add --web)")
    viewing = Viewing(
        native=not args.web, web=args.web, view_port=args.view_port, web_port=args.web_port
    )
    if live:
        for option, given in (("RUN", args.runs), ("--screenshot", args.screenshot)):
            if given:
                raise MavherdError(f"{option} is not for vehicles that are live (leave it out)")
        from .record import view_outside

        return view_outside(args, viewing)
    if args.screenshot:
        _check_picture(args.screenshot)
    if not args.runs:
        raise MavherdError(f"which run? give its folder{_newest(Path('runs'))}")
    return _replay(args, viewing)


def _replay(args: argparse.Namespace, viewing: "Viewing") -> int:
    from ..recording.replay import find_recording, lay_out, select
    from ..recording.served import prepare
    from ..recording.viewers import open_page, open_window, rerun_binary

    recordings = [find_recording(path) for path in args.runs]
    rerun_binary()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="mavherd-view-")))
        sources = lay_out(recordings, folder)
        for recording in recordings:
            if recording.note:
                complain(f"note: {recording.note}")
        if args.select:
            sources.append(select(recordings, args.select, folder))
        log = folder / "viewers.txt"
        if args.screenshot:
            return _screenshot(args, sources, log)
        ports = prepare(viewing)
        stack.callback(ports.release)
        if viewing.web:
            viewer = open_page(sources, ports.data, ports.page, log)
            complain(f"to see it in a browser: {ports.url} (Ctrl-C ends this)")
        else:
            viewer = open_window(sources, log, leash=True)
        stack.callback(viewer.end)
        return _wait(viewer)


def _wait(viewer: "Viewer") -> int:
    """Wait until the viewer is closed, by whomever."""
    from ...vehicles.brood import heed_stops

    heed_stops()
    with suppress(KeyboardInterrupt):
        viewer.wait()
        if death := viewer.death():
            complain(f"mavherd: {death}")
            return 3
    return 0


def _screenshot(args: argparse.Namespace, sources: list[Path], log: Path) -> int:
    from ..recording.screenshot import Size, take

    take(sources, args.screenshot, Size(*args.size), args.time, log)
    print(args.screenshot)
    return 0


def _check_picture(picture: Path) -> None:
    if picture.suffix != ".png":
        raise MavherdError(f"--screenshot {picture}: pictures are PNG (name it .png)")
    if not picture.parent.is_dir():
        raise MavherdError(f"--screenshot {picture}: there is no folder {picture.parent}")


def _newest(runs: Path) -> str:
    from ..flown.folder import is_run

    with suppress(OSError):
        if found := sorted(filter(is_run, runs.iterdir()), key=lambda run: run.stat().st_mtime):
            return f" (the newest is {found[-1]})"
    return " (as `mavherd run` prints it)"


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    sides = tuple(map(int, match.groups())) if match else ()
    if len(sides) != 2 or not all(_SMALLEST <= side <= _LARGEST for side in sides):
        raise argparse.ArgumentTypeError(
            f"{text!r} is no size, WIDTHxHEIGHT of {_SMALLEST}..{_LARGEST} pixels"
        )
    return sides


def _time(text: str) -> float:
    with suppress(ValueError):
        if 0.0 <= (seconds := float(text)) < 1e6:
            return seconds
    raise argparse.ArgumentTypeError(f"{text!r} is no time in seconds")
