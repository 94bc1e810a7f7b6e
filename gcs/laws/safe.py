"""The default law: pass each other on the right, brake each other's approach."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import exp, hypot

from .approach import Approach, Pair, Planar, saturate, whereabouts
from .base import HOLD, Command, Nominal, Peer

CLIMB, SINK = 1.0, 0.7  # m/s, limits of the vertical velocity
_AT_TARGET = 0.05  # m, where eq. 15 commands zero too
_SLOW = 0.3  # of v_max: below, there is less and less of a "front"
_FELT_RANGES = 3.0  # the push is exp(-9) of itself at three ranges: nothing


@dataclass(frozen=True, slots=True, kw_only=True)
class Safe:
    """Go to the target, pushed away from and round those near, never closing in too fast.

    The idea of eq. 22-23 with what they lack to be safe, at velocity level, planar:

    u = sat(k (target - q) + target velocity, s v_max), with a slightly different s for every
    system id, so that no scene is exactly symmetric; for each near neighbour a push
    K [k_r 0.6 (0.3 + 0.7 front) n + k_t front t], n away from it, t to the right of it,
    K = exp(-(clearance/range)^2), front how much it is ahead; then the approach-speed filter.
    The command is a velocity, since a position term added on board would undo the filter.
    Rovers and quadcopters count for one another where the quadcopter is low or taking off or
    landing; both filter, because each side only takes its half.

    The pushes also act at the target: a rover whose target is within 1.5 m of where another robot
    stands (a quadcopter: 1.1 m) stops more than 0.2 m short, and one whose target is taken
    keeps circling it.
    """

    kind: str
    v_max: float  # m/s
    state_timeout: float  # s
    k_rover: float = 1.5  # 1/s, position error to velocity
    k_quad: float = 1.0
    k_up: float = 1.0  # 1/s, height error to vertical velocity
    k_r: float = 1.0  # m/s, push away
    k_t: float = 1.0  # m/s, push to the right
    range_m: float = 0.8  # clearance at which the pushes have fallen to 1/e
    c0: float = 0.08  # m, clearance that the filter keeps
    kappa_rover: float = 2.0  # 1/s; kappa times velocity lag (0.28 s) should stay below 0.6
    kappa_quad: float = 1.0  # 1/s; lag 0.45 s
    r_rover: float = 0.425  # m, contact circle 0.395 + 0.03
    r_quad: float = 0.25  # m, contact circle 0.2 + 0.05
    _approach: Approach = field(init=False)

    def __post_init__(self) -> None:
        for name in ("k_rover", "k_quad", "k_up", "range_m"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")
        for name in ("k_r", "k_t"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} must not be negative, got {getattr(self, name)}")
        approach = Approach(
            v_max=self.v_max,
            state_timeout=self.state_timeout,
            r_rover=self.r_rover,
            r_quad=self.r_quad,
            c0=self.c0,
            kappa_rover=self.kappa_rover,
            kappa_quad=self.kappa_quad,
            feel=_FELT_RANGES * self.range_m,
        )
        object.__setattr__(self, "_approach", approach)

    def reach(self, age: float, delay: float) -> float:
        """Return from how far away a robot can matter, m."""
        return self._approach.reach(age, delay)

    def __call__(self, me: Peer, neighbours: Sequence[Peer], nominal: Nominal) -> Command:
        """Return a velocity (with the nominal yaw for a quadcopter), or hold."""
        approach, v_max = self._approach, self.v_max
        pairs = approach.pairs(me, neighbours)
        if pairs is None:
            return HOLD
        x, y, z = whereabouts(me)
        (x_d, y_d, z_d), (vx_d, vy_d, vz_d), yaw = nominal
        rover = self.kind == "rover"
        k = self.k_rover if rover else self.k_quad
        to_x, to_y = x_d - x, y_d - y
        if rover and vx_d == vy_d == 0.0 and hypot(to_x, to_y) < _AT_TARGET:
            to_x = to_y = 0.0  # it would turn about for every centimetre
        u = saturate((k * to_x + vx_d, k * to_y + vy_d), own_pace(me.system_id) * v_max)
        east, north = approach.filter(self._pushed(u, pairs), pairs) if pairs else u
        up = 0.0 if rover else min(CLIMB, max(-SINK, self.k_up * (z_d - z) + vz_d))
        pushed = (east - u[0], north - u[1], 0.0)
        return Command(None, (east, north, up), None, None if rover else yaw, None, pushed)

    def _pushed(self, u: Planar, pairs: Sequence[Pair]) -> Planar:
        """Return `u` with the pushes of all pairs, at most v_max."""
        x, y = u
        speed = hypot(x, y)
        ahead_x, ahead_y = (x / speed, y / speed) if speed > 0.0 else (0.0, 0.0)
        haste = min(1.0, speed / (_SLOW * self.v_max))
        away, aside, range_m = self.k_r, self.k_t, self.range_m
        for east, north, clearance, gate, _ in pairs:
            c = (0.0 if clearance < 0.0 else clearance) / range_m
            push = exp(-c * c) * gate
            ahead = east * ahead_x + north * ahead_y
            front = haste if ahead >= 1.0 else ahead * haste if ahead > 0.0 else 0.0
            off = push * away * 0.6 * (0.3 + 0.7 * front)
            right = push * aside * front
            x += right * north - off * east
            y += -right * east - off * north
        return saturate((x, y), self.v_max)


def own_pace(system_id: int) -> float:
    """Return this robot's part of the maximum speed, 0.9 to 1, spread evenly over the ids."""
    return 0.9 + 0.1 * (0.618 * system_id % 1.0)
