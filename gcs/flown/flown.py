"""A run that was flown, read from its folder: what was asked for, what came of it, what is lacking.

Of a run that was killed there is no report, and its logs end somewhere: it opens all the same, and
says so in `partial` and `missing`.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ... import __version__
from ...scenarios.errors import ScenarioError
from ...scenarios.loader import load_scenario
from ...scenarios.schema import RobotSpec, Scenario
from ...scenarios.starts import draw_starts
from .events import is_written, read_events
from .folder import RunFolderError, check_folder, made_by, read_report, whole_or_part

if TYPE_CHECKING:  # numpy is needed by those who ask for tracks
    from ..report.truth import Track

_LISTED = 6  # names in a line
_RECORDING = "run.rrd"


@dataclass(frozen=True, kw_only=True)
class Flown:
    """One run's folder. Everything in it is read when it is asked for."""

    folder: Path
    scenario: Scenario  # as resolved
    starts: tuple[RobotSpec, ...]  # its robots where the seed has put them
    report: Mapping[str, Any] | None  # None: the run was killed, or goes on, or it is damaged
    damaged: str  # what is said of a report.json that is there, but none; "" otherwise
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
        return whole_or_part(self.folder / _RECORDING)

    def goes_on(self) -> bool:
        """Return whether the run is still under way: whether its launcher holds its event log."""
        return self.report is None and is_written(self.folder)


def open_flown(folder: Path | str) -> Flown:
    """Return the run in `folder`, finished or broken off.

    Raises MavherdError when there is no such folder, no run has left it, a newer mavherd has, or
    its scenario is damaged.
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
    damaged = ""
    if report == {}:
        damaged = "report.json: damaged (`mavherd report` writes it again)"
    return Flown(
        folder=folder,
        scenario=scenario,
        starts=starts,
        report=report or None,
        damaged=damaged,
        missing=tuple(_missing(folder, starts, report or None, damaged)),
    )


def lacking_logs(folder: Path, names: Sequence[str]) -> Iterator[str]:
    """Yield a line for each kind of log that some robots have not, or without its end."""
    robots = folder / "vehicles"
    yield from _lacking("truth.bin", {name: robots / name / "truth.bin" for name in names})
    yield from _lacking("tlog", {name: robots / name / f"{name}.tlog" for name in names})


def _missing(
    folder: Path, starts: Sequence[RobotSpec], report: Mapping[str, Any] | None, damaged: str
) -> Iterator[str]:
    recording = whole_or_part(folder / _RECORDING)
    if report is None:
        yield damaged or "report.json: none (the run was killed, or goes on)"
    elif told := report.get("missing"):
        whole = recording and recording.suffix != ".part"  # `mavherd convert` has made it since
        yield from (text for text in map(str, told) if not (whole and _RECORDING in text))
        return
    names = [spec.name for spec in starts]
    yield from lacking_logs(folder, names)
    if not (folder / "events.jsonl").exists():
        yield "events.jsonl: none"
    elif lines := read_events(folder).damaged:
        yield f"events.jsonl: damaged in line {', '.join(map(str, lines[:_LISTED]))}"
    if recording and recording.suffix == ".part":
        yield f"{_RECORDING}: without its end (.part)"
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
