"""A vehicle's own clock on the time line of a recording, without a word from the vehicle.

What a vehicle tells is dated by its own clock, which no radio and no full buffer disturbs. When
that clock began is taken from the message that was on its way for the shortest time.
"""

from math import inf

_REBOOT_S = 1.0  # a clock that goes back further has begun anew; messages may overtake others
_LATE_S = 2.0  # behind its messages' arrival: the clock has stood still (a paused simulator)
_DRIFT = 5e-4  # of cheap quartz, generously


class VehicleClock:
    """Dates what a vehicle tells; `reboots` counts how often its clock has begun anew."""

    def __init__(self) -> None:
        self.reboots = 0
        self._offset = inf  # arrival less boot time, of the quickest message
        self._newest_boot = -inf
        self._arrival = -inf  # of the newest message

    def hear(self, boot_s: float, arrival: float) -> float:
        """Return the moment of a message that says `boot_s` and arrives at `arrival`."""
        if boot_s < self._newest_boot - _REBOOT_S:
            self.reboots += 1
            self._newest_boot, self._offset = boot_s, inf
        self._newest_boot = max(self._newest_boot, boot_s)
        if self._arrival > -inf:
            self._offset += _DRIFT * max(0.0, arrival - self._arrival)
        self._arrival = arrival
        self._offset = min(self._offset, arrival - boot_s)
        if arrival - (self._newest_boot + self._offset) > _LATE_S:
            self._offset = arrival - self._newest_boot
        return min(boot_s + self._offset, arrival)
