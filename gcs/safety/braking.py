"""Has a rover stand before it is put on hold or disarmed: real ones coast in both."""

from math import hypot

from ...transport.frames import Triple

STANDING = 0.1  # m/s
BRAKES_S = 3.0  # at most; one that still says it moves does not know better


class Brake:
    """Asked once a tick from when the rover is to stop; it is to be sent HOLD meanwhile."""

    def __init__(self) -> None:
        self._until: float | None = None
        self._stands = False

    def stands(self, now: float, velocity: Triple) -> bool:
        """Return whether it stands, or has had its time; once it does, it stays so."""
        self._until = now + BRAKES_S if self._until is None else self._until
        self._stands = self._stands or hypot(*velocity[:2]) < STANDING or now >= self._until
        return self._stands
