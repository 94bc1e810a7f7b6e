"""What the launcher shows of a run: the newest states, a few times a second."""

from collections.abc import Callable
from time import monotonic

from ...scenarios.schema import Scenario
from ...transport.bus import Bus
from ...transport.wire import VehicleState, unpack_state, unpack_team
from .clock_control import ClockControl
from .view import Going, View

_PERIOD_S = 0.25
_PAUSED_PERIOD_S = 1.0  # nothing moves
_PAUSED = "paused"
Look = Callable[[], list[VehicleState]]


class Showing:
    """Keeps a view up to date; call it as often as you like. `look` returns the newest states."""

    def __init__(self, view: View, look: Look) -> None:
        self._view = view
        self._look = look
        self._at = 0.0
        self._shown = 0.0  # s of fleet time

    def show(self, now: float, going: Going) -> None:
        """Show the team at fleet time `now`, and how it goes on."""
        wall = monotonic()
        if wall < self._at:
            return
        self._shown = now
        self._at = wall + (_PAUSED_PERIOD_S if going.clock == _PAUSED else _PERIOD_S)
        states = sorted(self._look(), key=lambda state: state.system_id)
        self._view.update(now, states, going)

    def show_paced(self, control: ClockControl, *, at_once: bool, outside: int = 0) -> None:
        """Show a team whose clock can be held: at once, too, when it has come to stand still.

        `outside` clients have come to the vehicles' own ports.
        """
        control.measure(monotonic())
        if at_once or (control.standing and control.now != self._shown):
            self._at = 0.0
        going = Going(control.rate, _words(control), control.late, outside)
        self.show(control.now, going)


def look_at_teams(teams: Callable[[], list[bytes]]) -> Look:
    """Return how to see the states in `team` messages that are there for the asking.

    Every tick on the bus would cost a lone robot's run a third of its speed.
    """
    return lambda: [state for data in teams() for state in unpack_team(data)[1]]


def look_at_bus(bus: Bus, scenario: Scenario) -> Look:
    """Return how to see what coordinators that run free publish."""
    # Of several coordinators each publishes its own vehicles only.
    central = scenario.team.coordinators == "central"
    names = [spec.name for spec in scenario.robots]
    keys = ["team"] if central else [f"vehicle/{name}/state" for name in names]
    newest = [bus.newest(key) for key in keys]
    unpack = _team if central else _state

    def look() -> list[VehicleState]:
        known = [data for sample in newest if (data := sample.get()) is not None]
        return [state for data in known for state in unpack(data)]

    return look


def _team(data: bytes) -> list[VehicleState]:
    return unpack_team(data)[1]


def _state(data: bytes) -> list[VehicleState]:
    state = unpack_state(data)
    return [state] if state.time >= 0 else []


def _words(control: ClockControl) -> str:
    if control.paused:
        return _PAUSED
    return "" if control.speed is None else f"speed {control.speed:g}"
