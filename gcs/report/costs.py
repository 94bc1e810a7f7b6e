"""What a run has cost in processor time, user and system, of its processes that have ended."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True, kw_only=True)
class Costs:
    """Processor time in s; None where nobody knows, or where there was no such process."""

    launcher: float | None = None  # from the run's beginning to its report
    vehicles: float | None = None  # with the process that forks them
    coordinators: float | None = None
    recorder: float | None = None
    by_vehicle: Mapping[str, float] = field(default_factory=dict)

    @property
    def total(self) -> float | None:
        """Return the sum of what is known."""
        each = (self.launcher, self.vehicles, self.coordinators, self.recorder)
        known = [cost for cost in each if cost is not None]
        return sum(known) if known else None


NOTHING = Costs()
"""Where nobody has counted."""
