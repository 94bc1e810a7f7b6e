"""`mavherd record`: any MAVLink vehicle into a recording, live."""

import argparse
import time
from collections.abc import Callable
from contextlib import ExitStack
from math import inf
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import TYPE_CHECKING, Any

from ...transport.errors import MavherdError, VehicleError
from ..complaint import INSTALL, complain
from ..ctrl_c import noted_stops

if TYPE_CHECKING:
    from ...transport.connect import Address
    from ..recording.outside.live import Watch
    from ..recording.viewers import Viewing

EPILOG = """\
examples:
  mavherd record --listen udp:14550                    whoever sends to this machine's port 14550
  mavherd record --listen udp:0.0.0.0:14550            ... from any network it is in
  mavherd record --connect tcp:127.0.0.1:5760          ArduPilot's simulator
  mavherd record --connect serial:/dev/ttyUSB0:57600   a radio (pip install 'mavherd[serial]')
  mavherd record --listen 14550 --tlog flight.tlog --duration 60 -o flight.rrd

Vehicles appear with their first heartbeat, as sys1, sys2, ... Nothing is ever steered. On
--connect they are asked for telemetry; on --listen only those that tell neither place nor attitude
by themselves (ArduPilot sends little unasked). --silent sends nothing at all.

exit codes: 0 recorded (Ctrl-C ends it), 2 wrong input, 3 no vehicle was heard
"""
_NOTICE = 5  # MAV_SEVERITY: what is told on the terminal, too
_FAREWELL = "Ctrl-C ends it."
_AGAIN_S = 10.0  # a text that is repeated is told so often
_MOST_TEXTS = 1000  # remembered


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of `mavherd record`."""
    add_sources(parser)
    parser.add_argument(
        *("-o", "--output"), type=Path, metavar="FILE.rrd",
        help="the recording (outside-DATE-TIME.rrd)",
    )  # fmt: skip
    parser.add_argument("--tlog", type=Path, metavar="FILE", help="keep all frames, too, as a tlog")
    parser.add_argument(
        "--duration", type=_positive, metavar="S", help="stop after so many seconds"
    )
    parser.add_argument("--force", action="store_true", help="overwrite FILE")


def add_sources(parser: "argparse._ActionsContainer") -> None:
    """Add what says where vehicles are; `mavherd view` has it too."""
    parser.add_argument(
        "--listen", action="append", default=[], metavar="ADDRESS",
        help="udp:PORT (this machine only) or udp:HOST:PORT; may be given again",
    )  # fmt: skip
    parser.add_argument(
        "--connect", action="extend", nargs="+", default=[], metavar="ADDRESS",
        help="tcp:HOST:PORT, udpout:HOST:PORT, udpin:HOST:PORT, serial:DEVICE[:BAUD]",
    )  # fmt: skip
    parser.add_argument("--silent", action="store_true", help="send nothing, whatever is missing")


def run(args: argparse.Namespace) -> int:
    """Record until Ctrl-C, or for the time that was given."""
    sources = addresses(args)
    output = args.output or Path(time.strftime("outside-%Y%m%d-%H%M%S.rrd"))
    for path in filter(None, (output, args.tlog)):
        check_output(path, force=args.force)
    if args.tlog and _names(args.tlog) & _names(output):
        raise MavherdError(f"--tlog {args.tlog}: this is the recording, too (give two files)")
    with open_watch(args, sources, file=output, tlog=args.tlog) as watch:
        listen(watch, args, sources)
    return conclude(watch, output)


def view_outside(args: argparse.Namespace, viewing: "Viewing") -> int:
    """Show outside vehicles live, until Ctrl-C or the end of the window."""
    from ..recording.dashboard import Dashboard

    sources = addresses(args)
    dashboard = Dashboard(viewing, stays=False)
    with NamedTemporaryFile(suffix=".txt") as log, ExitStack() as stack:
        stack.callback(dashboard.ports.release)
        watch = stack.enter_context(open_watch(args, sources, serve=dashboard.ports.data))
        stack.callback(dashboard.close)

        def goes_on() -> bool:
            for text in (*dashboard.open(Path(log.name)), *dashboard.look()):
                complain(text)
            window = dashboard.window
            return bool(viewing.web or window is None or not window.ended)

        listen(watch, args, sources, goes_on)
    return conclude(watch, None)


def addresses(args: argparse.Namespace) -> "list[Address]":
    """Return where to look for vehicles; raise MavherdError where nothing usable is said."""
    from ...transport.connect import parse_connect
    from ..recording.outside.lines import listen_address

    found = [listen_address(text) for text in args.listen]
    found += [parse_connect(text) for text in args.connect]
    if not found:
        raise MavherdError(
            "where is the vehicle? (as in `--listen udp:14550` or `--connect tcp:127.0.0.1:5760`)"
        )
    return found


def open_watch(
    args: argparse.Namespace,
    sources: "list[Address]",
    *,
    file: Path | None = None,
    tlog: Path | None = None,
    serve: int | None = None,
) -> "Watch":
    """Open the lines and the recording; raise MavherdError for what cannot be had."""
    from ..recording.outside.live import Watch

    try:
        return Watch(
            sources,
            file=file,
            tlog=tlog,
            serve=serve,
            silent=args.silent,
            tell=Teller().tell,
            warn=_warn,
        )
    except ModuleNotFoundError as error:
        raise no_rerun(error) from None


def listen(
    watch: "Watch",
    args: argparse.Namespace,
    sources: "list[Address]",
    goes_on: Callable[[], bool] | None = None,
) -> None:
    """Say who is listened to, and do it until Ctrl-C, or the end of the duration."""
    for address in sources:
        verb = "listening at" if address.scheme == "udpin" else "calling"
        only = ", this machine only" if address.scheme == "udpin" and address.loopback else ""
        complain(f"{verb} {address.text}{only}")
    complain(_FAREWELL)
    with noted_stops() as stopped:
        watch.run(stopped, getattr(args, "duration", None), goes_on)
        if stopped():
            complain("")  # after ^C


def conclude(watch: "Watch", output: Path | None) -> int:
    """Say what was recorded; return the exit code."""
    vehicles = watch.outside.vehicles
    if not vehicles:
        raise VehicleError("; ".join(watch.silences()))
    if output:
        size, count = output.stat().st_size / 1e6, len(vehicles)
        who = f"{count} vehicle{'s' if count > 1 else ''}"
        print(f"{output}: {who}, {watch.now:.1f} s, {size:.1f} MB (mavherd view {output})")
    return 0


def check_output(path: Path, *, force: bool) -> None:
    """Raise MavherdError where a file cannot be written, or would be overwritten unasked."""
    if path.is_dir():
        raise MavherdError(f"{path}: this is a folder (give a file)")
    if path.exists() and not force:
        raise MavherdError(f"{path}: exists already (--force overwrites it)")
    if not path.parent.is_dir():
        raise MavherdError(f"{path}: there is no folder {path.parent}")


def _names(path: Path) -> set[Path]:
    """Return what a file is called, when it is complete and until then."""
    whole = path.resolve()
    return {whole, whole.with_name(whole.name + ".part")}


def no_rerun(error: ModuleNotFoundError) -> MavherdError:
    """Return what is said where Rerun is not installed; raise what is another matter."""
    if error.name and error.name.partition(".")[0] == "rerun":
        return MavherdError(f"rerun is not installed ({INSTALL})")
    raise error


class Teller:
    """Tells events that matter; a vehicle's text that comes again and again only now and then."""

    def __init__(self) -> None:
        self._texts: dict[tuple[str, str], tuple[float, int]] = {}  # when told, how often since

    def tell(self, event: dict[str, Any]) -> None:
        """Print an event, if it matters and is not the same text again so soon."""
        now, vehicle, text = event["t"], event["vehicle"], event["text"]
        if event["severity"] > _NOTICE:
            return
        more = 0
        if event["kind"] == "text":
            told_at, more = self._texts.get((vehicle, text), (-inf, 0))
            if now - told_at < _AGAIN_S:
                self._texts[vehicle, text] = told_at, more + 1
                return
            if len(self._texts) >= _MOST_TEXTS:
                self._texts.clear()
            self._texts[vehicle, text] = now, 0
        complain(f"{now:7.1f} s  {vehicle}: {text}{f' (and {more} times before)' if more else ''}")


def _warn(text: str) -> None:
    complain(f"mavherd: {text}")


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is no duration (seconds, more than 0)")
    return value
