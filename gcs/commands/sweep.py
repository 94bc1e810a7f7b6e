"""`mavherd sweep`: a grid of settings and many seeds, into one table."""

import argparse
import json
import os
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from ...transport.errors import MavherdError, VehicleError
from ..complaint import INSTALL, deliver
from ..ctrl_c import noted_stops

if TYPE_CHECKING:
    from ..sweep.sweep import Sweep
    from ..sweep.terminal import SweepView

EPILOG = """\
examples:
  mavherd sweep crossing-targets --seeds 0:200 --set team.law=paper,safe
  mavherd sweep my.yaml --seeds 0:50,1000 --set team.rate_hz=10,20,50 --set disturbance=off,held
  mavherd sweep crossing-targets --seeds 0:20 --set 'fence.east=[-20,20],[-15,15]' --set fence.up=9
  mavherd sweep --resume sweeps/crossing-targets-20261122-101112-ab12
  mavherd sweep tracking --seeds 0:100 --json > summary.json

Each --set with several values multiplies the grid; every point of it runs with every seed. A comma
within brackets, braces or quotes belongs to the value. See docs/sweeps.md.

exit codes: 0 all runs are done, whatever their verdicts; 2 wrong input; 3 a run failed (not an
assertion of it); 130 interrupted
"""

MAX_JOBS = 256

Checked = Callable[[int, int], None]
"""Is told how many points of the grid, of how many, can be run."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of `mavherd sweep`."""
    parser.add_argument(
        "scenario", nargs="?", help="a YAML file, or the name of a shipped scenario"
    )
    parser.add_argument(
        "--seeds", metavar="A:B,C", help="0:200 is 0 to 199; default: the scenario's own seed"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=V1,V2",
        help="vary one key, or set it for all runs (may be repeated)",
    )
    parser.add_argument(
        "--jobs", type=int, metavar="N", help="runs at a time (default: one for each core)"
    )
    parser.add_argument(
        "--processes",
        action="store_true",
        help="a process for each vehicle, as `mavherd run` has; slower, and the same rows",
    )
    folder = parser.add_mutually_exclusive_group()
    folder.add_argument(
        "--out",
        type=Path,
        metavar="FOLDER",
        help="for the results (sweeps/SCENARIO-TIME-ID); goes on with the same sweep there",
    )
    folder.add_argument("--resume", type=Path, metavar="FOLDER", help="go on with a sweep")
    parser.add_argument("--json", action="store_true", help="print summary.json, alone, to stdout")


def run(args: argparse.Namespace) -> int:
    """Run the sweep and return the exit code."""
    from ..run.console import QuietConsole
    from ..sweep.summary_table import summary_table
    from ..sweep.terminal import SweepView

    jobs = _jobs(args.jobs)
    if find_spec("pyarrow") is None:
        raise MavherdError(f"a sweep writes its table with pyarrow, which is missing ({INSTALL})")
    console = QuietConsole()
    with SweepView(console) as view:
        with noted_stops() as interrupted:

            def checked(points: int, of: int) -> None:
                if interrupted():
                    raise KeyboardInterrupt
                view.checked(points, of)

            sweep = _resumed(args, checked) if args.resume else _begun(args, checked)
        if interrupted():
            raise KeyboardInterrupt
        told = _conduct(sweep, jobs, view)
    console.print(summary_table(told, sweep.folder), crop=False)  # commands stay whole
    if args.json:
        deliver(json.dumps(told, indent=2) + "\n")
    return VehicleError.exit_code if told["failed"] else 0


def _jobs(jobs: int | None) -> int:
    if jobs is None:
        return min(len(os.sched_getaffinity(0)), MAX_JOBS)
    if not 1 <= jobs <= MAX_JOBS:
        raise MavherdError(f"--jobs {jobs}: expected 1..{MAX_JOBS}")
    return jobs


def _begun(args: argparse.Namespace, checked: "Checked") -> "Sweep":
    """Return a new sweep, or the one that is in the folder already if it is the same."""
    from ...scenarios.loader import load_scenario, scenario_text
    from ..sweep import folder as folders
    from ..sweep import plan as plans
    from ..sweep.grid import read_seeds, read_sets
    from ..sweep.sweep import Sweep

    if args.scenario is None:
        raise MavherdError("no scenario is given (`mavherd scenarios` lists those shipped)")
    fixed, grid = read_sets(args.set)
    plan = plans.Plan(
        scenario=args.scenario,
        sets=fixed,
        grid=grid,
        seeds=read_seeds(args.seeds) if args.seeds is not None else (0,),
        mode=plans.PROCESSES if args.processes else plans.IN_PROCESS,
    )
    if args.seeds is None:
        own = load_scenario(args.scenario, plan.overrides(0)).seed
        plan = replace(plan, seeds=(own,))
    plans.check_size(plan)
    text, _ = scenario_text(args.scenario)
    points = plans.load_points(plan, args.scenario, lambda k: checked(k, plan.points))
    plan = replace(plan, fingerprint=plans.fingerprint(points))
    folder = args.out or folders.new_folder(points[0].name)
    folders.begin(folder, plan, points, text)
    return Sweep(folder, plan, points)


def _resumed(args: argparse.Namespace, checked: "Checked") -> "Sweep":
    """Return the sweep in a folder, as it was begun."""
    from ... import __version__
    from ..sweep import folder as folders
    from ..sweep import plan as plans
    from ..sweep.sweep import Sweep

    given = {
        "a scenario": args.scenario is not None,
        "--seeds": args.seeds is not None,
        "--set": bool(args.set),
        "--processes": args.processes,
    }
    if wrong := [name for name, there in given.items() if there]:
        raise MavherdError(f"--resume goes on with a sweep as it is (leave out {wrong[0]})")
    plan = folders.read_plan(args.resume)
    where = args.resume / folders.PLAN
    if plan.version != __version__:
        raise MavherdError(
            f"{where}: begun by mavherd {plan.version}, and this is {__version__}, whose runs may"
            " differ (install that version, or begin a new sweep)"
        )
    copy = args.resume / folders.SCENARIO
    points = plans.load_points(plan, copy, lambda k: checked(k, plan.points))
    if plans.fingerprint(points) != plan.fingerprint:
        raise MavherdError(f"{copy}: is not what the sweep began with (begin a new sweep)")
    return Sweep(args.resume, plan, points)


def _conduct(sweep: "Sweep", jobs: int, view: "SweepView") -> dict[str, object]:
    """Do what is left of a sweep and conclude it; return its summary."""
    from ..sweep.folder import SCRATCH
    from ..sweep.pool import LocalPool
    from ..sweep.sweep import SweepInterruptedError
    from ..sweep.task import SweepTask, warm_up

    def engine() -> LocalPool:
        warm_up(sweep.plan.mode)
        task = SweepTask(sweep.points, sweep.plan.mode, sweep.folder / SCRATCH)
        return LocalPool(task, min(jobs, sweep.plan.runs), view.note, interrupted)

    view.note(f"sweep folder {sweep.folder}")
    with noted_stops() as interrupted:
        sweep.conduct(engine, view, interrupted)
    view.finished()
    try:
        if interrupted():  # after the last row
            raise KeyboardInterrupt
        _, told = sweep.conclude(view.note)
    except KeyboardInterrupt:
        raise SweepInterruptedError(sweep.folder, sweep.plan.runs, sweep.plan.runs) from None
    return told
