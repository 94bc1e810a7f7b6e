"""Runs a scenario: a folder, a bus, a crew of processes, a clock that conducts them, a report."""

import json
import secrets
import signal
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any, Protocol

from ..scenarios.dump import scenario_to_yaml
from ..scenarios.schema import Scenario
from ..scenarios.starts import draw_starts
from ..transport.bus import Bus, Mailbox
from ..transport.errors import LinkError, VehicleError, os_reason
from ..transport.wire import Phase, VehicleState, unpack_team
from .conductor import Clock, Died, FreeRun, Interrupted, Lockstep, Pacer
from .coordinator import check_laws
from .crew import Crew
from .outcome import INTERRUPTED, PASSED, TIMED_OUT, Ending, Outcome, conclude
from .ports import LOOPBACK, PortPlan, free_tcp_port
from .recorder import write_robots

_VIEW_PERIOD_S = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """How to run a scenario, apart from what it says itself."""

    lockstep: bool = True
    speed: float | None = None  # times real time; None: as fast as it goes (lockstep)
    record: bool = True
    figures: bool = True
    out: Path = Path("runs")
    ports: PortPlan = PortPlan()


class View(Protocol):
    """Shows a run while it goes on."""

    def started(self, folder: Path, ports: dict[str, Any]) -> None:
        """Everything is up; the run begins."""
        ...

    def update(self, now: float, states: list[VehicleState], factor: float) -> None:
        """Show the team at fleet time `now`, running `factor` times as fast as real time."""
        ...

    def event(self, event: dict[str, Any]) -> None:
        """Show one event."""
        ...


class Unseen:
    """A view that shows nothing, for scripts."""

    def started(self, folder: Path, ports: dict[str, Any]) -> None:
        """Show nothing."""

    def update(self, now: float, states: list[VehicleState], factor: float) -> None:
        """Show nothing."""

    def event(self, event: dict[str, Any]) -> None:
        """Show nothing."""


class Run:
    """One run of one scenario."""

    def __init__(self, scenario: Scenario, options: RunOptions, view: View | None = None) -> None:
        check_laws(scenario)
        self.scenario = scenario
        self.options = options
        self.starts = draw_starts(scenario)
        stamp = time.strftime("%Y%m%d-%H%M%S")
        self.folder = options.out / f"{scenario.name}-{stamp}-{secrets.token_hex(2)}"
        self._view = view or Unseen()
        self._signals = 0
        self._active: set[str] = set()  # vehicles that have begun their path
        self._ready_at: float | None = None
        self._wall_s = 0.0

    def execute(self) -> Outcome:
        """Run from start to report. Raises MavherdError when nothing could be started."""
        with self._interruptible():
            crew = Crew(self.scenario, self.starts, self.options.ports, self._interrupted)
            clock, exit_code, error = self._live(crew)
            if self._interrupted() and error is None:
                exit_code, error = INTERRUPTED, "interrupted"
            try:
                outcome = self._report(crew, clock, exit_code, error)
            except OSError as failure:
                first = f"{error}; " if error else ""
                raise VehicleError(
                    f"{first}{self.folder}: cannot write the report: {failure.strerror or failure}"
                ) from None
            if self._interrupted() and error is None:
                raise KeyboardInterrupt  # while the report was written: it is complete
            return outcome

    def _live(self, crew: Crew) -> tuple[Clock | None, int, str | None]:
        """Start the crew, conduct it, end it; return clock, exit code and what went wrong."""
        clock: Clock | None = None
        exit_code, error = PASSED, None
        with ExitStack() as stack:
            stack.callback(crew.release)
            self._make_folder()
            log = stack.enter_context((self.folder / "events.jsonl").open("w", buffering=1))
            bus, endpoint = self._open_bus()
            stack.enter_context(bus)
            stack.callback(lambda: crew.stop(hurry=error is not None))
            events = bus.publisher("events")

            def on_event(event: dict[str, Any]) -> None:
                line = json.dumps(event)
                log.write(line + "\n")
                events.put(line.encode())
                self._note_phase(event)
                self._view.event(event)

            try:
                # Free-running, all begin at one moment that nobody has reached yet.
                started = time.monotonic() + 0.1 + 0.005 * len(self.starts)
                lockstep, record = self.options.lockstep, self.options.record
                crew.start(self.folder, endpoint, lockstep=lockstep, started=started, record=record)
                kind = Lockstep if lockstep else FreeRun
                clock = kind(crew.vehicles, crew.coordinators, self._interrupted, on_event)
                self._view.started(self.folder, crew.ports)
                self._conduct(clock, bus, started)
                if not clock.finished:
                    limit = f"{self.scenario.duration:g} s of simulated time"
                    exit_code, error = TIMED_OUT, f"timed out: not done after {limit}"
            except Interrupted:
                exit_code, error = INTERRUPTED, "interrupted"
            except Died as died:
                exit_code, error = VehicleError.exit_code, crew.obituary(died)
            except VehicleError as failure:
                exit_code, error = failure.exit_code, str(failure)
            except OSError as failure:  # the disk is full, say
                exit_code, error = VehicleError.exit_code, os_reason(failure)
        return clock, exit_code, error

    def _make_folder(self) -> None:
        try:
            for spec in self.starts:
                (self.folder / "vehicles" / spec.name).mkdir(parents=True)
            text = scenario_to_yaml(self.scenario)
            (self.folder / "scenario.yaml").write_text(text, encoding="utf-8")
            write_robots(self.folder, self.starts, self.scenario.team)
        except OSError as error:
            raise LinkError(
                f"{self.folder}: cannot write the run folder: {error.strerror}"
            ) from None

    def _open_bus(self) -> tuple[Bus, str]:
        """Return a router on a free port, and its endpoint."""
        tries = 5
        while True:
            endpoint = f"tcp/{LOOPBACK}:{free_tcp_port()}"
            tries -= 1
            try:
                bus = Bus.router(endpoint, self.folder.name, reliable=self.options.lockstep)
            except LinkError:  # somebody took the port meanwhile
                if not tries:
                    raise
            else:
                return bus, endpoint

    def _conduct(self, clock: Clock, bus: Bus, started: float) -> None:
        scenario, speed = self.scenario, self.options.speed
        period = 1.0 / scenario.team.rate_hz
        team, ticks = bus.latest("team"), bus.publisher("clock")
        begun = time.monotonic() if self.options.lockstep else started
        shown = begun
        pacer = Pacer(speed, period) if speed and isinstance(clock, Lockstep) else None
        try:
            while not clock.finished and clock.now < scenario.duration - 1e-9:
                if self._interrupted():
                    raise Interrupted
                if isinstance(clock, Lockstep):
                    clock.tick(round(period * 1e6))
                    ticks.put(f"{clock.now:.6f}".encode())
                elif isinstance(clock, FreeRun):
                    clock.listen(started, _VIEW_PERIOD_S)
                wall = time.monotonic()
                if wall - shown > _VIEW_PERIOD_S:
                    shown = wall
                    self._view.update(clock.now, _latest_team(team), clock.now / (wall - begun))
                if pacer:
                    pacer.wait()
        finally:
            self._wall_s = time.monotonic() - begun
            if pacer:
                clock.late = pacer.late

    def _note_phase(self, event: dict[str, Any]) -> None:
        if event["kind"] == "phase" and event["text"] == Phase.ACTIVE.name.lower():
            self._active.add(event["vehicle"])
            if self._ready_at is None and len(self._active) == len(self.starts):
                self._ready_at = event["t"]

    def _report(
        self, crew: Crew, clock: Clock | None, exit_code: int, error: str | None
    ) -> Outcome:
        ticks, late = (clock.ticks, clock.late) if clock else (0, 0)
        if not self.options.lockstep:  # everybody has paced itself
            both = crew.coordinators, crew.vehicles
            ticks = sum(process.ticks for group in both for process in group)
            late = sum(process.late for group in both for process in group)
        ending = Ending(
            exit_code=exit_code,
            error=error,
            now=clock.now if clock else 0.0,
            wall_s=self._wall_s,
            ready_at=self._ready_at,
            ticks=ticks,
            late_ticks=late,
            outside_clients=sum(v.outside_clients for v in crew.vehicles),
            partial=crew.partial,
        )
        return conclude(
            self.folder,
            self.scenario,
            self.starts,
            ending,
            lockstep=self.options.lockstep,
            speed=self.options.speed,
            figures=self.options.figures and exit_code != INTERRUPTED,
            record=self.options.record,
            ports=crew.ports,
        )

    def _interrupted(self) -> bool:
        return self._signals > 0

    @contextmanager
    def _interruptible(self) -> Iterator[None]:
        """Turn Ctrl-C and SIGTERM into an orderly end; processes are ended, the report written."""

        def note(signum: int, frame: FrameType | None) -> None:
            self._signals += 1

        try:
            before = {s: signal.signal(s, note) for s in (signal.SIGINT, signal.SIGTERM)}
        except ValueError:  # not in the main thread: the caller has its own way to stop
            yield
            return
        try:
            yield
        finally:
            for signum, handler in before.items():
                signal.signal(signum, handler)


def _latest_team(box: Mailbox) -> list[VehicleState]:
    data = box.latest.get("team")
    return unpack_team(data)[1] if data else []
