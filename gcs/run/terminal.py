"""What a person sees in the terminal (stderr, so that `--json` leaves stdout pure)."""

from collections.abc import Callable, Mapping, Sequence
from math import dist
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from rich.console import Console, RenderableType

from ...scenarios.paths import end_point
from ...scenarios.schema import Goto, Hold, Scenario
from ...transport.wire import VehicleState
from ..patience import Patience
from ..report.summary import summary_table
from .console import QuietConsole
from .keys import HINT
from .live_view import LiveView
from .ports_table import ports_table
from .team_text import Scene
from .view import Going

if TYPE_CHECKING:
    from ..report.outcome import Outcome

_PRINTED = ("preflight", "problem", "stall", "link", "rest", "ports", "viewer")  # kinds of events
_TROUBLE = ("problem", "stall", "link", "bus")
_TROUBLE_S = 20.0  # of fleet time, in which it is shown


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
        tick = 1.0 / scenario.team.rate_hz
        self._live = LiveView(kinds, scenario.duration, self._console, hint, tick)
        self._goals = {
            spec.name: end_point(spec, scenario.team)
            for spec in scenario.robots
            if isinstance(spec.path, Goto | Hold)
        }
        self._flat = {name for name, kind in kinds.items() if kind == "rover"}
        self._too_old = scenario.team.state_timeout_s
        self._message = ""
        self._trouble: dict[str, float] = {}  # when something was last said that one should see
        self._patience: Patience | None = None
        self._tell: Callable[[str], None] = lambda _: None

    def __enter__(self) -> "RunView":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._live.clear()
        self._end_step()

    def step(self, text: str) -> None:
        """Say what is waited for, if that takes long."""
        if self._patience is None:
            self._live.clear()
            self._patience = Patience(self._console)
            self._tell = self._patience.__enter__()
        self._tell(text)

    def started(self, folder: Path, ports: Mapping[str, Any]) -> None:
        """Say where outside programs can connect."""
        self._end_step()
        if ports:
            self._print(ports_table(ports))
        self._print(f"run folder {folder}")

    def update(self, now: float, states: Sequence[VehicleState], going: Going) -> None:
        """Show the team at fleet time `now`."""
        to_go: dict[str, float] = {}
        for s in states:
            if (goal := self._goals.get(s.name)) is not None:
                axes = 2 if s.name in self._flat else 3
                to_go[s.name] = dist(s.position[:axes], goal[:axes])
        troubled = {name for name, at in self._trouble.items() if now - at < _TROUBLE_S}
        old = {s.name: now - s.time for s in states if now - s.time > self._too_old}
        self._live.update(now, Scene(states, to_go, troubled, old), going, self._message)

    def event(self, event: Mapping[str, Any]) -> None:
        """Keep what happened last; print what a user waits for, or must know."""
        who = f"{event['vehicle']}: " if event.get("vehicle") else ""
        text = f"{who}{event['text']}"
        if event["kind"] in _TROUBLE and event.get("vehicle"):
            self._trouble[event["vehicle"]] = event["t"]
        if event["kind"] in _PRINTED:
            self._print(text)
        else:
            self._message = text

    def _print(self, what: RenderableType) -> None:
        if self._patience:  # which has the terminal
            self._console.print(what, highlight=False, markup=False, soft_wrap=True)
        else:
            self._live.print(what)

    def _end_step(self) -> None:
        if self._patience:
            self._patience.__exit__(None, None, None)
        self._patience = None


def print_outcome(outcome: "Outcome", console: Console | None = None) -> None:
    """Print how a run ended and where to look further."""
    console = console or QuietConsole()
    console.print(summary_table(outcome.report, outcome.folder), crop=False)  # paths stay whole
    for note in outcome.notes:
        console.print(f"note: {note}", highlight=False, markup=False, soft_wrap=True)
