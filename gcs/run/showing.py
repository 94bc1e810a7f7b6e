"""What the launcher shows of a run: the newest states, a few times a second."""

import time

from ...scenarios.schema import Scenario
from ...transport.bus import Bus
from ...transport.local_bus import LocalBus
from ...transport.wire import VehicleState, unpack_state, unpack_team
from .clock_control import ClockControl
from .open_run import View

PAUSED = "paused"
_PERIOD_S = 0.1
_PAUSED_PERIOD_S = 1.0  # nothing moves


class Showing:
    """Keeps a view up to date; call it as often as you like."""

    def __init__(self, bus: Bus | LocalBus, scenario: Scenario, view: View) -> None:
        self._view = view
        self._at = 0.0
        # Of several coordinators each publishes its own vehicles only.
        central = scenario.team.coordinators == "central"
        names = [spec.name for spec in sorted(scenario.robots, key=lambda r: r.system_id)]
        keys = ["team"] if central else [f"vehicle/{name}/state" for name in names]
        self._newest = [bus.newest(key) for key in keys]
        self._unpack = _team if central else _state

    def show(self, now: float, factor: float, clock: str = "") -> None:
        """Show the team at fleet time `now`, `factor` times real time, and how the clock stands."""
        wall = time.monotonic()
        if wall < self._at:
            return
        self._at = wall + (_PAUSED_PERIOD_S if clock == PAUSED else _PERIOD_S)
        known = [self._unpack(data) for n in self._newest if (data := n.get()) is not None]
        self._view.update(now, [s for group in known for s in group], factor, clock)

    def show_paced(self, control: ClockControl, *, at_once: bool) -> None:
        """Show a team whose clock can be held."""
        control.measure(time.monotonic())
        if at_once:
            self._at = 0.0
        self.show(control.now, control.rate, _words(control))


def _team(data: bytes) -> list[VehicleState]:
    return unpack_team(data)[1]


def _state(data: bytes) -> list[VehicleState]:
    state = unpack_state(data)
    return [state] if state.time >= 0 else []


def _words(control: ClockControl) -> str:
    if control.paused:
        return PAUSED
    return "" if control.speed is None else f"speed {control.speed:g}"
