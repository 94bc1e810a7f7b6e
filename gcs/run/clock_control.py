"""Pause, step, speed: what may be asked of a lockstep clock while it goes, and what it answers.

No I/O and no clock of its own: `wall` is the monotonic time, given by the caller.
"""

from math import inf
from typing import Any

from ...scenarios.errors import show
from ...transport.errors import MavherdError
from .pacing import Pacer, Rate, read_speed

MAX_STEPS = 1_000_000
COMMANDS = "pause, resume, toggle, step [N], speed FACTOR|max, faster, slower, status"
FREE = "the team runs free, on the wall clock, which nobody pauses, steps or hurries"
_LADDER = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)


class ClockControl:
    """Says when the next tick of a run may begin; takes the commands that change it.

    `period` is a tick in simulated seconds, `speed` the factor to real time, None for as fast as
    it goes. How time passes changes nothing in the simulation: no byte, and so no digest.
    """

    def __init__(
        self, period: float, speed: float | None, *, paused: bool = False, wall: float
    ) -> None:
        self.speed = speed
        self.paused = paused
        self.now = 0.0  # s of fleet time
        self.due = 0.0  # the next tick may begin then; infinity: not before somebody says so
        self._period = period
        self._steps = 0  # that remain, while paused
        self._pacer: Pacer | None = None
        self._late = 0  # ticks, at speeds before this one
        self._stands_since: float | None = None
        self._stood = 0.0  # s of wall time
        self._rate = Rate(wall, 0.0)
        self._go_on(wall)

    @property
    def stepping(self) -> bool:
        """Whether it stands still as soon as the steps that were asked for are done."""
        return self._steps > 0

    @property
    def standing(self) -> bool:
        """Whether time stands still until somebody lets it go on."""
        return self.due == inf

    @property
    def late(self) -> int:
        """How many ticks came too late for the speed that was asked for."""
        return self._late + (self._pacer.late if self._pacer else 0)

    @property
    def rate(self) -> float:
        """How many times faster than real time it has gone of late, pauses left out."""
        return self._rate.value

    def allowed(self, wall: float) -> int:
        """Return how many ticks may be done at once, when one is due."""
        if self.stepping:
            return 1 if self._pacer else self._steps
        return self._pacer.count_due(wall) if self._pacer else MAX_STEPS

    def stood(self, wall: float) -> float:
        """Return for how much wall time it has stood still until now."""
        since = self._stands_since
        return self._stood + (wall - since if since is not None else 0.0)

    def ticked(self, now: float, wall: float, ticks: int = 1) -> None:
        """Take in that so many ticks have led to fleet time `now`."""
        self.now = now
        if self._pacer:
            for _ in range(ticks):
                self._pacer.advance(wall)
            self.due = self._pacer.due
        if self._steps:
            self._steps -= ticks
            if not self._steps:
                self._go_on(wall)

    def measure(self, wall: float) -> None:
        """Look at how fast it goes, a few times a second."""
        self._rate.add(wall - self.stood(wall), self.now)

    def order(self, text: str, wall: float) -> bool:
        """Obey a command; return whether it has changed anything. Raise MavherdError if not."""
        before = self.paused, self.speed, self._steps
        match text.split():
            case ["pause"]:
                self.paused, self._steps = True, 0
            case ["resume"]:
                self.paused, self._steps = False, 0
            case ["toggle"]:
                self.paused, self._steps = not self.paused, 0
            case ["step", *count] if len(count) < 2:
                self.paused, self._steps = True, self._steps + _count(*count)
            case ["speed", factor]:
                self.speed = read_speed(factor)
            case ["faster"]:
                self.speed = _faster(self.speed)
            case ["slower"]:
                self.speed = _slower(self.speed, self.rate)
            case ["status"]:
                pass
            case _:
                raise MavherdError(f"{show(text)} is no command of the clock ({COMMANDS})")
        changed = before != (self.paused, self.speed, self._steps)
        if changed:
            self._go_on(wall)
        return changed

    def status(self) -> dict[str, Any]:
        """Return how the clock stands, as the bus has it."""
        speed = "max" if self.speed is None else self.speed
        return {"t": round(self.now, 6), "paused": self.paused, "speed": speed}

    def _go_on(self, wall: float) -> None:
        """Begin a stretch of time: at this speed from now, or standing still."""
        self._late, self._pacer = self.late, None
        self._stood, self._stands_since = self.stood(wall), None
        if self.paused and not self._steps:
            self._stands_since = wall
            self.due = inf
        elif self.speed is None:
            self.due = 0.0
        else:
            self._pacer = Pacer(self.speed, self._period, wall)
            self.due = wall


def _count(text: str = "1") -> int:
    if not (text.isascii() and text.isdigit() and 1 <= int(text[:8]) <= MAX_STEPS):
        raise MavherdError(f"step {show(text)}: expected 1..{MAX_STEPS} ticks")
    return int(text)


def _faster(speed: float | None) -> float | None:
    return None if speed is None else next((s for s in _LADDER if s > speed), None)


def _slower(speed: float | None, rate: float) -> float:
    """Return the next lower speed; from max, the next below what the machine has reached."""
    present = speed if speed is not None else rate or 1.0
    return next((s for s in reversed(_LADDER) if s < present), min(present, _LADDER[0]))
