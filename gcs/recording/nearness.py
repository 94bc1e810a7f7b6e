"""How near the robots come to one another while a run goes on, by the judge's own rules.

Sampled at 20 Hz, where the judge has 100 Hz: a touch shorter than that may be seen by it alone.
"""

from collections.abc import Iterable
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...transport.frames import Triple
from ..report.contact import BODIES, CLASSES, CLEAR_M, LEVEL_M, pair_class
from ..report.truth import Floats

NEAR_M = 0.5  # between two bodies; at most LEVEL_M, see Pairs.close
_FEW = 100  # pairs that are sooner examined than sorted out


class Contact(NamedTuple):
    """Two robots touched; one event until they are clear of each other again."""

    time: float
    names: tuple[str, str]
    place: Triple  # ENU, midway


class Near(NamedTuple):
    """How near robots came at each of some times."""

    time: Floats  # (t,)
    smallest: dict[str, Floats]  # (t,) m centre to centre, by class of pair; NaN: nothing to say
    clearance: dict[str, Floats]  # (t,) m from this body to the nearest, if it may be near; or NaN
    contacts: list[Contact]  # in order of time


class Nearness:
    """Remembers who touches whom between batches. Kinds other than our two are left out."""

    def __init__(self) -> None:
        self._kinds: dict[str, str] = {}
        self._pairs: dict[str, Pairs] = {}  # by class
        self._touching: set[tuple[int, int]] = set()

    def add_robot(self, name: str, kind: str) -> None:
        """Watch one more robot."""
        if kind in BODIES:
            self._kinds[name] = kind
            self._pairs = {}  # to be made again

    def examine(self, time: Floats, names: Iterable[str], places: Floats) -> Near:
        """Return how near they came; `places` is (robots, t, 3) in order of `names`."""
        row = {name: k for k, name in enumerate(names)}
        watched = list(self._kinds)
        position = places[[row[name] for name in watched]].transpose(2, 0, 1)
        if not self._pairs:
            self._pairs = _pair_up(list(self._kinds.values()))
        gaps = np.full((len(watched), len(watched), len(time)), np.inf)
        smallest: dict[str, Floats] = {}
        for label, pairs in self._pairs.items():
            pairs = pairs.close(position)
            separation, gap = pairs.examine(position)
            smallest[label] = _finite(np.fmin.reduce(separation, axis=0, initial=np.inf))
            gaps[pairs.one, pairs.other] = gap
        nearest = np.fmin(gaps.min(axis=0, initial=np.inf), gaps.min(axis=1, initial=np.inf))
        contacts = self._contacts(gaps, time, position, watched)
        return Near(time, smallest, dict(zip(watched, _finite(nearest), strict=True)), contacts)

    def _contacts(
        self, gaps: Floats, time: Floats, position: Floats, names: list[str]
    ) -> list[Contact]:
        """Return the contacts that are not the last one of the same pair going on."""
        found: list[Contact] = []
        hits = {(int(i), int(j)) for i, j in np.argwhere((gaps < 0).any(axis=2))}
        for i, j in hits | self._touching:
            touches = (i, j) in self._touching
            for step, gap in enumerate(gaps[i, j].tolist()):
                if gap < 0 and not touches:
                    middle = (position[:, i, step] + position[:, j, step]) / 2
                    east, north, up = middle.tolist()
                    who = names[min(i, j)], names[max(i, j)]
                    found.append(Contact(float(time[step]), who, (east, north, up)))
                touches = gap < 0 or (touches and not gap >= CLEAR_M)
            (self._touching.add if touches else self._touching.discard)((i, j))
        return sorted(found)


class Pairs(NamedTuple):
    """All pairs of robots of two kinds, as rows."""

    one: NDArray[np.int_]
    other: NDArray[np.int_]
    kinds: tuple[str, str]

    def close(self, position: Floats) -> "Pairs":
        """Return those that may be the nearest of all, or near: the others need no closer look.

        Within the batch nobody gets further from where it is in the middle than it gets.
        """
        if len(self.one) < _FEW or not position.shape[2]:
            return self
        body, another = (BODIES[kind] for kind in self.kinds)
        middle = position[:, :, position.shape[2] // 2]
        roam = np.linalg.norm(position - middle[:, :, None], axis=0).max(axis=1)
        slack = roam[self.one] + roam[self.other]
        east, north, up = middle[:, self.other] - middle[:, self.one]
        if self.kinds == ("quadcopter", "quadcopter"):
            apart = np.sqrt(east * east + north * north + up * up)
            nearest = (apart + slack).min()
            possible = np.ones(len(apart), dtype=bool)
        else:
            apart = np.sqrt(east * east + north * north)
            over = np.maximum(up - another.below - body.above, -up - another.above - body.below)
            nearest = (apart + slack).min(where=over + slack < LEVEL_M, initial=np.inf)
            possible = ~(over - slack >= LEVEL_M)
        reach = max(nearest, body.radius + another.radius + NEAR_M)
        kept = np.flatnonzero(possible & ~(apart - slack > reach))
        return Pairs(self.one[kept], self.other[kept], self.kinds)

    def examine(self, position: Floats) -> tuple[Floats, Floats]:
        """Return separation and gap between the bodies (pairs, t); see `report.contact`.

        `position` is (3, robots, t). The gap is the larger of those in the plane and in height.
        """
        body, another = (BODIES[kind] for kind in self.kinds)
        east, north, up = position[:, self.other] - position[:, self.one]
        level = east * east + north * north
        over = np.maximum(up - another.below - body.above, -up - another.above - body.below)
        if self.kinds == ("quadcopter", "quadcopter"):
            separation = np.sqrt(level + up * up)
        else:
            separation = np.sqrt(level)
        gap = np.maximum(np.sqrt(level) - (body.radius + another.radius), over)
        if body is not another:
            separation = np.where(over < LEVEL_M, separation, np.inf)
        return separation, np.where(np.isnan(gap), np.inf, gap)


def _pair_up(kinds: list[str]) -> dict[str, Pairs]:
    rows = {kind: np.flatnonzero(np.array(kinds) == kind) for kind in dict.fromkeys(kinds)}
    found: dict[str, Pairs] = {}
    for one, other in combinations_with_replacement(rows, 2):
        if one == other:
            i, j = np.triu_indices(len(rows[one]), 1)
            first, second = rows[one][i], rows[one][j]
        else:
            first = np.repeat(rows[one], len(rows[other]))
            second = np.tile(rows[other], len(rows[one]))
        if len(first):
            label = pair_class(one, other)
            found[label] = Pairs(first, second, (one, other))
    return {label: found[label] for label in CLASSES if label in found}


def _finite(values: Floats) -> Floats:
    return np.where(np.isfinite(values), values, np.nan)
