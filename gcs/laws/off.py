"""No coordination: each robot goes its own way."""

from collections.abc import Sequence
from dataclasses import dataclass

from .base import Command, Nominal, Peer


@dataclass(frozen=True, slots=True, kw_only=True)
class Off:
    """Pass the nominal target on, whoever is in the way."""

    kind: str
    v_max: float
    state_timeout: float

    def __call__(self, me: Peer, neighbours: Sequence[Peer], nominal: Nominal) -> Command:
        """Return the target position with the target's velocity as feed-forward."""
        return Command(position=nominal.position, velocity=nominal.velocity, yaw=nominal.yaw)

    def reach(self, age: float, delay: float) -> float:
        """Return 0: nobody matters."""
        return 0.0
