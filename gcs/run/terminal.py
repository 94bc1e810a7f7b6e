"""What a person sees in the terminal (stderr, so that `--json` leaves stdout pure)."""

from collections.abc import Mapping, Sequence
from math import dist
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from ...scenarios.paths import end_point
from ...scenarios.schema import Goto, Hold, Scenario
from ...transport.wire import VehicleState
from ..report.summary import ports_table, summary_table
from .live_view import LiveView

if TYPE_CHECKING:
    from ..report.outcome import Outcome

_PRINTED = ("preflight", "problem", "link", "rest")  # kinds of events: all about external vehicles


class QuietConsole(Console):
    """Writes to stderr; when nobody reads any more (`2>&1 | head`) the run goes on in silence."""

    def __init__(self) -> None:
        super().__init__(stderr=True)

    def on_broken_pipe(self) -> None:
        """Say nothing from now on."""
        self.quiet = True


class RunView:
    """The launcher's view of one scenario: ports when it starts, the team, what happens."""

    def __init__(self, scenario: Scenario, console: Console | None = None) -> None:
        self._console = console or QuietConsole()
        kinds = {spec.name: spec.kind for spec in scenario.robots}
        self._live = LiveView(kinds, scenario.duration, self._console)
        self._goals = {
            spec.name: end_point(spec, scenario.team)
            for spec in scenario.robots
            if isinstance(spec.path, Goto | Hold)
        }
        self._flat = {name for name, kind in kinds.items() if kind == "rover"}
        self._message = ""

    def __enter__(self) -> "RunView":
        self._live.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.__exit__()

    def started(self, folder: Path, ports: Mapping[str, Any]) -> None:
        """Say where outside programs can connect."""
        self._console.print(ports_table(ports), f"[dim]run folder {folder}[/dim]", highlight=False)

    def update(self, now: float, states: Sequence[VehicleState], factor: float) -> None:
        """Show the team at fleet time `now`, running `factor` times as fast as real time."""
        to_go = {}
        for s in states:
            if (goal := self._goals.get(s.name)) is not None:
                axes = 2 if s.name in self._flat else 3
                to_go[s.name] = dist(s.position[:axes], goal[:axes])
        self._live.update(now, states, to_go, factor, self._message)

    def event(self, event: Mapping[str, Any]) -> None:
        """Keep what happened last; print what a user waits for, or must know."""
        who = f"{event['vehicle']}: " if event.get("vehicle") else ""
        self._message = f"{who}{event['text']}"
        if event["kind"] in _PRINTED:
            self._console.print(self._message, highlight=False, markup=False, soft_wrap=True)


def print_outcome(outcome: "Outcome", console: Console | None = None) -> None:
    """Print how a run ended and where to look further."""
    console = console or QuietConsole()
    console.print(summary_table(outcome.report, outcome.folder))
    for note in outcome.notes:
        console.print(f"note: {note}", highlight=False, markup=False, soft_wrap=True)
