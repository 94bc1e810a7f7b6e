"""How fast robots may close in on one another: the near pairs and the approach-speed filter.

For two circles with clearance c, each side keeps its velocity towards the other at or below
(kappa/2)(c - c0). The two halves add up to dc/dt >= -kappa (c - c0), so c never falls below c0
where velocities are tracked without lag: a control barrier function, shared by two. Lag is what
bounds kappa (kappa x lag <= 0.6) and what c0 is kept for. States that are old and commands that
come late are lag, too: kappa falls with them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import hypot, inf

from .base import Peer

Planar = tuple[float, float]  # east, north

HOLD_WITHIN = 3.0  # m, horizontally, of a robot that is not heard of any more
_BINDING = 1.1  # v_max: a bound beyond cannot matter

# Height differences (m) up to which a pair counts in full, and from which on not at all.
QUAD_HEIGHTS = (0.6, 1.0)
MIXED_HEIGHTS = (1.5, 1.9)  # a rover is 0.9 m tall
COINCIDENT = 1e-9  # m
KAPPA_LAG = 0.6  # what kappa times lag may be
_PARALLEL = 1e-9
_ROUNDING = 1e-9  # m/s


Pair = tuple[float, float, float, float, float]
"""A near neighbour as seen from oneself.

East and north of the unit vector to it; the clearance between the two circles (m); how much its
height makes it count, above 0 up to 1; kappa (1/s).
"""

HalfPlane = tuple[float, float, float]
"""The velocities whose component along (east, north), of length one, is at most the third (m/s)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Approach:
    """The filter's settings for a robot of up to `v_max`, and the filter itself."""

    v_max: float  # m/s
    state_timeout: float  # s
    r_rover: float  # m, radius of a rover with its margin
    r_quad: float
    c0: float  # m, clearance that is kept
    kappa_rover: float  # 1/s
    kappa_quad: float
    feel: float = 0.0  # m, clearance up to which the caller wants to know of a neighbour
    _far: float = field(init=False)  # m, centre to centre: no pair matters beyond
    _kappa_mixed: float = field(init=False)  # 1/s, of a rover and a quadcopter
    _felt: tuple[float, float, float] = field(init=False)  # m, without lag: rover, quad, mixed
    _near: float = field(init=False)  # m, as _far, while nothing lags

    def __post_init__(self) -> None:
        for name in ("v_max", "state_timeout", "r_rover", "r_quad", "kappa_rover", "kappa_quad"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")
        if self.c0 < 0:
            raise ValueError(f"c0 must not be negative, got {self.c0}")
        # Both must brake at a rate that the slower to react can follow.
        mixed = min(self.kappa_rover, self.kappa_quad)
        rover, quad = self.felt_to(self.kappa_rover), self.felt_to(self.kappa_quad)
        object.__setattr__(self, "_kappa_mixed", mixed)
        object.__setattr__(self, "_felt", (rover, quad, max(rover, quad)))
        object.__setattr__(self, "_near", self._reach(0.0))
        object.__setattr__(self, "_far", self._reach(2 * self.state_timeout))

    def felt_to(self, kappa: float) -> float:
        """Return the clearance beyond which a neighbour does not matter."""
        return max(self.feel, 2 * _BINDING * self.v_max / kappa + self.c0)

    def reach(self, age: float, delay: float) -> float:
        """Return from how far away a robot can matter, centre to centre; see `reach_of`."""
        if age <= 0.0 and delay <= 0.0:
            return self._near
        timeout = self.state_timeout
        return self._reach(min(age, timeout) + min(max(delay, 0.0), timeout))

    def _reach(self, late: float) -> float:
        widest = self.felt_to(slowed(self._kappa_mixed, late))
        return max(HOLD_WITHIN, widest + 2 * max(self.r_rover, self.r_quad))

    def pairs(self, me: Peer, neighbours: Sequence[Peer]) -> list[Pair] | None:
        """Return the neighbours that matter, where they are by now.

        None says: hold, for a robot that was near (or oneself) is not heard of any more.
        """
        timeout, far = self.state_timeout, self._far
        my_id, my_kind, (x, y, z), (v_x, v_y, v_z), _, my_age, my_vertical, delay = me
        if my_age > timeout:
            return None
        x, y, z = x + v_x * my_age, y + v_y * my_age, z + v_z * my_age
        own_lag = min(delay, timeout) if delay > 0.0 else 0.0
        rover = my_kind == "rover"
        my_radius = self.r_rover if rover else self.r_quad
        my_kappa = self.kappa_rover if rover else self.kappa_quad
        my_felt = self._felt[0] if rover else self._felt[1]
        found: list[Pair] = []
        for system_id, kind, (px, py, pz), (vx, vy, vz), _, age, vertical, _ in neighbours:
            if age > timeout:
                if hypot(px - x, py - y) <= HOLD_WITHIN:
                    return None
                continue
            dx = px + vx * age - x
            if not -far < dx < far:
                continue
            dy = py + vy * age - y
            if not -far < dy < far:
                continue
            peer_rover = kind == "rover"
            gate = 1.0
            if not ((rover and peer_rover) or vertical or my_vertical):
                heights = QUAD_HEIGHTS if rover == peer_rover else MIXED_HEIGHTS
                difference = abs(pz + vz * age - z)
                if difference >= heights[1]:
                    continue
                gate = height_gate(difference, heights)
            kappa, felt = my_kappa, my_felt
            if rover != peer_rover:
                kappa, felt = self._kappa_mixed, self._felt[2]
            lag = (my_age if my_age > age else age) + own_lag
            if lag != 0.0:
                kappa = slowed(kappa, lag)
                felt = self.felt_to(kappa)
            distance = hypot(dx, dy)
            clearance = distance - my_radius - (self.r_rover if peer_rover else self.r_quad)
            if clearance > felt:
                continue
            if distance > COINCIDENT:
                east, north = dx / distance, dy / distance
            else:  # in one point: part along east, by number, so that both agree
                east, north = (1.0 if my_id < system_id else -1.0), 0.0
            found.append((east, north, clearance, gate, kappa))
        return found

    def filter(self, wish: Planar, pairs: Sequence[Pair]) -> Planar:
        """Return the velocity nearest to `wish` that closes in on nobody too fast.

        Where there is none (only when some clearance is below c0 already): back away from the
        deepest. A pair that counts less for its height has its bound raised by v_max (1-g)/g;
        scaling the bound would be wrong where it is negative.
        """
        v_max, c0 = self.v_max, self.c0
        most = _BINDING * v_max
        planes: list[HalfPlane] = []
        for east, north, clearance, gate, kappa in pairs:
            bound = 0.5 * kappa * (clearance - c0)
            if gate < 1.0:
                bound += v_max * (1.0 - gate) / gate
            if bound < most:
                planes.append((east, north, bound))
        nearest = nearest_permitted(saturate(wish, v_max), planes)
        if nearest is None:
            east, north, bound = min(planes, key=lambda plane: plane[2])
            bound = min(bound, 0.0)
            nearest = (bound * east, bound * north)
        return saturate(nearest, v_max)


def slowed(kappa: float, late: float) -> float:
    """Return the rate that keeps kappa x lag where it was with `late` seconds more lag."""
    return kappa / (1.0 + kappa * late / KAPPA_LAG)


def nearest_permitted(wish: Planar, planes: Sequence[HalfPlane]) -> Planar | None:
    """Return the point of all half planes that is nearest to `wish`; None if they share none.

    Exact: where the nearest point of the planes so far lies outside the next one, the new one is
    on that one's edge, at the foot of `wish` or at a crossing with an earlier edge.
    """
    wish_x, wish_y = x, y = wish
    for i, (east, north, bound) in enumerate(planes):
        if x * east + y * north <= bound:
            continue
        excess = wish_x * east + wish_y * north - bound
        foot_x, foot_y = wish_x - excess * east, wish_y - excess * north
        low, high = -inf, inf  # along the edge, from the foot, in direction (-north, east)
        for other_east, other_north, other_bound in planes[:i]:
            slope = other_north * east - other_east * north
            room = other_bound - (foot_x * other_east + foot_y * other_north)
            if slope > _PARALLEL:
                high = min(high, room / slope)
            elif slope < -_PARALLEL:
                low = max(low, room / slope)
            elif room < -_ROUNDING:
                return None
        if low > high + _ROUNDING:
            return None
        along = min(max(0.0, low), high)
        x, y = foot_x - along * north, foot_y + along * east
    return x, y


def height_gate(difference: float, heights: Planar = QUAD_HEIGHTS) -> float:
    """Return 1 for heights that are close, 0 for heights far apart, a smooth step between."""
    full, none = heights
    s = (none - abs(difference)) / (none - full)
    if s <= 0.0:
        return 0.0
    return 1.0 if s >= 1.0 else s * s * (3.0 - 2.0 * s)


def whereabouts(peer: Peer) -> tuple[float, float, float]:
    """Return where `peer` is by now if it kept its velocity."""
    x, y, z = peer.position
    vx, vy, vz = peer.velocity
    age = peer.age
    return x + vx * age, y + vy * age, z + vz * age


def saturate(v: Planar, limit: float) -> Planar:
    """Return `v`, shortened to `limit` where it is longer."""
    length = hypot(v[0], v[1])
    if length <= limit:
        return v
    scale = limit / length
    return v[0] * scale, v[1] * scale
