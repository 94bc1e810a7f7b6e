"""What a run folder says of a run: who took part, how it was flown, and each vehicle's link."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from ...scenarios.source import Node, parse, read_text
from ...transport.tlog import read_tlog
from ...vehicles.config import SIMULATED_EPOCH_US
from ..flown.folder import RunFolderError, check_folder, read_report, unreadable, whole_or_part

_DAY_US = 86_400_000_000


class Entry(NamedTuple):
    """One message of a coordinator's link."""

    time_us: int  # of the fleet
    frame: bytes


@dataclass(frozen=True, kw_only=True)
class FlownRun:
    """A run that has ended, or was broken off: its report is empty when it was killed."""

    folder: Path
    settings: Mapping[str, Any]  # the scenario as resolved, by the keys that `--set` takes
    vehicles: Mapping[str, int]  # system ids by name, in order of system id
    report: Mapping[str, Any]  # {}: there is none, or it is damaged
    damaged: bool = False  # report.json is there, but none

    def log(self, vehicle: str) -> Path:
        """Return the log of a vehicle's link: a `.part` when its run did not end properly."""
        path = self.folder / "vehicles" / vehicle / f"{vehicle}.tlog"
        return whole_or_part(path) or path

    def is_torn(self, vehicle: str) -> bool:
        """Return whether the end of a vehicle's log may be missing."""
        return self.log(vehicle).suffix == ".part"

    def entries(self, vehicle: str) -> list[Entry]:
        """Return the messages of a vehicle's link as they were logged."""
        try:
            stamped = list(read_tlog(self.log(vehicle)))
        except OSError as error:
            raise unreadable(error, self.folder) from None
        epoch = _epoch(stamped[0][0]) if stamped else 0
        return [Entry(time_us - epoch, frame) for time_us, frame in stamped]

    @cached_property
    def lockstep(self) -> bool:
        """Whether the fleet clock conducted it; without a report the stamps of the logs say it."""
        if "lockstep" in self.report:
            return bool(self.report["lockstep"])
        logs = [log for log in map(self.log, self.vehicles) if log.exists()]
        first = [entry for log in logs if (entry := next(read_tlog(log), None))]
        return all(_epoch(time_us) == SIMULATED_EPOCH_US for time_us, _ in first)


def open_run(folder: Path) -> FlownRun:
    """Return what was flown in `folder`. Raises MavherdError when that is no run's folder."""
    check_folder(folder)
    report = read_report(folder)
    scenario = folder / "scenario.yaml"
    settings = _flat(parse(read_text(scenario), str(scenario)))
    ids = {
        words[1]: value
        for key, value in settings.items()
        if (words := key.split(".")) and words[0] == "robots" and words[2:] == ["system_id"]
    }
    if not ids or not all(isinstance(value, int) for value in ids.values()):
        raise RunFolderError(f"{scenario}: it has no robots with system ids (not a run's?)")
    vehicles = dict(sorted(ids.items(), key=lambda pair: pair[1]))
    return FlownRun(
        folder=folder,
        settings=settings,
        vehicles=vehicles,
        report=report or {},
        damaged=report == {},
    )


def _epoch(first_us: int) -> int:
    """Return when fleet time was 0: at a fixed moment, or (free-running) about now."""
    conducted = 0 <= first_us - SIMULATED_EPOCH_US < _DAY_US
    return SIMULATED_EPOCH_US if conducted else first_us


def _flat(node: Node, prefix: str = "") -> dict[str, Any]:
    """Return the leaves of a tree; an item of a list goes by its name, or else its place."""
    value = node.value
    if isinstance(value, dict):
        pairs = list(value.items())
    elif isinstance(value, list):
        pairs = [(_item_key(item, place), item) for place, item in enumerate(value)]
    else:
        return {prefix: value}
    found: dict[str, Any] = {}
    for key, item in pairs:
        found |= _flat(item, f"{prefix}.{key}" if prefix else key)
    return found


def _item_key(item: Node, place: int) -> str:
    named = item.value.get("name") if isinstance(item.value, dict) else None
    return str(named.value) if named else str(place)
