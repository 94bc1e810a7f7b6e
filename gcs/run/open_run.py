"""What is up while a run goes on: its folder, its bus, its crew, its clock and its event log."""

import json
import time
from collections.abc import Callable, Collection
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...scenarios.schema import Scenario
from ...scenarios.starts import draw_starts
from ...transport.bus import Bus, Publisher
from ...transport.errors import LinkError, VehicleError
from ..flown.events import open_events
from ..report.outcome import INTERRUPTED, Ending, Outcome, conclude
from ..safety.abandoned import complaint, fate, may_be_armed
from .conductor import Clock, FreeRun, Lockstep
from .crew import Crew
from .head_start import HeadStart
from .lease import leased
from .ports import API_UDP, GCS_UDP, LOOPBACK, PortPlan, free_tcp_port
from .readiness import Readiness
from .run_folder import make_folder, name_folder
from .view import View

if TYPE_CHECKING:
    from ..recording.dashboard import Dashboard
    from ..recording.viewers import Viewing


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """How to run a scenario, apart from what it says itself."""

    lockstep: bool = True
    speed: float | None = None  # times real time; None: as fast as it goes (lockstep)
    paused: bool = False  # time stands still until somebody lets it go on (lockstep)
    in_process: bool = False  # all vehicles and coordinators in this process (lockstep)
    record: bool = True
    viewing: "Viewing | None" = None  # live
    figures: bool = True
    out: Path = Path("runs")
    ports: PortPlan = PortPlan()


class OpenRun:
    """Everything around the robots of one run, opened once and closed once.

    Vehicles in `ours` are steered by the caller: no coordinator process is started for them.
    `interrupted` is asked during every wait. Raises MavherdError when a port cannot be had.
    """

    def __init__(
        self,
        scenario: Scenario,
        options: RunOptions,
        view: View,
        interrupted: Callable[[], bool],
        *,
        ours: Collection[str] = (),
        head_start: HeadStart | None = None,
    ) -> None:
        self.scenario = scenario
        self.options = options
        self.starts = draw_starts(scenario)
        self.folder = name_folder(options.out, scenario)
        self.dashboard = _dashboard(options.viewing)
        with ExitStack() as stack:
            if self.dashboard:
                stack.callback(self.dashboard.ports.release)
            self._plan = stack.enter_context(leased(options.ports))
            others = len(ours) < len(self.starts)
            ahead = stack.enter_context(head_start or HeadStart(coordinator=others))
            self.crew = Crew(scenario, self.starts, self._plan, interrupted, ahead)
            stack.callback(self.crew.release)
            self._stack = stack.pop_all()
        self.clock: Clock | None = None
        self.started = 0.0  # free-running, fleet time is 0 then, on the monotonic clock
        self.ready = Readiness(len(self.starts))
        self._started_at = time.time()
        self._cpu_before = time.process_time()
        self.wall_s = 0.0
        self._view = view
        self._interrupted = interrupted
        self._ours = ours
        self.abandoned = ""  # the complaint about external vehicles that nobody steers any more
        self._show_is_lost = False  # and it was told
        self._phases: dict[str, str] = {}  # the last that was told of each
        self._events: Publisher | None = None

    def start(self) -> Clock:
        """Start everybody and return the clock; call `stop` whatever happens."""
        make_folder(self.folder, self.scenario, self.starts)
        self._log = self._stack.enter_context(open_events(self.folder))
        self.bus, self.endpoint = self._open_bus()
        self._stack.enter_context(self.bus)
        self._events = self.bus.publisher("events")
        # Free-running, all begin at one moment that nobody has reached yet.
        self.started = time.monotonic() + 0.1 + 0.005 * len(self.starts)
        lockstep, crew = self.options.lockstep, self.crew
        crew.start(
            self.folder,
            self.endpoint,
            lockstep=lockstep,
            started=self.started,
            record=self.options.record,
            serve=self.dashboard.ports.data if self.dashboard else None,
            ours=self._ours,
            step=self._view.step,
        )
        kind = Lockstep if lockstep else FreeRun
        self.clock = kind(crew.vehicles, crew.coordinators, self._interrupted, self.note)
        self._view.started(self.folder, crew.ports)
        if self._plan != self.options.ports:
            text = (
                f"another run has UDP {GCS_UDP} and {API_UDP} + i:"
                f" this one has {self._plan.gcs_udp} and {self._plan.api_udp} + i"
            )
            self.note({"t": 0.0, "vehicle": None, "kind": "ports", "text": text})
        return self.clock

    def note(self, event: dict[str, Any]) -> None:
        """Write, publish and show one event."""
        line = json.dumps(event)
        self._log.write(line + "\n")
        if self._events:
            self._events.put(line.encode())
        if event["kind"] == "phase":
            self._phases[event["vehicle"]] = event["text"]
        self.ready.note(event)
        self._view.event(event)

    def stop(self, *, hurry: bool, insists: Callable[[], bool] = lambda: False) -> None:
        """End every process, then leave the bus and give back the ports.

        External vehicles are brought to rest first, unless the user `insists`; `abandoned` tells
        of those whose coordinator was not there any more to do it.
        """
        with self._stack:
            step = self._view.step
            self.crew.stop(hurry=hurry, note=self.note, insists=insists, step=step)
            self.look_after_recording()
            self._note_abandoned()

    def look_after_recording(self) -> None:
        """Tell, once, of a recording that has broken off; open viewers when there is a show."""
        if loss := self.crew.lost():
            self._tell("problem", loss)
        if dashboard := self.dashboard:
            if (lost := self.crew.show_lost()) and not self._show_is_lost:
                self._show_is_lost = True
                self._tell("viewer", f"no viewer can come: {lost}; the run goes on")
            elif not lost and self.crew.wait_serving(0.0):
                for text in dashboard.open(self.folder / "viewers.txt"):
                    self._tell("viewer", text)
            for text in dashboard.look():
                self._tell("viewer", f"{text}; the run goes on")

    def end_show(self, *, hurry: bool) -> None:
        """Let no viewer come any more, at the very end; a window stays, with what it has."""
        if self.dashboard:
            self.dashboard.wait_fetched(hurry=hurry)
            for text in self.dashboard.look():  # the event log is complete
                self._view.event({"t": 0.0, "vehicle": None, "kind": "viewer", "text": text})
        self.crew.end_serving()
        if self.dashboard:
            self.dashboard.close()

    def _tell(self, kind: str, text: str) -> None:
        now = self.clock.now if self.clock else 0.0
        self.note({"t": round(now, 6), "vehicle": None, "kind": kind, "text": text})

    def _note_abandoned(self) -> None:
        silent = [c for c in self.crew.coordinators if not c.parted]
        names = {n for c in silent for n in c.external if may_be_armed(self._phases.get(n))}
        specs = [spec for spec in self.starts if spec.name in names]
        now = self.clock.now if self.clock else 0.0
        for spec in specs:
            self.note({"t": now, "vehicle": spec.name, "kind": "problem", "text": fate(spec)})
        self.abandoned = complaint(specs)

    def conclude(self, exit_code: int, error: str | None) -> Outcome:
        """Judge what has been stopped and write the report. Raises OSError when that cannot be."""
        if self.abandoned and self.abandoned not in (error or ""):
            error = f"{error}; {self.abandoned}" if error else self.abandoned
            exit_code = exit_code or VehicleError.exit_code
        crew, clock, options = self.crew, self.clock, self.options
        ticks, late = (clock.ticks, clock.late) if clock else (0, 0)
        if not options.lockstep:  # everybody has paced itself
            both = crew.coordinators, crew.vehicles
            ticks += sum(process.ticks for group in both for process in group)
            late += sum(process.late for group in both for process in group)
        ending = Ending(
            exit_code=exit_code,
            error=error,
            now=clock.now if clock else 0.0,
            wall_s=self.wall_s,
            ready_at=self.ready.at,
            ticks=ticks,
            late_ticks=late,
            outside_clients=sum(v.outside_clients for v in crew.vehicles),
            script=bool(self._ours),
            missing=tuple(crew.missing),
            started_at=self._started_at,
            costs=replace(crew.costs(), launcher=time.process_time() - self._cpu_before),
        )
        return conclude(
            self.folder,
            self.scenario,
            self.starts,
            ending,
            lockstep=options.lockstep,
            speed=options.speed,
            figures=options.figures and exit_code != INTERRUPTED,
            record=options.record,
            ports=crew.ports,
            step=self._view.step,
        )

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


def _dashboard(viewing: "Viewing | None") -> "Dashboard | None":
    """Raise MavherdError for what cannot be viewed here."""
    if not viewing:
        return None
    from ..recording.dashboard import Dashboard

    return Dashboard(viewing, stays=True)
