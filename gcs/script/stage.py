"""A script's run from opening to report: who is up, how time passes, how it all ends."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ...scenarios.schema import Scenario
from ...transport.bus import Bus
from ...transport.errors import MavherdError
from ...transport.switchboard import Switchboard
from ..report.outcome import FAILED, INTERRUPTED, PASSED, Outcome
from ..run.conductor import FreeRun, Interrupted, Lockstep
from ..run.open_run import OpenRun, RunOptions, Unseen
from ..safety.rest import ComeToRest
from ..team.coordinator import Member
from ..team.ground import Ground
from .errors import FleetError, LinkLost
from .pace import FreePace, LockstepPace, Pace
from .scripted import Scripted
from .signals import Signals, Terminated
from .values import Event
from .waiting import SILENT_S


class Stage:
    """Everything behind a `Fleet`, from opening to report; for one thread."""

    def __init__(
        self,
        scenario: Scenario,
        options: RunOptions,
        ours: Sequence[str],
        lines: Switchboard | None = None,
    ) -> None:
        self.events: list[Event] = []
        self.outcome: Outcome | None = None
        self._scenario = scenario
        self._options = options
        self._ours = ours
        self._lines = lines  # open already
        self._signals = Signals()
        self._run: OpenRun | None = None
        self._ground: Ground | None = None
        self._pace: Pace | None = None
        self._began = 0.0
        self._closed = False

    @property
    def pace(self) -> Pace:
        """How time passes."""
        if self._pace is None:
            raise FleetError("the fleet is not open (use it in a `with` block)")
        return self._pace

    @property
    def folder(self) -> Path:
        """The run folder."""
        if self._run is None:
            raise FleetError("the fleet has no run folder before it is opened")
        return self._run.folder

    def open(self) -> dict[str, tuple[Member, Scripted]]:
        """Start everything; return the script's vehicles once all are known."""
        if self._run is not None:
            raise FleetError("a fleet is opened once (make another)")
        self._signals.install()
        try:
            with self._signals.guard():
                self._start()
            return self._known()
        except BaseException as error:
            self.close("leave", error)
            if isinstance(error, Interrupted):
                raise KeyboardInterrupt from None
            raise

    def step(self) -> None:
        """Let one coordination period pass."""
        with self._signals.guard():
            self.pace.step()

    def close(self, at_end: str, error: BaseException | None) -> None:
        """Bring vehicles to rest, end everything, report; never masks the `error` it ends with."""
        if self._closed:
            return
        self._closed = True
        failures: list[BaseException] = []
        steps: list[Callable[[], None]] = [
            lambda: self._farewell(at_end),
            self._stop,
            lambda: self._report(error or (failures[0] if failures else None)),
        ]
        for step in steps:
            try:
                step()
            except (MavherdError, OSError, KeyboardInterrupt, Terminated) as failure:
                failures.append(failure)
        self._signals.remove()
        if error is None and failures:
            raise failures[0]
        if error is not None:
            for failed in failures:
                error.add_note(f"while the fleet was closed: {failed!r}")

    def _start(self) -> None:
        self._run = run = OpenRun(
            self._scenario,
            self._options,
            _Log(self.events),
            self._signals.interrupted,
            ours=self._ours,
        )
        clock = run.start()
        lockstep = self._options.lockstep
        self._ground = ground = Ground(
            self._scenario,
            {name: run.crew.ends.get(name) for name in self._ours},
            folder=run.folder,
            bus=Bus.client(run.endpoint, run.folder.name, reliable=lockstep),
            lockstep=lockstep,
            started=run.started,
            conduct=Scripted,
            strict=False,
            lines=self._lines,
        )
        self._began = time.monotonic()
        if isinstance(clock, Lockstep):
            self._pace = LockstepPace(run, clock, ground)
        elif isinstance(clock, FreeRun):
            self._pace = FreePace(run, clock, ground)

    def _known(self) -> dict[str, tuple[Member, Scripted]]:
        """Let time pass until every vehicle may be steered and its place is known."""
        found = {}
        for name, member in self._members().items():
            while member.station.status.position_at < 0 or not member.prepared:
                self.step()
                if member.problem:
                    raise FleetError(member.problem)
            assert isinstance(member.mission, Scripted)  # noqa: S101 - as Ground was told
            found[name] = member, member.mission
        return found

    def _members(self) -> dict[str, Member]:
        return self._ground.core.members if self._ground else {}

    def _farewell(self, at_end: str) -> None:
        """Have every armed vehicle that the script has commanded hold, then do as `at_end` says."""
        if at_end == "leave" or self._pace is None or self._pace.broken:
            return
        pace, resting = self._pace, dict[str, ComeToRest]()
        with pace.lock:
            for name, member in self._members().items():
                conduct, status = member.mission, member.station.status
                if isinstance(conduct, Scripted) and conduct.commanded and status.armed:
                    rest = ComeToRest(member, self._scenario, at_end, pace.now)
                    member.mission = resting[name] = rest
        lost: dict[str, str] = {}
        while any(not rest.done for name, rest in resting.items() if name not in lost):
            self.step()
            for name in resting:
                silent = pace.now - self._members()[name].station.status.heartbeat_at
                if silent > SILENT_S:
                    lost[name] = f"{name}: nothing heard for {silent:.0f} s, it was armed"
        if lost:
            raise LinkLost(f"left as they are: {'; '.join(lost.values())}")

    def _stop(self) -> None:
        """End every process; nothing is left afterwards."""
        run = self._run
        if self._lines and not self._ground:
            self._lines.close()
        if run is None:
            return
        if self._pace:
            self._pace.close()
        run.wall_s = time.monotonic() - self._began
        if self._ground:
            self._ground.close()
        run.stop(hurry=False)
        if run.abandoned:
            raise FleetError(run.abandoned)

    def _report(self, error: BaseException | None) -> None:
        run = self._run
        if run is None or run.clock is None:
            return
        if run.ready_at is None:
            run.ready_at = 0.0  # everything counts
        match error:
            case None:
                code, text = PASSED, None
            case KeyboardInterrupt() | Interrupted():
                code, text = INTERRUPTED, "interrupted"
            case _:
                code, text = FAILED, f"the script ended with {type(error).__name__}: {error}"
        self.outcome = run.conclude(code, text)


class _Log(Unseen):
    """Keeps what happens for the script."""

    def __init__(self, events: list[Event]) -> None:
        self._events = events

    def event(self, event: dict[str, Any]) -> None:
        """Keep one event."""
        self._events.append(Event(event["t"], event["vehicle"], event["kind"], event["text"]))
