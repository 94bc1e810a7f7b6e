"""A run that was flown, read from its folder: what was asked for, what came of it, what is lacking.

Of a run that was killed there is no report, and its logs end somewhere: it opens all the same, and
says so in `partial` and `missing`.
"""

import json
import socket
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ... import __version__
from ...scenarios.errors import ScenarioError
from ...scenarios.loader import load_scenario
from ...scenarios.schema import RobotSpec, Scenario
from ...scenarios.starts import draw_starts
from .events import read_events
from .folder import RunFolderError, check_folder, made_by, read_report, whole_or_part

if TYPE_CHECKING:  # numpy is needed by those who ask for tracks
    from ..report.truth import Track

_LISTED = 6  # names in a line
_ANSWER_S = 0.5


@dataclass(frozen=True, kw_only=True)
class Flown:
    """One run's folder. Everything in it is read when it is asked for."""

    folder: Path
    scenario: Scenario  # as resolved
    starts: tuple[RobotSpec, ...]  # its robots where the seed has put them
    report: Mapping[str, Any] | None  # None: the run was killed, or goes on
    missing: tuple[str, ...]  # a line for each kind of file that is not there or has no end

    @property
    def partial(self) -> bool:
        """Whether anything that the run was to leave is missing or has no end."""
        return bool(self.missing)

    def tracks(self) -> "list[Track]":
        """Return what each robot truly did, as far as its log goes; in the scenario's order.

        Raises MavherdError when a log is none, or of a newer version.
        """
        from ..report.truth import read_truth

        logs = [(spec, self.truth(spec.name)) for spec in self.starts]
        tracks = [read_truth(log) for _, log in logs if log is not None and _has_begun(log)]
        return [track for track in tracks if len(track)]

    def events(self) -> tuple[Mapping[str, Any], ...]:
        """Return the lines of events.jsonl: `t`, `vehicle`, `kind`, `text`, and what else they say.

        What cannot be read is left out: a last line without its end, for one.
        """
        return read_events(self.folder).events

    def truth(self, name: str) -> Path | None:
        """Return a robot's truth log, which is a `.part` when its process was killed."""
        return whole_or_part(self.folder / "vehicles" / name / "truth.bin")

    def tlog(self, name: str) -> Path | None:
        """Return the log of a robot's link, which is a `.part` when its coordinator was killed."""
        return whole_or_part(self.folder / "vehicles" / name / f"{name}.tlog")

    @property
    def recording(self) -> Path | None:
        """The Rerun recording, which is a `.part` when the recorder was killed."""
        return whole_or_part(self.folder / "run.rrd")

    def goes_on(self) -> bool:
        """Return whether the run is still under way: whether its Zenoh router answers."""
        if self.report is not None:
            return False
        with suppress(OSError, ValueError, KeyError, TypeError):
            ports = json.loads((self.folder / "ports.json").read_text(encoding="utf-8"))
            host, _, port = ports["zenoh"].removeprefix("tcp/").rpartition(":")
            with socket.create_connection((host, int(port)), timeout=_ANSWER_S):
                return True
        return False


def open_flown(folder: Path | str) -> Flown:
    """Return the run in `folder`, finished or broken off.

    Raises MavherdError when there is no such folder, no run has left it, a newer mavherd has, or
    its scenario or report is damaged.
    """
    folder = Path(folder)
    check_folder(folder)
    report = read_report(folder)
    try:
        scenario = load_scenario(folder / "scenario.yaml")
        starts = draw_starts(scenario)
    except ScenarioError as error:
        if report is None or report.get("version") == __version__:
            raise
        raise RunFolderError(
            f"{error}; the run was made by mavherd {made_by(report)}, this is {__version__}"
        ) from None
    return Flown(
        folder=folder,
        scenario=scenario,
        starts=starts,
        report=report,
        missing=tuple(_missing(folder, starts, report)),
    )


def lacking_logs(folder: Path, names: Sequence[str]) -> Iterator[str]:
    """Yield a line for each kind of log that some robots have not, or without its end."""
    robots = folder / "vehicles"
    yield from _lacking("truth.bin", {name: robots / name / "truth.bin" for name in names})
    yield from _lacking("tlog", {name: robots / name / f"{name}.tlog" for name in names})


def _missing(
    folder: Path, starts: Sequence[RobotSpec], report: Mapping[str, Any] | None
) -> Iterator[str]:
    if report is None:
        yield "report.json: none (the run was killed, or goes on)"
    elif told := report.get("missing"):
        yield from map(str, told)
        return
    names = [spec.name for spec in starts]
    yield from lacking_logs(folder, names)
    if not (folder / "events.jsonl").exists():
        yield "events.jsonl: none"
    elif damaged := read_events(folder).damaged:
        yield f"events.jsonl: damaged in line {', '.join(map(str, damaged[:_LISTED]))}"
    recording = whole_or_part(folder / "run.rrd")
    if recording and recording.suffix == ".part":
        yield "run.rrd: without its end (.part)"
    elif report and report.get("partial"):
        yield "report.json says that the run is partial"


def _lacking(what: str, paths: Mapping[str, Path]) -> Iterator[str]:
    """Yield a line for those who have no such file, and one for those whose file has no end."""
    found = {name: whole_or_part(path) for name, path in paths.items()}
    without = [name for name, path in found.items() if path is None]
    torn = [name for name, path in found.items() if path and path.suffix == ".part"]
    for names, text in ((without, "none"), (torn, "without its end (.part)")):
        if names:
            yield f"{what}: {text} of {_listed(names, len(paths))}"


def _listed(names: Sequence[str], total: int) -> str:
    if len(names) == total > 1:
        return f"all {total} robots"
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return ", ".join(names[:_LISTED]) + more


def _has_begun(log: Path) -> bool:
    """Return whether a log has a header; a vehicle that was killed at once leaves none."""
    if log.suffix != ".part":
        return True
    with log.open("rb") as file:
        return file.readline(1 << 16).endswith(b"\n")
