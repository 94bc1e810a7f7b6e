"""When to try again what has failed: soon, then less and less often."""

import time
from collections.abc import Callable

_FIRST_S = 0.5
_LAST_S = 5.0


class Backoff:
    """Doubles the pause after each failure, until something has worked."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._pause = _FIRST_S
        self._again_at = clock()

    def fail(self) -> None:
        """Note a failure: the next attempt is due after the pause."""
        self._again_at = self._clock() + self._pause
        self._pause = min(_LAST_S, 2 * self._pause)

    def reset(self) -> None:
        """Note that it works: the next failure is the first again."""
        self._pause = _FIRST_S

    def is_over(self) -> bool:
        """Return whether the next attempt is due."""
        return self._clock() >= self._again_at
