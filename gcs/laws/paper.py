"""The paper's law, eq. 22 and 23, to compare with. UNSAFE."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, exp, hypot, sin

from .approach import COINCIDENT, HOLD_WITHIN, height_gate, whereabouts
from .base import HOLD, Command, Nominal, Peer

_AT_TARGET = 0.05  # m, where eq. 15 commands zero too
_FAR = 6.0  # m; the weight there is exp(-25)


@dataclass(frozen=True, slots=True, kw_only=True)
class Paper:
    """Add the feed-forwards of eq. 22 (rovers) or 23 (quadcopters) to the nominal target.

    UNSAFE: robots collide under it. It is here for comparison, in the most favourable reading
    of the text and with the least bad gains: k_v is negative, so that a rover brakes for what is
    ahead of it (as printed it would speed up); theta of eq. 23 is the compass bearing of the
    displacement (with the relative angle of Fig. 3 the push would depend on the direction of
    travel). Of all variants of eq. 22 that were tried, none passed head-on, crossing and parked.
    Robots of one class mind one another; a robot near one that is not heard of any more holds.
    """

    kind: str
    v_max: float
    state_timeout: float  # s
    k_f: float = 3.0  # rad/s
    k_v: float = -4.0  # rad/m
    k_r: float = 3.0  # m/s

    def __post_init__(self) -> None:
        if self.k_v == 0:
            raise ValueError("k_v must not be zero: it divides")

    def reach(self, age: float, delay: float) -> float:
        """Return from how far away a robot can matter, m."""
        return max(_FAR, HOLD_WITHIN)

    def __call__(self, me: Peer, neighbours: Sequence[Peer], nominal: Nominal) -> Command:
        """Return the target position, its velocity with the feed-forward, and the turn rate."""
        x, y, _ = whereabouts(me)
        for peer in (me, *neighbours):
            if peer.age > self.state_timeout:
                px, py, _ = peer.position
                if hypot(px - x, py - y) <= HOLD_WITHIN:
                    return HOLD
        if self.kind == "rover":
            turn = self._turn(me, neighbours, nominal)
            forward = turn / self.k_v
            push = (forward * cos(me.heading), forward * sin(me.heading), 0.0)
        else:
            turn = None
            push = self._push(me, neighbours)
        vx, vy, vz = nominal.velocity
        return Command(
            position=nominal.position,
            velocity=(vx + push[0], vy + push[1], vz),
            yaw=nominal.yaw,
            yaw_rate=turn,
            feed_forward=push,
        )

    def _turn(self, me: Peer, neighbours: Sequence[Peer], nominal: Nominal) -> float:
        """Return the feed-forward turn rate of eq. 22, zero at the target."""
        x, y, _ = whereabouts(me)
        to_x, to_y = x - nominal.position[0], y - nominal.position[1]
        distance = hypot(to_x, to_y)
        if distance < _AT_TARGET:
            return 0.0
        turn = 0.0  # not by sum(), which rounds differently from one Python to another
        for east, north, _, weight in self._displacements(me, neighbours):
            turn += self.k_f * weight * (east * to_x + north * to_y) / distance
        return turn

    def _push(self, me: Peer, neighbours: Sequence[Peer]) -> tuple[float, float, float]:
        """Return the feed-forward velocity of eq. 23, none where heights are apart."""
        east = north = 0.0
        for from_east, from_north, up, weight in self._displacements(me, neighbours):
            strength = self.k_r * weight * height_gate(up)
            east += strength * from_east
            north += strength * from_north
        return east, north, 0.0

    def _displacements(
        self, me: Peer, neighbours: Sequence[Peer]
    ) -> list[tuple[float, float, float, float]]:
        """Return, from each near neighbour: east, north (of length one), up, exp(-(d-1)^2)."""
        x, y, z = whereabouts(me)
        found = []
        for peer in neighbours:
            if peer.kind != self.kind or peer.age > self.state_timeout:
                continue
            px, py, pz = whereabouts(peer)
            distance = hypot(x - px, y - py)
            if COINCIDENT < distance < _FAR:
                weight = exp(-((distance - 1.0) ** 2))
                found.append(((x - px) / distance, (y - py) / distance, z - pz, weight))
        return found
