"""A script's run from opening to report: who is up, how time passes, how it all ends."""

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...scenarios.schema import Scenario
from ...transport.bus import Bus
from ...transport.switchboard import Switchboard
from ...transport.wire import Phase
from ..report.outcome import FAILED, INTERRUPTED, PASSED, Outcome
from ..run.conductor import FreeRun, Interrupted, Lockstep
from ..run.open_run import OpenRun, RunOptions
from ..run.view import Unseen
from ..safety.abandoned import complaint, fate
from ..safety.rest import WATCH_S, ComeToRest
from ..team.coordinator import Member
from ..team.ground import Ground
from .errors import FleetError, LinkLost
from .pace import FreePace, LockstepPace, Pace
from .scripted import Scripted
from .signals import Signals
from .values import Event
from .waiting import SILENT_S

_LOOK_S = 0.2  # of wall time between two looks at recorder and viewer


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
        self._look_at = 0.0  # on the wall clock
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
        if self._run is not None or self._closed:
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
            self._look_after_recording()

    def close(self, at_end: str, error: BaseException | None) -> None:
        """Bring vehicles to rest, end everything, report; never masks the `error` it ends with."""
        if self._closed:
            return
        self._closed = True
        failures: list[BaseException] = []
        steps: list[Callable[[], None]] = [
            lambda: self._farewell(at_end),
            self._end_time,
            self._stop,
            lambda: self._report(error or (failures[0] if failures else None)),
            lambda: self._end_show(hurry=error is not None),
        ]
        for step in steps:
            try:
                step()
            except BaseException as failure:  # raised below, or noted, when all has been ended
                failures.append(failure)
        self._signals.remove()
        if error is None and failures:
            raise failures[0]
        if error is not None:
            for failed in failures:
                error.add_note(f"while the fleet was closed: {failed!r}")
                for note in getattr(failed, "__notes__", ()):
                    error.add_note(note)

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

    def _look_after_recording(self) -> None:
        wall = time.monotonic()
        if self._run and wall > self._look_at:
            with self.pace.lock:
                self._run.look_after_recording()
            self._look_at = wall + _LOOK_S

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
        """Have every vehicle that the script has commanded hold, then do as `at_end` says.

        When a process has failed only external ones: our own end with the run.
        """
        pace, ground = self._pace, self._ground
        if at_end == "leave" or pace is None or ground is None:
            return
        resting: dict[str, ComeToRest] = {}
        with pace.lock:
            ours = [name for name, member in self._members().items() if _is_under_way(member)]
            if pace.failed:
                ours = [name for name in ours if self._members()[name].spec.external]
            if not pace.broken:
                resting = {n: ground.core.bring_to_rest(n, pace.now, at_end) for n in ours}
        try:
            if pace.broken and ours:
                raise FleetError("the vehicles cannot be brought to rest")
            self._see_to_rest(pace, resting)
        except BaseException as error:
            left = [name for name in ours if name not in resting or not resting[name].done]
            self._tell_abandoned(error, left)
            raise

    def _see_to_rest(self, pace: Pace, resting: Mapping[str, ComeToRest]) -> None:
        """Let time pass until all are at rest; raise LinkLost when some do not come to it."""
        lost: dict[str, str] = {}
        give_up_at = pace.now + WATCH_S + SILENT_S
        while waiting := [n for n, rest in resting.items() if not rest.done and n not in lost]:
            with self._signals.guard():
                pace.step(anyhow=True)
            for name in waiting:
                silent = pace.now - self._members()[name].station.status.heartbeat_at
                if silent > SILENT_S:
                    lost[name] = f"{name}: nothing heard for {silent:.0f} s, it was armed"
                elif pace.now > give_up_at:
                    lost[name] = f"{name}: does not come to rest, it was armed"
        if lost:
            raise LinkLost(f"left as they are: {'; '.join(lost.values())}")

    def _tell_abandoned(self, error: BaseException, left: Sequence[str]) -> None:
        """Tell of external vehicles that nobody steers any more, in the error and the events."""
        specs = [self._members()[n].spec for n in left if self._members()[n].spec.external]
        if specs:
            error.add_note(complaint(specs))
        for spec in specs:
            event = {"t": self.pace.now, "vehicle": spec.name, "kind": "problem"}
            if self._run:
                self._run.note({**event, "text": fate(spec)})

    def _end_time(self) -> None:
        """Send no more setpoints."""
        if self._pace:
            self._pace.close()

    def _stop(self) -> None:
        """End every process; nothing is left afterwards."""
        run = self._run
        if self._lines and not self._ground:
            self._lines.close()
        if run is None:
            return
        with self._signals.guard():
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
        if run.ready.at is None:
            run.ready.at = 0.0  # everything counts
        match error:
            case None:
                code, text = PASSED, None
            case KeyboardInterrupt() | Interrupted():
                code, text = INTERRUPTED, "interrupted"
            case _:
                code, text = FAILED, f"the script ended with {type(error).__name__}: {error}"
        self.outcome = run.conclude(code, text)

    def _end_show(self, *, hurry: bool) -> None:
        if self._run:
            self._run.end_show(hurry=hurry)


class _Log(Unseen):
    """Keeps what happens for the script."""

    def __init__(self, events: list[Event]) -> None:
        self._events = events

    def event(self, event: dict[str, Any]) -> None:
        """Keep one event."""
        self._events.append(Event(event["t"], event["vehicle"], event["kind"], event["text"]))


def _is_under_way(member: Member) -> bool:
    """Return whether the script has armed it, or an arming of the script's may still succeed."""
    conduct = member.mission
    if not isinstance(conduct, Scripted) or not conduct.commanded:
        return False
    return member.station.status.armed or conduct.phase is Phase.STARTING
