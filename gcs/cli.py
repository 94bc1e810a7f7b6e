"""The command line. Each subcommand is one small function; heavy imports happen inside them."""

import argparse
import re
import sys
from typing import Any, NoReturn

from ..transport.errors import MavherdError, os_reason
from .commands import check as check_command
from .commands import clock as clock_command
from .commands import compare as compare_command
from .commands import convert as convert_command
from .commands import diff as diff_command
from .commands import digest as digest_command
from .commands import record as record_command
from .commands import report as report_command
from .commands import run as run_command
from .commands import sweep as sweep_command
from .commands import vehicle as vehicle_command
from .commands import version as version_command
from .commands import view as view_command
from .complaint import complain, deliver, give_up, interrupted, settle

_EPILOG = """\
first steps:
  mavherd scenarios                        what comes with mavherd
  mavherd run one-quad                     one quadcopter takes off, flies and lands
  mavherd run crossing-targets --speed 3   six robots cross, three times as fast as real time
  mavherd sweep one-quad --seeds 0:50      fifty seeds, one table
  mavherd compare RUN RUN                  runs side by side, as a table, a page, a recording
  mavherd vehicle quadcopter               one honest MAVLink vehicle, no scenario
  mavherd check my-field.yaml              are the real vehicles of a scenario ready?

exit codes: 0 passed, 1 an assertion of the scenario failed, 2 wrong input, 3 a vehicle or the
coordinator could not start or died, 4 timed out, 130 interrupted
"""


def main(argv: list[str] | None = None) -> int:
    """Run one subcommand; return the process exit code."""
    try:
        args = _parser().parse_args(argv)
        code = int(args.run(args))
        deliver()
        return code
    except MavherdError as error:
        complain(f"mavherd: {error}")
        return error.exit_code
    except KeyboardInterrupt:
        return interrupted()
    except OSError as error:  # a full disk, or a closed pipe: `mavherd scenarios | head -1`
        give_up(sys.stdout)
        if isinstance(error, BrokenPipeError):
            return 0
        complain(f"mavherd: {os_reason(error)}")
        return 2
    finally:
        settle()


def _scenarios(args: argparse.Namespace) -> int:
    from ..scenarios.loader import shipped

    scenarios = shipped()
    width = max(len(name) for name, _ in scenarios)
    deliver("".join(f"{name:{width}}  {description}\n" for name, description in scenarios))
    return 0


class _Parser(argparse.ArgumentParser):
    """Complains in one line, and takes what is meant for what it is.

    `--home -35.36,149.17,584,0` has no option -35, and a list may go on behind an option:
    `compare A --json B`.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._negative_number_matcher = re.compile(r"-\.?\d")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Return what was found, and what nobody knows."""
        found, rest = super().parse_known_args(args, namespace)
        for positional in self._get_positional_actions():
            is_list = positional.nargs in ("+", "*")
            if is_list and rest and not any(text.startswith("-") for text in rest):
                getattr(found, positional.dest).extend(self._get_values(positional, rest))
                rest = []
        return found, rest

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
    run_command.add_options(
        _add(commands, "run", run_command.run, "run a scenario and judge it", run_command.EPILOG)
    )
    _add_vehicle(commands)
    text = "say whether a scenario can be run, and whether its external vehicles are ready"
    check_command.add_options(
        _add(commands, "check", check_command.run, text, check_command.EPILOG)
    )
    text = "pause, step and hurry a run that goes on elsewhere"
    clock_command.add_options(
        _add(commands, "clock", clock_command.run, text, clock_command.EPILOG)
    )
    text = "run a scenario many times, over a grid of settings and seeds, into one table"
    sweep_command.add_options(
        _add(commands, "sweep", sweep_command.run, text, sweep_command.EPILOG)
    )
    _add(commands, "scenarios", _scenarios, "list the shipped scenarios")
    text = "compute a run's digest again from its tlogs"
    digest_command.add_options(
        _add(commands, "digest", digest_command.run, text, digest_command.EPILOG)
    )
    text = "name the first message, field, vehicle and time at which two runs part"
    diff_command.add_options(_add(commands, "diff", diff_command.run, text, diff_command.EPILOG))
    text = "make a recording of telemetry logs, or of a run that has none"
    convert_command.add_options(
        _add(commands, "convert", convert_command.run, text, convert_command.EPILOG)
    )
    text = "record any MAVLink vehicle, a real one too, for Rerun"
    record_command.add_options(
        _add(commands, "record", record_command.run, text, record_command.EPILOG)
    )
    text = "set runs side by side: one table, overlaid tracks, a page and a recording"
    compare_command.add_options(
        _add(commands, "compare", compare_command.run, text, compare_command.EPILOG)
    )
    text = "write a run's report, tables and figures again from its logs"
    report_command.add_options(
        _add(commands, "report", report_command.run, text, report_command.EPILOG)
    )
    text = "show a recording, or live vehicles from outside, in Rerun's viewer"
    view_command.add_options(_add(commands, "view", view_command.run, text, view_command.EPILOG))
    _add(commands, "version", version_command.run, "say which mavherd runs here, and how")
    return parser


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
