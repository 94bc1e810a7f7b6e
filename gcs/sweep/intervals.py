"""95 % intervals of what a sweep counts and measures; nothing is assumed of distributions."""

from collections.abc import Sequence
from math import exp, inf, lgamma, log, sqrt
from statistics import NormalDist
from typing import NamedTuple

LEVEL = 0.95
_Z = NormalDist().inv_cdf(0.5 + LEVEL / 2)


class Rate(NamedTuple):
    """How often something happened, with Wilson's score interval."""

    hits: int
    n: int
    rate: float | None  # None: nothing was counted
    low: float
    high: float


class Median(NamedTuple):
    """The middle of what was measured, and the interval that two order statistics give it."""

    n: int
    median: float | None  # None: nothing was measured; inf: half of it never happened
    low: float | None  # None: so few values have no interval of this level
    high: float | None
    least: float | None
    greatest: float | None


def wilson(hits: int, n: int) -> Rate:
    """Return a rate with Wilson's interval, which holds near 0 and 1 and for few runs too."""
    if not n:
        return Rate(0, 0, None, 0.0, 1.0)
    z2 = _Z * _Z
    centre = (hits + z2 / 2) / (n + z2)
    half = _Z / (n + z2) * sqrt(hits * (n - hits) / n + z2 / 4)
    low = 0.0 if hits == 0 else centre - half
    high = 1.0 if hits == n else centre + half
    return Rate(hits, n, hits / n, low, high)


def median(values: Sequence[float]) -> Median:
    """Return the median with its distribution-free interval; inf stands for "never".

    The true median lies between the k-th smallest and the k-th greatest value with the probability
    that a fair coin, tossed n times, falls heads k to n - k times. The largest k with LEVEL or more
    is taken, so that the interval errs on the wide side. Fewer than six values have none.
    """
    ordered = sorted(values)
    n = len(ordered)
    if not n:
        return Median(0, None, None, None, None, None)
    below, above = ordered[(n - 1) // 2], ordered[n // 2]
    middle = inf if above == inf else (below + above) / 2
    k = _rank(n)
    low, high = (ordered[k - 1], ordered[n - k]) if k else (None, None)
    return Median(n, middle, low, high, ordered[0], ordered[-1])


def _rank(n: int) -> int:
    """Return the largest k for which k..n-k heads in n tosses have LEVEL or more; 0: there is none.

    Terms are summed from the middle outwards; about sqrt(n) of them are needed.
    """
    k = n // 2
    inside = _heads(n, k) if 2 * k == n else 2 * _heads(n, k)
    while inside < LEVEL and k > 0:
        k -= 1
        inside += 2 * _heads(n, k)
    return k


def _heads(n: int, k: int) -> float:
    """Return the probability of k heads in n tosses."""
    return exp(lgamma(n + 1) - lgamma(k + 1) - lgamma(n - k + 1) - n * log(2))
