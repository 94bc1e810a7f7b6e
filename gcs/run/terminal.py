"""What a person sees in the terminal (stderr, so that `--json` leaves stdout pure)."""

from collections.abc import Mapping, Sequence
from math import dist
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from ...scenarios.paths import end_point
from ...scenarios.schema import Goto, Hold, Scenario
from ...transport.wire import VehicleState
from ..report.summary import summary_table
from .keys import HINT
from .live_view import LiveView
from .ports_table import ports_table
from .team_text import Scene

if TYPE_CHECKING:
    from ..report.outcome import Outcome

_PRINTED = ("preflight", "problem", "link", "rest", "ports")  # kinds of events
_TROUBLE = ("problem", "link", "bus")
_TROUBLE_S = 20.0  # of fleet time, in which it is shown


class QuietConsole(Console):
    """Writes to stderr; when nobody reads any more (`2>&1 | head`) the run goes on in silence."""

    def __init__(self) -> None:
        super().__init__(stderr=True)

    def on_broken_pipe(self) -> None:
        """Say nothing from now on."""
        self.quiet = True


class RunView:
    """The launcher's view of one scenario: ports when it starts, the team, what happens.

    With `keys` it says which keys do something.
    """

    def __init__(
        self, scenario: Scenario, console: Console | None = None, *, keys: bool = False
    ) -> None:
        self._console = console or QuietConsole()
        hint = HINT if keys else ""
        kinds = {spec.name: spec.kind for spec in scenario.robots}
        self._live = LiveView(kinds, scenario.duration, self._console, hint)
        self._goals = {
            spec.name: end_point(spec, scenario.team)
            for spec in scenario.robots
            if isinstance(spec.path, Goto | Hold)
        }
        self._flat = {name for name, kind in kinds.items() if kind == "rover"}
        self._message = ""
        self._trouble: dict[str, float] = {}  # when something was last said that one should see

    def __enter__(self) -> "RunView":
        self._live.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.__exit__()

    def started(self, folder: Path, ports: Mapping[str, Any]) -> None:
        """Say where outside programs can connect."""
        if ports:
            self._console.print(ports_table(ports))
        self._console.print(f"[dim]run folder {folder}[/dim]", highlight=False)

    def update(
        self, now: float, states: Sequence[VehicleState], factor: float, clock: str = ""
    ) -> None:
        """Show the team at fleet time `now`, running `factor` times as fast as real time."""
        to_go: dict[str, float] = {}
        for s in states:
            if (goal := self._goals.get(s.name)) is not None:
                axes = 2 if s.name in self._flat else 3
                to_go[s.name] = dist(s.position[:axes], goal[:axes])
        troubled = {name for name, at in self._trouble.items() if now - at < _TROUBLE_S}
        self._live.update(now, Scene(states, to_go, troubled), factor, self._message, clock)

    def event(self, event: Mapping[str, Any]) -> None:
        """Keep what happened last; print what a user waits for, or must know."""
        who = f"{event['vehicle']}: " if event.get("vehicle") else ""
        self._message = f"{who}{event['text']}"
        if event["kind"] in _TROUBLE and event.get("vehicle"):
            self._trouble[event["vehicle"]] = event["t"]
        if event["kind"] in _PRINTED:
            self._console.print(self._message, highlight=False, markup=False, soft_wrap=True)


def print_outcome(outcome: "Outcome", console: Console | None = None) -> None:
    """Print how a run ended and where to look further."""
    console = console or QuietConsole()
    console.print(summary_table(outcome.report, outcome.folder))
    for note in outcome.notes:
        console.print(f"note: {note}", highlight=False, markup=False, soft_wrap=True)
