"""A fleet for scripts: `with Fleet.from_scenario("one-quad") as fleet: fleet["quad1"].arm()`."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, overload

from ...scenarios.errors import did_you_mean
from ...scenarios.loader import load_scenario
from ...scenarios.schema import Expect, Fence, Hold, Scenario
from ...transport.frames import Origin
from ..report.outcome import Outcome
from ..run.open_run import RunOptions
from ..safety.permission import external, permit
from ..team.coordinator import check_laws
from .errors import FleetError, TimedOut
from .group import Group
from .stage import Stage
from .survey import survey, team_of
from .values import Event
from .vehicle import Vehicle
from .waiting import DEFAULT_S, Waiting

if TYPE_CHECKING:
    from ..recording.viewers import Viewing

AT_END = ("land", "hold", "return", "leave")


class Fleet:
    """Several vehicles that a script commands; coordination and the safety filter stay on.

    Made by `Fleet.from_scenario` (our own vehicles, or a scenario's external ones) or
    `Fleet.connect` (whoever is there), and opened by `with`. Leaving the block brings vehicles
    that are still armed to hold, then does what `at_end` says, ends what was started, and writes
    the report. `fleet["quad1"]`, `fleet[4]` (system id), `fleet["quad1", "quad2"]`, `fleet.all`.
    """

    def __init__(self, stage: Stage, at_end: str) -> None:
        self._stage = stage
        self._at_end = at_end
        self._vehicles: dict[str, Vehicle] = {}

    @classmethod
    def from_scenario(
        cls,
        scenario: str | Path,
        *,
        own: Sequence[str] = (),
        lockstep: bool | None = None,
        speed: float | None = None,
        seed: int | None = None,
        set: Sequence[str] = (),
        out: str | Path = "runs",
        record: bool = False,
        view: bool = False,
        at_end: str = "land",
        confirm: bool = False,
    ) -> "Fleet":
        """Return the fleet of a scenario: the name of a shipped one, or a file.

        The script steers the vehicles in `own`, all unless given; the others follow their own
        paths, and begin when yours are armed and up. In `lockstep` (default, unless a vehicle is
        external) time passes only while the script waits: as fast as it goes, or `speed` times
        real time, and the same each time. `set=["team.law=off"]` changes keys as `--set` does.
        With `view` Rerun's viewer shows it live, at real time unless `speed` is given.
        `confirm` is needed when vehicles are not on this machine.
        """
        _check_end(at_end)
        given = load_scenario(scenario, set, seed)
        check_laws(given)
        names = [spec.name for spec in given.robots]
        for name in own:
            if name not in names:
                raise FleetError(f"own: no robot is called {name!r} ({did_you_mean(name, names)})")
        ours = [name for name in names if not own or name in own]
        addresses = external(given)
        if addresses and lockstep:
            first = next(iter(addresses))
            raise FleetError(
                f"lockstep: {first} is external and keeps its own time (leave lockstep out)"
            )
        locked = not addresses if lockstep is None else lockstep
        if speed is not None and not locked:
            raise FleetError("speed: a free-running fleet follows the wall clock (leave it out)")
        permit(addresses, given.fence, None if confirm else "confirm=True")
        if view and locked and speed is None:
            speed = 1.0
        options = RunOptions(
            lockstep=locked, speed=speed, record=record, viewing=_viewing(view), out=Path(out)
        )
        return cls(Stage(_for_a_script(given, ours), options, ours), at_end)

    @classmethod
    def connect(
        cls,
        *addresses: str,
        origin: Origin | None = None,
        law: str = "safe",
        fence: Fence | None = None,
        expect_count: int | None = None,
        timeout: float = 60.0,
        out: str | Path = "runs",
        record: bool = False,
        view: bool = False,
        at_end: str = "land",
        confirm: bool = False,
    ) -> "Fleet":
        """Return the fleet of whoever is there: `udpin:127.0.0.1:14550`, `tcp:127.0.0.1:5760`.

        Waits until a vehicle is heard at each address, or `expect_count` in all, and until they
        know where they are. They are called quad1, quad2, rover1, ... by kind in order of system
        id. Positions count from `origin`, else from where the first one's own frame begins.
        `view` shows it live. `confirm` and a `fence` are needed when an address is not on this
        machine's loopback.
        """
        named = {f"address {n}": text for n, text in enumerate(addresses, 1)}
        permit(named, fence, None if confirm else "confirm=True")
        _check_end(at_end)
        board, known = survey(addresses, expect=expect_count, timeout=timeout)
        try:
            team = team_of(known, origin=origin, fence=fence, law=law, timeout=timeout)
            check_laws(team)
            viewing = _viewing(view)
            options = RunOptions(lockstep=False, record=record, viewing=viewing, out=Path(out))
            return cls(Stage(team, options, list(known), board), at_end)
        except BaseException:
            board.close()
            raise

    def open(self) -> "Fleet":
        """Start everything and wait until every vehicle is known; `with` does this."""
        members = self._stage.open()
        self._vehicles = {n: Vehicle(self, m, c) for n, (m, c) in members.items()}
        return self

    def close(self) -> None:
        """Bring vehicles to rest, end everything and write the report; `with` does this."""
        self._stage.close(self._at_end, None)

    def __enter__(self) -> "Fleet":
        return self.open()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._stage.close(self._at_end, error)

    # Vehicles

    @overload
    def __getitem__(self, key: str | int) -> Vehicle: ...
    @overload
    def __getitem__(self, key: tuple[str | int, ...]) -> Group: ...
    def __getitem__(self, key: str | int | tuple[str | int, ...]) -> Vehicle | Group:
        """Return the vehicle of a name or system id, or a group of several."""
        if isinstance(key, tuple):
            return Group(self, [self[one] for one in key])
        for vehicle in self:
            if key in (vehicle.name, vehicle.system_id):
                return vehicle
        known = [v.name for v in self] if isinstance(key, str) else [str(v.system_id) for v in self]
        raise FleetError(f"no vehicle {key!r} in this fleet ({did_you_mean(str(key), known)})")

    def __iter__(self) -> Iterator[Vehicle]:
        return iter(self._vehicles.values())

    def __len__(self) -> int:
        return len(self._vehicles)

    @property
    def all(self) -> Group:
        """All vehicles, to be told the same at once."""
        return Group(self, list(self))

    # Time

    @property
    def time(self) -> float:
        """Fleet time in seconds: simulated in lockstep, since the start when free-running."""
        return self._stage.pace.now

    @property
    def lock(self) -> AbstractContextManager[Any]:
        """Hold it to read several values of one moment while a fleet runs freely."""
        return self._stage.pace.lock

    def sleep(self, seconds: float) -> None:
        """Let fleet time pass; vehicles go on with what they were told."""
        end = self.time + seconds - 1e-9
        while self.time < end:
            self._step()

    def wait(self, condition: Callable[[], bool], timeout: float = DEFAULT_S) -> None:
        """Wait until `condition` is true, looked at once a tick; raise TimedOut else."""
        end = self.time + timeout
        while True:
            with self.lock:
                if condition():
                    return
            if self.time > end:
                raise TimedOut(f"wait: the condition was not true within {timeout:g} s")
            self._step()

    def await_all(self, waits: Sequence[Waiting]) -> None:
        """Wait until each is over; when some fail the others go on, then the first is raised."""
        waiting, failed = list(waits), list[BaseException]()
        while waiting:
            with self.lock:
                now, going_on = self.time, []
                for wait in waiting:
                    try:
                        if not wait.look(now):
                            going_on.append(wait)
                    except FleetError as error:
                        failed.append(error)
            waiting = going_on
            if waiting:
                self._step()
        if failed:
            for other in failed[1:]:
                failed[0].add_note(f"also: {other}")
            raise failed[0]

    def _step(self) -> None:
        self._stage.step()
        for vehicle in self:
            vehicle.conduct.raise_failure()

    # What happened

    @property
    def events(self) -> list[Event]:
        """Everything that has happened so far, oldest first."""
        return self._stage.events[:]

    @property
    def folder(self) -> Path:
        """The run folder."""
        return self._stage.folder

    @property
    def outcome(self) -> Outcome | None:
        """What the judge says of the run, once the fleet is closed."""
        return self._stage.outcome


def _check_end(at_end: str) -> None:
    if at_end not in AT_END:
        raise FleetError(f"at_end: {at_end!r} is none of {', '.join(AT_END)}")


def _viewing(view: bool) -> "Viewing | None":
    if not view:
        return None
    from ..recording.viewers import Viewing

    return Viewing(native=True)


def _for_a_script(scenario: Scenario, ours: Sequence[str]) -> Scenario:
    """Return the scenario with the script's vehicles free, and judged for safety only."""
    robots = tuple(
        replace(spec, path=Hold(at=spec.start)) if spec.name in ours else spec
        for spec in scenario.robots
    )
    expect = Expect(
        collisions=scenario.expect.collisions, min_separation_m=scenario.expect.min_separation_m
    )
    return replace(scenario, robots=robots, expect=expect)
