"""Whole runs through their processes, and what each of those used meanwhile."""

import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from fields import write_field
from machine import Memory, command_line, cpu_seconds, descendants, memory, output_of

from mavherd.gcs.run.launcher import Run, RunOptions
from mavherd.gcs.run.ports import PortPlan
from mavherd.gcs.run.view import Unseen
from mavherd.scenarios.loader import load_scenario
from mavherd.scenarios.schema import Scenario

NO_PORTS = PortPlan(gcs_udp=0, api_udp=0, tcp=0)
_SAMPLE_S = 0.3  # of wall time between two looks at all processes, which cost something themselves


def field_scenario(robots: int, folder: Path, *, dwell_s: float = 0.0) -> Scenario:
    """Return so many robots on crossing ways, which stay at their goals for a while."""
    path = write_field(robots, folder)
    scenario = load_scenario(str(path), [])
    names = [spec.name for spec in scenario.robots]
    changes = [f"robots.{name}.dwell_s={dwell_s}" for name in names]
    return load_scenario(str(path), [*changes, f"duration={120 + dwell_s}"])


def lone_scenario(kind: str, dwell_s: float) -> Scenario:
    """Return one robot that goes somewhere and stays there for a while."""
    name = {"quadcopter": "one-quad", "rover": "one-rover"}[kind]
    robot = load_scenario(name, []).robots[0].name
    changes = [f"robots.{robot}.dwell_s={dwell_s}", f"duration={60 + dwell_s}"]
    return load_scenario(name, changes)


class Sample(NamedTuple):
    """CPU seconds so far, at one moment."""

    now: float  # s of fleet time
    wall: float
    cpu: dict[tuple[str, str], float]  # by role and thread


@dataclass
class Watch(Unseen):
    """A view that looks at the processes of a run instead of showing it.

    Roles: `launcher`, `coordinator`, `nursery`, and the kinds of vehicles.
    """

    kinds: dict[str, str]  # by vehicle
    samples: list[Sample] = field(default_factory=list)
    held: dict[str, list[Memory]] = field(default_factory=dict)  # by kind of vehicle
    roles: dict[int, str] = field(default_factory=dict)

    def started(self, folder: Path, ports: dict[str, Any]) -> None:
        """Find out who is who."""
        self.roles = {os.getpid(): "launcher"}
        for pid in descendants(os.getpid()):
            line = command_line(pid)
            log = output_of(pid)
            if log.name == "log.txt" and log.parent.name in self.kinds:
                self.roles[pid] = self.kinds[log.parent.name]
            else:
                words = "coordinator", "recorder", "nursery"
                self.roles[pid] = next((word for word in words if word in line), "other")

    def update(self, now: float, *_: object) -> None:
        """Look at everybody, now and then."""
        wall = time.monotonic()
        few = len(self.roles) < 20
        if self.samples and not few and wall - self.samples[-1].wall < _SAMPLE_S:
            return
        cpu: dict[tuple[str, str], float] = {}
        for pid, role in self.roles.items():
            for thread, seconds in cpu_seconds(pid).items():
                cpu[role, thread] = cpu.get((role, thread), 0.0) + seconds
        self.samples.append(Sample(now, wall, cpu))
        if len(self.samples) == 2:
            for pid, role in self.roles.items():
                if role in self.kinds.values():
                    self.held.setdefault(role, []).append(memory(pid))


class Usage(NamedTuple):
    """What a run used between the first look and the last."""

    cpu: dict[tuple[str, str], float]  # CPU s per simulated s, by role and thread
    cores: float  # CPU s per s of wall time, of all
    memory: dict[str, Memory]  # by kind of vehicle, the median

    def of(self, *roles: str) -> float:
        """Return CPU s per simulated s of some roles, all threads."""
        return sum(s for (role, _), s in self.cpu.items() if role in roles)

    @property
    def zenoh(self) -> float:
        """CPU s per simulated s of all threads that are not a process's first: they are Zenoh's."""
        return sum(s for (_, thread), s in self.cpu.items() if thread != "main")


def fly(scenario: Scenario, **options: Any) -> dict[str, Any]:
    """Run a scenario through its processes; return the report."""
    return _fly(scenario, None, options)


def watch(
    scenario: Scenario,
    *,
    since: float = 0.0,
    look: Callable[[Path], None] = lambda _: None,
    **options: Any,
) -> tuple[dict[str, Any], Usage]:
    """Run a scenario and look at its processes; return the report and what they used.

    That counts from `since` (s of fleet time) on. `look` is shown the run folder at the end.
    """
    view = Watch({spec.name: spec.kind for spec in scenario.robots})
    report = _fly(scenario, view, options, look)
    samples = [sample for sample in view.samples if sample.now >= since]
    if len(samples) < 2:
        raise RuntimeError(f"{scenario.name}: over before it could be looked at twice")
    first, last = samples[0], samples[-1]
    cpu = {who: spent - first.cpu.get(who, 0.0) for who, spent in last.cpu.items()}
    seconds, wall = last.now - first.now, last.wall - first.wall
    held = {
        kind: Memory(*(median(column) for column in zip(*list_of, strict=True)))
        for kind, list_of in view.held.items()
    }
    return report, Usage(
        {who: spent / seconds for who, spent in cpu.items()}, sum(cpu.values()) / wall, held
    )


def _fly(
    scenario: Scenario,
    view: Watch | None,
    options: dict[str, Any],
    look: Callable[[Path], None] = lambda _: None,
) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        chosen = {"figures": False, "record": False, "ports": NO_PORTS, **options}
        outcome = Run(scenario, RunOptions(out=Path(folder), **chosen), view).execute()
        look(outcome.folder)
    report = outcome.report
    if outcome.exit_code not in (0, 4):
        raise RuntimeError(
            f"{scenario.name}: {report['error'] or 'failed'}: {report['assertions']}"
        )
    return report
