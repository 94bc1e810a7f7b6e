"""The filter gives the nearest velocity that closes in on nobody too fast; heights fade."""

from itertools import combinations, pairwise
from math import cos, dist, hypot, pi, sin

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import minimize

from mavherd.gcs.laws import Peer
from mavherd.gcs.laws.approach import (
    MIXED_HEIGHTS,
    QUAD_HEIGHTS,
    Approach,
    height_gate,
    nearest_permitted,
    saturate,
)

APPROACH = Approach(
    v_max=1.0,
    state_timeout=1.0,
    r_rover=0.4,
    r_quad=0.2,
    c0=0.08,
    kappa_rover=2.0,
    kappa_quad=1.0,
)

directions = st.integers(0, 359).map(lambda i: (cos(pi * i / 180), sin(pi * i / 180)))
velocities = st.tuples(*[st.integers(-200, 200).map(lambda i: i / 100)] * 2)


def planes_with(bounds):
    return st.lists(
        st.builds(lambda e, b: (*e, b / 100), directions, bounds), min_size=1, max_size=8
    )


def excess(v, planes):
    return max(v[0] * east + v[1] * north - bound for east, north, bound in planes)


def candidates(wish, planes):
    """Where the nearest point can be: the wish, its foot on each edge, each crossing of two."""
    yield wish
    for east, north, bound in planes:
        over = wish[0] * east + wish[1] * north - bound
        yield wish[0] - over * east, wish[1] - over * north
    for (p_east, p_north, p_bound), (q_east, q_north, q_bound) in combinations(planes, 2):
        det = p_east * q_north - p_north * q_east
        if abs(det) > 1e-6:
            yield (
                (p_bound * q_north - q_bound * p_north) / det,
                (p_east * q_bound - q_east * p_bound) / det,
            )


@given(velocities, planes_with(st.integers(-100, 200)))
def test_the_nearest_permitted_velocity_is_the_best_of_all_candidates(wish, planes):
    got = nearest_permitted(wish, planes)
    if got is None:
        assert all(excess(c, planes) > -1e-9 for c in candidates(wish, planes))
    else:
        assert excess(got, planes) < 1e-8
        best = min(dist(c, wish) for c in candidates(wish, planes) if excess(c, planes) < 1e-9)
        assert dist(got, wish) == pytest.approx(best, abs=1e-6)


@given(velocities, planes_with(st.integers(0, 100)), st.randoms())
def test_the_order_of_the_neighbours_does_not_matter(wish, planes, random):
    shuffled = random.sample(planes, len(planes))
    assert nearest_permitted(wish, planes) == pytest.approx(
        nearest_permitted(wish, shuffled), abs=1e-6
    )


@pytest.mark.parametrize("turn", [0.0, 0.4, 1.3, 2.9])
def test_a_general_solver_finds_the_same_point(turn):
    planes = [
        (cos(a + turn), sin(a + turn), b)
        for a, b in ((0.0, 0.3), (0.9, 0.1), (-0.7, 0.2), (2.0, 0.05))
    ]
    wish = (cos(turn + 0.3), sin(turn + 0.3))
    solved = minimize(
        lambda v: (v[0] - wish[0]) ** 2 + (v[1] - wish[1]) ** 2,
        (0.0, 0.0),
        constraints=[
            {"type": "ineq", "fun": lambda v, p=p: p[2] - v[0] * p[0] - v[1] * p[1]} for p in planes
        ],
    )
    assert nearest_permitted(wish, planes) == pytest.approx(tuple(solved.x), abs=1e-4)


@given(velocities, planes_with(st.integers(-100, 200)))
def test_a_permitted_wish_is_granted_unchanged(wish, planes):
    assume(excess(wish, planes) <= 0)
    assert nearest_permitted(wish, planes) == wish


def test_half_planes_that_share_nothing_have_no_nearest_point():
    assert nearest_permitted((0.0, 0.0), [(1.0, 0.0, -0.1), (-1.0, 0.0, -0.1)]) is None


pairs = st.builds(
    lambda e, c, g, k: (*e, c / 100, g / 20, k / 10),
    directions,
    st.integers(-60, 300),
    st.integers(1, 20),
    st.integers(5, 20),
)


@given(velocities, st.lists(pairs, max_size=8))
def test_the_filter_never_exceeds_the_maximum_speed(wish, pairs):
    assert hypot(*APPROACH.filter(wish, pairs)) <= APPROACH.v_max + 1e-12


@given(velocities, st.lists(pairs, min_size=1, max_size=8))
def test_without_overlap_nobody_is_closed_in_on_faster_than_half_of_the_barrier_permits(
    wish, pairs
):
    pairs = [(e, n, max(clear, APPROACH.c0), 1.0, kappa) for e, n, clear, _, kappa in pairs]
    v = APPROACH.filter(wish, pairs)
    for east, north, clearance, _, kappa in pairs:
        closing = v[0] * east + v[1] * north
        assert closing <= kappa / 2 * (clearance - APPROACH.c0) + 1e-8


@given(velocities, directions, st.integers(-60, 7))
def test_too_near_a_single_neighbour_it_backs_away(wish, towards, clearance):
    v = APPROACH.filter(wish, [(*towards, clearance / 100, 1.0, 2.0)])
    assert v[0] * towards[0] + v[1] * towards[1] < 0


def test_where_nothing_is_permitted_it_backs_away_from_the_deepest():
    v = APPROACH.filter((0.0, 0.0), [(1.0, 0.0, -0.1, 1.0, 2.0), (-1.0, 0.0, -0.3, 1.0, 2.0)])
    assert v == pytest.approx((0.3 + APPROACH.c0, 0.0))


@given(velocities, directions, st.integers(-60, 100))
def test_what_counts_less_for_its_height_restricts_less(wish, towards, clearance):
    wish = saturate(wish, APPROACH.v_max)
    changes = [
        dist(APPROACH.filter(wish, [(*towards, clearance / 100, gate, 2.0)]), wish)
        for gate in (1e-9, 0.2, 0.5, 0.9, 1.0)
    ]
    assert all(less <= more + 1e-12 for less, more in pairwise(changes))
    assert changes[0] < 1e-12


@pytest.mark.parametrize("heights", [QUAD_HEIGHTS, MIXED_HEIGHTS])
def test_the_height_gate_falls_from_one_to_zero_without_a_step(heights):
    full, none = heights
    gates = [height_gate(i / 1000, heights) for i in range(3000)]
    assert gates == sorted(gates, reverse=True)
    assert height_gate(full, heights) == 1
    assert height_gate(none, heights) == 0
    steepest = 1.5 / (none - full)  # of a smoothstep
    assert max(a - b for a, b in pairwise(gates)) <= steepest * 1.001e-3
    assert height_gate(-0.8, heights) == height_gate(0.8, heights)


def peer(kind, east=0.0, up=0.0, **more):
    return Peer(2, kind, (east, 0.0, up), (0.0, 0.0, 0.0), 0.0, **more)


@pytest.mark.parametrize("mine", ["rover", "quadcopter"])
@pytest.mark.parametrize("theirs", ["rover", "quadcopter"])
def test_two_that_see_each_other_agree_on_the_pair(mine, theirs):
    a, b = peer(mine, 0.0)._replace(system_id=1), peer(theirs, 1.5)
    (ab,), (ba,) = APPROACH.pairs(a, [b]), APPROACH.pairs(b, [a])
    assert ab[:2] == (-ba[0], -ba[1]) == (1.0, 0.0)
    assert ab[2:] == pytest.approx(ba[2:])
    here = b._replace(position=a.position)
    (ab,), (ba,) = APPROACH.pairs(a, [here]), APPROACH.pairs(here, [a])
    assert ab[:2] == (-ba[0], -ba[1])


@pytest.mark.parametrize(
    ("a", "b", "counts"),
    [
        (peer("rover"), peer("quadcopter", 1.0, 1.4), 1.0),
        (peer("rover"), peer("quadcopter", 1.0, 2.0), None),
        (peer("rover"), peer("quadcopter", 1.0, 9.0, vertical=True), 1.0),
        (peer("quadcopter"), peer("quadcopter", 1.0, 0.5), 1.0),
        (peer("quadcopter"), peer("quadcopter", 1.0, 1.1), None),
        (peer("quadcopter"), peer("quadcopter", 1.0, 9.0, vertical=True), 1.0),
    ],
)
def test_height_decides_who_counts_the_same_on_both_sides(a, b, counts):
    for me, other in ((a, b), (b, a)):
        gates = [gate for _, _, _, gate, _ in APPROACH.pairs(me, [other])]
        assert gates == ([] if counts is None else [counts])


def test_a_pair_too_far_to_matter_is_left_out_and_could_not_have_mattered():
    limit = APPROACH.felt_to(APPROACH.kappa_rover)
    reach = limit + 2 * APPROACH.r_rover
    assert APPROACH.pairs(peer("rover"), [peer("rover", reach - 0.01)])
    assert not APPROACH.pairs(peer("rover"), [peer("rover", reach + 0.01)])
    assert APPROACH.filter((1.0, 0.0), [(1.0, 0.0, limit, 1.0, APPROACH.kappa_rover)]) == (1, 0)
