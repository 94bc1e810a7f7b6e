"""`mavherd run`: a scenario from start to report."""

import argparse
import sys
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from ...transport.errors import MavherdError
from ...vehicles.config import AUTOPILOTS
from ..complaint import complain, deliver
from .vehicle import port
from .view import add_web

if TYPE_CHECKING:
    from ..recording.viewers import Viewing
    from ..run.head_start import HeadStart

EPILOG = """\
examples:
  mavherd run crossing-targets                         as fast as the machine allows
  mavherd run crossing-targets --seed 7 --set team.law=paper
  mavherd run crossing-targets --view                  watch it in Rerun, at real time
  mavherd run crossing-targets --web --speed 3         ... in a browser, three times as fast
  mavherd run crossing-targets --autopilot px4         our own vehicles speak PX4
  mavherd run my.yaml --speed 1                        lockstep, paced to real time
  mavherd run my.yaml --paused                         waits at the start for space, or a step
  mavherd run circle-traffic --set disturbance=held --json > report.json
  mavherd run tracking --set robots.quad1.params.mass=1.4
  mavherd run one-quad --set robots.quad1.connect=tcp:127.0.0.1:5760   fly a SITL instead

While it runs, at a terminal: space pauses and resumes, `.` steps, `+` and `-` change the speed,
`1` is real time, `m` as fast as it goes, `q` ends it. From elsewhere: `mavherd clock RUN pause`.
A viewer may come, freeze and go as it likes; its window stays when the run is over. A page can be
loaded again until Enter or Ctrl-C, where there is a terminal; an open one keeps what it has.
A ground station can watch on UDP 14550 at any time; other ports are printed at the start.
`mavherd check` tells first whether external vehicles (`connect`) are ready; see docs/external.md.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of `mavherd run`."""
    add_scenario_arguments(parser)
    parser.add_argument(
        "--autopilot",
        choices=AUTOPILOTS,
        help="the flight stack of our own vehicles (team.autopilot; ardupilot)",
    )
    clock = parser.add_mutually_exclusive_group()
    clock.add_argument(
        "--lockstep",
        action="store_true",
        help="conduct every process tick by tick (default, unless vehicles are external)",
    )
    clock.add_argument(
        "--free-run", action="store_true", help="every process follows the wall clock instead"
    )
    parser.add_argument(
        "--speed", metavar="S", help="times real time, or max (default) for as fast as it goes"
    )
    parser.add_argument(
        "--paused", action="store_true", help="begin with time standing still (lockstep)"
    )
    parser.add_argument(
        "--in-process",
        action="store_true",
        help="all vehicles and the coordinator in one process: no ports, no bus, the same bytes",
    )
    parser.add_argument(
        "--confirm",
        action="store_true",
        help="fly vehicles that are not on this machine's loopback; needs a fence",
    )
    parser.add_argument("--json", action="store_true", help="print report.json, alone, to stdout")
    parser.add_argument(
        "--junit", type=Path, metavar="FILE", help="write the verdict as JUnit XML, for CI"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("runs"), metavar="DIR", help="for run folders (runs)"
    )
    parser.add_argument(
        "--record",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="write a Rerun recording, run.rrd (default)",
    )
    add_web(parser, "watch it in Rerun while it goes on (--speed is then 1 unless given)")
    ports = parser.add_argument_group("ports (0 opens none)")
    ports.add_argument("--gcs-udp", type=port, metavar="PORT", help="all vehicles send to (14550)")
    ports.add_argument(
        "--api-udp", type=port, metavar="PORT", help="vehicle i sends to PORT + i (14540)"
    )
    ports.add_argument(
        "--tcp", type=port, metavar="PORT", help="vehicle i serves PORT + 10 i (5760 or next free)"
    )


def add_scenario_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what names a scenario and changes it."""
    parser.add_argument("scenario", help="a YAML file, or the name of a shipped scenario")
    parser.add_argument("--seed", type=int, help="draws start offsets and disturbance")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change one key, such as team.law=paper (may be repeated)",
    )


def run(args: argparse.Namespace) -> int:
    """Run the scenario and return the exit code."""
    if args.in_process:
        return _run(args, None)
    from ..run.head_start import HeadStart

    with HeadStart() as head_start:  # they import while we do
        return _run(args, head_start)


def _run(args: argparse.Namespace, head_start: "HeadStart | None") -> int:
    from ...scenarios.loader import load_scenario
    from ..report.junit import junit_file
    from ..run.keys import keys_of_terminal
    from ..run.launcher import Run, RunOptions
    from ..run.ports import PortPlan
    from ..run.terminal import RunView, print_outcome
    from ..safety.permission import external, permit

    stack = [f"team.autopilot={args.autopilot}"] if args.autopilot else []
    scenario = load_scenario(args.scenario, [*stack, *args.set], args.seed)
    permit(external(scenario), scenario.fence, None if args.confirm else "--confirm")
    others = ", ".join(external(scenario))
    if others and args.lockstep:
        raise MavherdError(
            f"--lockstep: {others} cannot be conducted, for external vehicles follow a clock of"
            " their own (leave it out: the team runs free)"
        )
    lockstep = not (others or args.free_run)
    _check_clock(args, lockstep, external(scenario))
    viewing = _viewing(args)
    if viewing and lockstep and args.speed is None:
        args.speed = "1"
        complain("note: at real time, for it is watched (--speed max: as fast as it goes)")
    options = RunOptions(
        lockstep=lockstep,
        speed=_speed(args.speed, lockstep),
        paused=args.paused,
        in_process=args.in_process,
        record=args.record,
        viewing=viewing,
        out=args.out,
        ports=PortPlan(gcs_udp=args.gcs_udp, api_udp=args.api_udp, tcp=args.tcp),
    )
    if others and not args.free_run:
        complain(f"note: the team runs free, on the wall clock; external: {others}")
    keys = keys_of_terminal() if lockstep else None
    if args.paused and args.in_process and keys is None:
        raise MavherdError(
            "--paused: with --in-process only the keys of a terminal can resume it, and there is"
            " none (leave out one of them)"
        )
    view = RunView(scenario, keys=keys is not None)
    with Run(scenario, options, view, keys, head_start) as run:
        with junit_file(args.junit, scenario.name) as tell, view:
            outcome = run.execute()
            tell(outcome.report)
        print_outcome(outcome)
        if error := outcome.report["error"]:
            complain(f"mavherd: {error}")
        if args.json:
            deliver((outcome.folder / "report.json").read_text(encoding="utf-8"))
        _stay(run.page)
    return outcome.exit_code


def _stay(page: str) -> None:
    """Serve a page that can be loaded again until the user at the terminal has seen enough."""
    if page and sys.stdin and sys.stdin.isatty() and sys.stderr and sys.stderr.isatty():
        complain(f"still to be seen at {page} (Enter or Ctrl-C ends this)")
        with suppress(KeyboardInterrupt):
            sys.stdin.readline()


def _viewing(args: argparse.Namespace) -> "Viewing | None":
    """Return what the user wants to see while it goes on; refuse what cannot be shown."""
    if not (args.view or args.web):
        for option, number in (("--view-port", args.view_port), ("--web-port", args.web_port)):
            if number is not None:
                raise MavherdError(f"{option} {number}: nobody watches (add --view or --web)")
        return None
    option = "--view" if args.view else "--web"
    if args.in_process:
        raise MavherdError(
            f"{option}: with --in-process nothing is recorded, so there is nothing to see"
            " (leave out --in-process)"
        )
    if args.web_port is not None and not args.web:
        raise MavherdError(f"--web-port {args.web_port}: there is no page (add --web)")
    from ..recording.served import prepare
    from ..recording.viewers import Viewing

    ports = {"view_port": args.view_port, "web_port": args.web_port}
    viewing = Viewing(native=args.view, web=args.web, **ports)
    prepare(viewing).release()  # what cannot be had here is refused before anything else is said
    return viewing


def _check_clock(args: argparse.Namespace, lockstep: bool, others: Collection[str]) -> None:
    """Refuse what free-running cannot do; `others` are the external vehicles, which need it."""
    for option, given in (("--paused", args.paused), ("--in-process", args.in_process)):
        if given and others:
            keys = ", ".join(f"robots.{name}.connect" for name in others)
            raise MavherdError(
                f"{option}: the team runs free, on the wall clock, because of {keys}: external"
                f" vehicles follow a clock of their own (leave out {option}, or `connect`)"
            )
        if given and not lockstep:
            raise MavherdError(f"{option}: the team runs free, on the wall clock (leave it out)")
    ports = ("--gcs-udp", args.gcs_udp), ("--api-udp", args.api_udp), ("--tcp", args.tcp)
    for option, number in ports:
        if number and args.in_process:
            raise MavherdError(
                f"{option} {number}: with --in-process there are no ports (leave out one of them)"
            )


def _speed(text: str | None, lockstep: bool) -> float | None:
    """Return the factor asked for, None for "max"."""
    from ..run.pacing import read_speed

    if text in (None, "max"):
        return None if lockstep else 1.0
    try:
        speed = read_speed(text or "")
    except MavherdError as error:
        raise MavherdError(f"--{error}") from None
    if not lockstep and speed != 1:
        raise MavherdError("--speed: free-running follows the wall clock (leave it out)")
    return speed
