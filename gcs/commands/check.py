"""`mavherd check`: whether a scenario can be run and its external vehicles are ready to arm."""

import argparse
import json
from typing import TYPE_CHECKING

from ...scenarios.schema import Scenario
from ...transport.errors import MavherdError, VehicleError
from .run import add_scenario_arguments

if TYPE_CHECKING:
    from .live_check import Finding

EPILOG = """\
examples:
  mavherd check my.yaml                is the file right?
  mavherd check my-field.yaml          and are its external vehicles (`connect`) ready?
  mavherd check my-field.yaml --wait 0 --json

It listens, and asks for telemetry; it never arms, and changes neither modes nor parameters.

exit codes: 0 ready, 2 wrong input, 3 something is missing
"""

_REFRESH_S = 0.25
_MIN_LISTEN_S = 2.5  # also with --wait 0: heartbeats come once a second


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of `mavherd check`."""
    add_scenario_arguments(parser)
    parser.add_argument(
        "--wait",
        type=float,
        default=30.0,
        metavar="S",
        help="for external vehicles to get ready (30 s)",
    )
    parser.add_argument(
        "--json", action="store_true", help="print what was found, alone, to stdout"
    )


def run(args: argparse.Namespace) -> int:
    """Check the scenario; raise VehicleError when its external vehicles are not ready."""
    from ...scenarios.loader import load_scenario
    from ..team.coordinator import check_laws

    if not 0 <= args.wait <= 3600:  # and not NaN
        raise MavherdError(f"--wait {args.wait:g}: expected 0..3600 s")
    scenario = load_scenario(args.scenario, args.set, args.seed)
    check_laws(scenario)
    external = [spec for spec in scenario.robots if spec.external]
    if external:
        return _check_vehicles(scenario, args.wait, as_json=args.json)
    if args.json:
        print(json.dumps({"scenario": scenario.name, "ready": True, "vehicles": {}}, indent=2))
    else:
        print(f"{_about(scenario)}: ok")
    return 0


def _check_vehicles(scenario: Scenario, wait: float, *, as_json: bool) -> int:
    from . import check_view

    findings = _watch(scenario, max(wait, _MIN_LISTEN_S))
    lacking = check_view.summary(findings)
    if as_json:
        print(json.dumps(check_view.as_json(scenario.name, findings), indent=2))
    else:
        _show(findings)
    if lacking:
        raise VehicleError(f"{scenario.name}: missing: {lacking}")
    if not as_json:
        print(f"{_about(scenario)}, {len(findings)} external: ready")
    return 0


def _watch(scenario: Scenario, wait: float) -> "list[Finding]":
    """Return the findings as soon as waiting no longer helps; show them meanwhile."""
    from rich.live import Live

    from ..run.console import QuietConsole
    from .check_view import progress
    from .live_check import inspect

    console = QuietConsole()
    live = Live(console=console, auto_refresh=False, transient=True)
    with inspect(scenario) as inspection:
        if console.is_terminal:
            live.start()
        try:
            while True:
                inspection.listen(_REFRESH_S)
                findings, left = inspection.findings(), wait - inspection.now
                over = inspection.now > _MIN_LISTEN_S and inspection.is_over(findings)
                if over or left <= 0:
                    return findings
                live.update(progress(findings, left), refresh=True)
        finally:
            live.stop()


def _show(findings: "list[Finding]") -> None:
    from rich.console import Console

    from .check_view import lines, table

    console = Console()
    if console.is_terminal:
        console.print(table(findings))
    else:
        print("\n".join(lines(findings)))


def _about(scenario: Scenario) -> str:
    return f"{scenario.name}: {len(scenario.robots)} robots, law {scenario.team.law}"
