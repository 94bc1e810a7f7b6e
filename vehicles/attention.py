"""How much of its time a vehicle spends on one link: bursts are welcome, floods are not."""

_BURST_S = 0.1  # work that may come at once: some thousand commands
_SHARE = 0.25  # of the vehicle's time that one link may take for long


class Attention:
    """The work that one link has made, in seconds; the share it may take wears it off.

    The caller owns time: `now` is any clock that does not go back.
    """

    def __init__(self, now: float) -> None:
        self._owed = 0.0
        self._at = now
        self._exhausted = False

    def spend(self, seconds: float) -> None:
        """Count the work that the link has just made."""
        self._owed += seconds

    def is_exhausted(self, now: float) -> bool:
        """Return whether the link has to wait: from a whole burst until half of it is worn off."""
        self._owed = max(0.0, self._owed - _SHARE * (now - self._at))
        self._at = now
        limit = _BURST_S / 2 if self._exhausted else _BURST_S
        self._exhausted = self._owed > limit
        return self._exhausted
