"""The command line. Each subcommand is one small function; heavy imports happen inside them."""

import argparse
import json
import math
import os
import re
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn

from .. import __version__
from ..transport.errors import MavherdError, os_reason
from . import vehicle_command
from .vehicle_command import port

_EPILOG = """\
first steps:
  mavherd scenarios                        what comes with mavherd
  mavherd run one-quad                     one quadcopter takes off, flies and lands
  mavherd run crossing-targets --speed 3   six robots cross, three times as fast as real time
  mavherd vehicle quadcopter               one honest MAVLink vehicle, no scenario

exit codes: 0 passed, 1 an assertion of the scenario failed, 2 wrong input, 3 a vehicle or the
coordinator could not start or died, 4 timed out, 130 interrupted
"""

_RUN_EPILOG = """\
examples:
  mavherd run crossing-targets                         as fast as the machine allows
  mavherd run crossing-targets --seed 7 --set team.law=paper
  mavherd run my.yaml --speed 1                        lockstep, paced to real time
  mavherd run circle-traffic --set disturbance=held --json > report.json
  mavherd run tracking --set robots.quad1.params.mass=1.4

A ground station can watch on UDP 14550 at any time; other ports are printed at the start.
"""


def main(argv: list[str] | None = None) -> int:
    """Run one subcommand; return the process exit code."""
    try:
        args = _parser().parse_args(argv)
        code = int(args.run(args))
        if sys.stdout:
            sys.stdout.flush()
        return code
    except MavherdError as error:
        print(f"mavherd: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("mavherd: interrupted", file=sys.stderr)
        return 130
    except OSError as error:  # a full disk, or a closed pipe: `mavherd scenarios | head -1`
        _give_up_stdout()
        if isinstance(error, BrokenPipeError):
            return 0
        print(f"mavherd: {os_reason(error)}", file=sys.stderr)
        return 2


def _give_up_stdout() -> None:
    """Have the interpreter's last flush go nowhere instead of failing again."""
    with suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _run(args: argparse.Namespace) -> int:
    from ..scenarios.loader import load_scenario
    from .launcher import Run, RunOptions
    from .ports import PortPlan
    from .terminal import RunView, print_outcome

    lockstep = not args.free_run
    scenario = load_scenario(args.scenario, args.set, args.seed)
    options = RunOptions(
        lockstep=lockstep,
        speed=_speed(args.speed, lockstep),
        record=args.record,
        out=args.out,
        ports=PortPlan(gcs_udp=args.gcs_udp, api_udp=args.api_udp, tcp=args.tcp),
    )
    with RunView(scenario) as view:
        outcome = Run(scenario, options, view).execute()
    print_outcome(outcome)
    if error := outcome.report["error"]:
        print(f"mavherd: {error}", file=sys.stderr)
    if args.json:
        print((outcome.folder / "report.json").read_text(encoding="utf-8"), end="")
    return outcome.exit_code


def _check(args: argparse.Namespace) -> int:
    from ..scenarios.loader import load_scenario
    from .coordinator import check_laws

    scenario = load_scenario(args.scenario, args.set, args.seed)
    check_laws(scenario)
    print(f"{scenario.name}: {len(scenario.robots)} robots, law {scenario.team.law}: ok")
    return 0


def _scenarios(args: argparse.Namespace) -> int:
    from ..scenarios.loader import shipped

    scenarios = shipped()
    width = max(len(name) for name, _ in scenarios)
    for name, description in scenarios:
        print(f"{name:{width}}  {description}")
    return 0


def _version(args: argparse.Namespace) -> int:
    print(f"mavherd {__version__}")
    return 0


def _digest(args: argparse.Namespace) -> int:
    from ..transport.tlog import digest

    try:
        robots = json.loads((args.folder / "robots.json").read_text(encoding="utf-8"))
        names = [r["name"] for r in sorted(robots, key=lambda r: r["system_id"])]
        print(digest(args.folder / "vehicles" / name / f"{name}.tlog" for name in names))
    except OSError as error:
        raise MavherdError(
            f"{error.filename}: {error.strerror} (is {args.folder} a finished run's folder?)"
        ) from None
    except (ValueError, KeyError, TypeError):
        raise MavherdError(f"{args.folder}: robots.json is not one of mavherd's") from None
    return 0


def _speed(text: str | None, lockstep: bool) -> float | None:
    """Return the factor asked for, None for "max"."""
    if text in (None, "max"):
        return None if lockstep else 1.0
    try:
        speed = float(text or "")
    except ValueError:
        speed = math.nan
    if not 0.01 <= speed <= 1000:
        raise MavherdError(f"--speed {text}: expected a factor of 0.01..1000, or max")
    if not lockstep and speed != 1:
        raise MavherdError("--speed: free-running follows the wall clock; leave out one of the two")
    return speed


class _Parser(argparse.ArgumentParser):
    """Complains in one line, and takes `--home -35.36,149.17,584,0` for what it is."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._negative_number_matcher = re.compile(r"-\.?\d")

    def error(self, message: str) -> NoReturn:
        """Exit with 2."""
        self.exit(2, f"mavherd: {message} (see {self.prog} --help)\n")


def _parser() -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = _Parser(
        prog="mavherd",
        description="A mixed air-ground MAVLink fleet on one laptop.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _add_run(commands)
    _add_vehicle(commands)
    check = _add(commands, "check", _check, "say whether a scenario can be run")
    _add_scenario_arguments(check)
    _add(commands, "scenarios", _scenarios, "list the shipped scenarios")
    digest = _add(commands, "digest", _digest, "compute a run's digest again from its tlogs")
    digest.add_argument("folder", type=Path, metavar="RUN", help="a run folder")
    _add(commands, "version", _version, "print the version")
    return parser


def _add_run(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    run = _add(commands, "run", _run, "run a scenario and judge it", _RUN_EPILOG)
    _add_scenario_arguments(run)
    clock = run.add_mutually_exclusive_group()
    clock.add_argument(
        "--lockstep", action="store_true", help="conduct every process tick by tick (default)"
    )
    clock.add_argument(
        "--free-run", action="store_true", help="every process follows the wall clock instead"
    )
    run.add_argument(
        "--speed", metavar="S", help="times real time, or max (default) for as fast as it goes"
    )
    run.add_argument("--json", action="store_true", help="print report.json, alone, to stdout")
    run.add_argument(
        "--out", type=Path, default=Path("runs"), metavar="DIR", help="for run folders (runs)"
    )
    run.add_argument(
        "--no-record", dest="record", action="store_false", help="leave out the Rerun recording"
    )
    ports = run.add_argument_group("ports (0 opens none)")
    ports.add_argument("--gcs-udp", type=port, metavar="PORT", help="all vehicles send to (14550)")
    ports.add_argument(
        "--api-udp", type=port, metavar="PORT", help="vehicle i sends to PORT + i (14540)"
    )
    ports.add_argument(
        "--tcp", type=port, metavar="PORT", help="vehicle i serves PORT + 10 i (5760 or next free)"
    )


def _add_vehicle(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    text = "honest MAVLink vehicles by hand, until Ctrl-C"
    vehicle_command.add_options(
        _add(commands, "vehicle", vehicle_command.run, text, vehicle_command.EPILOG)
    )


def _add(
    commands: "argparse._SubParsersAction[argparse.ArgumentParser]",
    name: str,
    run: object,
    text: str,
    epilog: str = "",
) -> argparse.ArgumentParser:
    command: argparse.ArgumentParser = commands.add_parser(
        name,
        help=text,
        description=text[0].upper() + text[1:] + ".",
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.set_defaults(run=run)
    return command


def _add_scenario_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scenario", help="a YAML file, or the name of a shipped scenario")
    parser.add_argument("--seed", type=int, help="draws start offsets and disturbance")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change one key, such as team.law=paper (may be repeated)",
    )
