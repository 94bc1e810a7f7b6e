"""A look at a scenario's external vehicles, live: links are opened, nothing is made to move.

What is sent are heartbeats, requests for telemetry and for the parameters of the vehicle's fence,
and, while it would not arm, to say why.
"""

import select
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import NamedTuple

from ...scenarios.schema import RobotSpec, Scenario
from ...transport.connect import parse_connect
from ...transport.switchboard import Switchboard
from ..safety.inquiry import Inquiry
from ..safety.preflight import Check, ask_fence, checklist, missing
from ..station import Question, Station, stack_of

RATE_HZ = 5.0  # of telemetry: enough to look at
_LOOK_S = 0.1  # between two looks at what has to be sent
_STILL_S = 0.3  # of one look; a machine that stands still for longer does not listen meanwhile
_LINGER_S = 3.0  # after all is well, for what is only told for information


class Finding(NamedTuple):
    """One external vehicle and what was found out about it."""

    spec: RobotSpec
    checks: list[Check]

    @property
    def missing(self) -> list[Check]:
        """What keeps it from arming."""
        return missing(self.checks)


@contextmanager
def inspect(scenario: Scenario) -> Iterator["Inspection"]:
    """Open the lines to the external vehicles, and close them."""
    inspection = Inspection(scenario)
    try:
        yield inspection
    finally:
        inspection.board.close()


class Inspection:
    """Listens to the external vehicles of a scenario. Raises LinkError for lines it cannot have."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._specs = {spec.name: spec for spec in scenario.robots if spec.external}
        self._stations = {name: _station(spec, scenario) for name, spec in self._specs.items()}
        self._inquiries = {name: Inquiry(s) for name, s in self._stations.items()}
        self._fences: dict[str, Mapping[str, Question]] = {}
        self.now = 0.0  # seconds in which we have listened
        self._looked_at = time.monotonic()
        self._ready_at: float | None = None
        self.board = Switchboard(
            {
                name: (parse_connect(spec.connect), spec.system_id)
                for name, spec in self._specs.items()
                if spec.connect is not None
            }
        )

    def listen(self, seconds: float) -> None:
        """Take in what comes in this time, and ask for what is still to be told."""
        end = self.now + seconds
        while (left := end - self.now) > 0:
            for name, station in self._stations.items():
                if data := station.transmit(self.now):
                    self.board.send(name, data)
            select.select(self.board.sockets(), [], [], min(left, _LOOK_S))
            before, self._looked_at = self._looked_at, time.monotonic()
            self.now += min(self._looked_at - before, _STILL_S)
            for name, frames in self.board.receive():
                self._stations[name].receive(frames, self.now)

    def findings(self) -> list[Finding]:
        """Return every check of every vehicle as of now."""
        return [Finding(spec, self._checks(name, spec)) for name, spec in self._specs.items()]

    def is_over(self, findings: list[Finding]) -> bool:
        """Return whether waiting longer would change nothing: all ready, or hopeless."""
        told = all(check.ok is not None for one in findings for check in one.checks)
        ready = not any(one.missing for one in findings)
        if not ready:
            self._ready_at = None
            return all(s.problem or not f.missing for s, f in self._each(findings))
        self._ready_at = self.now if self._ready_at is None else self._ready_at
        return told or self.now > self._ready_at + _LINGER_S

    def _each(self, findings: list[Finding]) -> Iterator[tuple[Station, Finding]]:
        return zip(self._stations.values(), findings, strict=True)

    def _checks(self, name: str, spec: RobotSpec) -> list[Check]:
        station, now = self._stations[name], self.now
        if name not in self._fences and (asked := ask_fence(station, now)):
            self._fences[name] = asked
        self._inquiries[name].update(now)
        checks = checklist(station, spec, self._scenario, now, self._fences.get(name))
        complaint = self.board.complaint(name)
        if not complaint or station.problem:  # what is wrong for good needs no second look
            return checks
        text = complaint.removeprefix(f"{spec.connect}: ")
        return [Check("link", False, text), *checks[1:]]


def _station(spec: RobotSpec, scenario: Scenario) -> Station:
    return Station(
        spec.name,
        spec.system_id,
        RATE_HZ,
        kind=spec.kind,
        stack=stack_of(spec.autopilot),
        origin=scenario.origin,
    )
