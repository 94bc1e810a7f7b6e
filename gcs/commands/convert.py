"""`mavherd convert`: a recording of what was logged, by us or by any ground station."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ...transport.errors import MavherdError
from ..complaint import complain
from .record import check_output, no_rerun

if TYPE_CHECKING:
    from ..recording.outside.convert import Converted

EPILOG = """\
examples:
  mavherd convert flight.tlog                 flight.rrd, of MAVProxy's or QGroundControl's log
  mavherd convert a.tlog b.tlog -o both.rrd   several logs, their vehicles shown together
  mavherd convert runs/crossing-targets-...   run.rrd of a run that has none, or only a part of it

A run's recording is made of its truth logs, its events and its links, also when it was flown with
--in-process or --no-record, or was killed; it takes the place of the run.rrd.part of a killed run.

exit codes: 0 converted, 2 wrong input
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of `mavherd convert`."""
    parser.add_argument(
        "input", type=Path, nargs="+", metavar="INPUT", help="telemetry logs, or one run folder"
    )
    parser.add_argument(
        *("-o", "--output"), type=Path, metavar="OUT.rrd",
        help="the recording (beside the log, or run.rrd in the run folder)",
    )  # fmt: skip
    parser.add_argument("--force", action="store_true", help="overwrite OUT.rrd")


def run(args: argparse.Namespace) -> int:
    """Convert, and say what came of it."""
    inputs: list[Path] = args.input
    folder = next((path for path in inputs if path.is_dir()), None)
    if folder and len(inputs) > 1:
        raise MavherdError(f"{folder}: a run is converted alone (give one folder, or logs)")
    from ..recording.compact import compact
    from ..recording.kept import part_of

    output = args.output or (folder / "run.rrd" if folder else inputs[0].with_suffix(".rrd"))
    if output in inputs:
        raise MavherdError(f"{output}: this is the input (give another --output)")
    check_output(output, force=args.force)
    suffix = ".new" if folder else ".part"  # a run that was killed has a .part until then
    part = output.with_name(output.name + suffix)
    try:
        done = _convert(inputs, folder, part)
        compact(part)
        part.replace(output)
        if folder and output.resolve() == (folder / "run.rrd").resolve():
            part_of(output).unlink(missing_ok=True)
    except ModuleNotFoundError as error:
        raise no_rerun(error) from None
    finally:
        part.unlink(missing_ok=True)
    for remark in done.remarks:
        complain(f"mavherd: {remark}")
    count, size = len(done.vehicles), output.stat().st_size / 1e6
    who = f"{count} vehicle{'s' if count != 1 else ''}"
    print(f"{output}: {who}, {done.seconds:.1f} s, {size:.1f} MB (mavherd view {output})")
    return 0


def _convert(inputs: list[Path], folder: Path | None, output: Path) -> "Converted":
    from ..patience import Bar

    with Bar(f"converting {inputs[0].name}") as bar:
        if folder:
            from ..recording.afterwards import convert_run

            return convert_run(folder, output, bar)
        from ..recording.outside.convert import convert_logs

        return convert_logs(inputs, output, bar)
