"""Intervals hold what they promise: checked against scipy, and by drawing."""

from math import inf
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from mavherd.gcs.sweep.intervals import LEVEL, median, wilson


@given(st.integers(1, 5000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilsons_interval_is_scipys(counted):
    hits, n = counted
    rate = wilson(hits, n)
    theirs = stats.binomtest(hits, n).proportion_ci(LEVEL, method="wilson")
    assert rate.low == pytest.approx(theirs.low, abs=1e-12)
    assert rate.high == pytest.approx(theirs.high, abs=1e-12)
    assert rate.low <= rate.rate <= rate.high


def test_a_rate_of_nothing_is_unknown():
    assert wilson(0, 0) == (0, 0, None, 0.0, 1.0)


def test_never_and_always_keep_their_end():
    assert wilson(0, 20).low == 0.0
    assert wilson(20, 20).high == 1.0


@pytest.mark.parametrize("n", [*range(1, 60), 100, 201, 1000, 99_999, 1_000_000])
def test_the_medians_interval_is_the_narrowest_pair_of_order_statistics(n):
    found = median(range(n))
    coin = stats.binom(n, 0.5)

    def holds(k):  # of the k-th smallest and the k-th greatest value
        return coin.cdf(n - k) - coin.cdf(k - 1)

    if found.low is None:
        assert n < 6
        assert holds(1) < LEVEL
        return
    k = found.low + 1
    assert found.high == n - k
    assert holds(k) >= LEVEL - 1e-9
    assert holds(k + 1) < LEVEL


def test_the_interval_holds_the_median_as_often_as_it_says():
    random = Random(1)
    draws, true = 2000, 2**0.5  # of a Pareto distribution with shape 2, far from a normal one
    hits = 0
    for _ in range(draws):
        found = median([random.paretovariate(2) for _ in range(25)])
        hits += found.low <= true <= found.high
    assert hits / draws > LEVEL - 0.01


def test_the_middle_of_an_even_number_lies_between_two():
    assert median([4.0, 1.0, 2.0, 3.0]) == (4, 2.5, None, None, 1.0, 4.0)


def test_what_never_happened_is_later_than_everything():
    mostly = median([1.0, 2.0, 3.0, 4.0, 5.0, inf, inf])
    assert (mostly.median, mostly.low, mostly.high) == (4.0, 1.0, inf)
    assert median([1.0, inf]).median == inf  # half of it never happened
    assert median([inf] * 6).low == inf


def test_nothing_measured_has_no_median():
    assert median([]) == (0, None, None, None, None, None)
