"""How fast simulated time may pass, and how fast it has passed of late."""

import math
import time
from collections import deque

from ...scenarios.errors import show
from ...transport.errors import MavherdError

SLOWEST, FASTEST = 0.01, 1000.0  # times real time
_LONG = 20  # characters
_MAX_LAG_S = 0.5
_WINDOW_S = 2.0  # over which "of late" reaches
_SAMPLE_S = 0.2


def read_speed(text: str) -> float | None:
    """Return the factor in `text`, None for "max"; raise MavherdError for what is neither."""
    if text == "max":
        return None
    try:
        speed = float(text)
    except ValueError:
        speed = math.nan
    if not SLOWEST <= speed <= FASTEST:
        raise MavherdError(
            f"speed {_plain(text)}: expected a factor of {SLOWEST:g}..{FASTEST:g}, or max"
        )
    return speed


def _plain(text: str) -> str:
    return text if text.isprintable() and len(text) < _LONG else show(text)


class Pacer:
    """Holds lockstep back to `speed` times real time and counts the ticks that came too late.

    `due` is when the next tick may begin, on the monotonic clock; it counts from `begun`.
    """

    def __init__(self, speed: float, period: float, begun: float | None = None) -> None:
        self._pace = period / speed
        self.due = time.monotonic() if begun is None else begun
        self.late = 0

    def count_due(self, wall: float) -> int:
        """Return how many ticks should have begun by now, one at least."""
        return max(1, int(min(wall - self.due, _MAX_LAG_S) / self._pace) + 1)

    def advance(self, wall: float) -> None:
        """Count the tick that has ended at `wall`; it is late when its successor already was."""
        self.due += self._pace
        lag = wall - self.due
        self.late += lag > self._pace
        if lag > max(self._pace, _MAX_LAG_S):  # skip rather than race to catch up
            self.due += lag

    def wait(self) -> None:
        """Count a tick that ends now, and sleep until the next is due."""
        wall = time.monotonic()
        self.advance(wall)
        if self.due > wall:
            time.sleep(self.due - wall)


class Rate:
    """How many times faster than real time a run has gone of late."""

    def __init__(self, wall: float, now: float) -> None:
        self._samples = deque([(wall, now)])

    def add(self, wall: float, now: float) -> None:
        """Take in that fleet time was `now` at `wall`."""
        samples = self._samples
        if len(samples) < 2 or wall - samples[-2][0] >= _SAMPLE_S:
            samples.append((wall, now))
        else:
            samples[-1] = wall, now
        while wall - samples[0][0] > _WINDOW_S and len(samples) > 2:
            samples.popleft()

    @property
    def value(self) -> float:
        """The factor; 0 until it has gone for a moment."""
        (since, then), (wall, now) = self._samples[0], self._samples[-1]
        return (now - then) / (wall - since) if wall > since else 0.0
