"""What a run tells whoever shows it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from ...transport.wire import VehicleState

Step = Callable[[str], None]
"""Is told what is waited for."""


class Going(NamedTuple):
    """How a run goes on."""

    factor: float = 1.0  # times as fast as real time
    clock: str = ""  # what was asked of it: "paused", "speed 2", or nothing
    late: int = 0  # ticks that came too late, so far
    outside: int = 0  # clients at the vehicles' own ports, so far


class View(Protocol):
    """Shows a run."""

    def step(self, text: str) -> None:
        """Say what is waited for, before the run begins and after it has ended."""
        ...

    def started(self, folder: Path, ports: dict[str, Any]) -> None:
        """Everything is up; the run begins."""
        ...

    def update(self, now: float, states: list[VehicleState], going: Going) -> None:
        """Show the team at fleet time `now`."""
        ...

    def event(self, event: dict[str, Any]) -> None:
        """Show one event."""
        ...


class Unseen:
    """A view that shows nothing."""

    def step(self, text: str) -> None:
        """Show nothing."""

    def started(self, folder: Path, ports: dict[str, Any]) -> None:
        """Show nothing."""

    def update(self, now: float, states: list[VehicleState], going: Going) -> None:
        """Show nothing."""

    def event(self, event: dict[str, Any]) -> None:
        """Show nothing."""
