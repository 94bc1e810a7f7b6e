"""Allocation is the inverse of eq. 20, and what cannot be had is given up in a stated order."""

from math import isclose
from random import Random

import pytest

from mavherd.vehicles.mixer import RotorThrusts, Wrench, allocate, clip, wrench_of

ARM, RATIO, MOST = 0.2, 0.016, 6.0
HOVER = 11.8


def mixed(wrench: Wrench) -> tuple[RotorThrusts, Wrench]:
    thrusts = allocate(wrench, ARM, RATIO, MOST)
    return thrusts, wrench_of(thrusts, ARM, RATIO)


@pytest.mark.parametrize("mix", [allocate, clip])
def test_mixer_times_allocation_is_identity(mix):
    draw = Random(1).uniform
    for _ in range(200):
        asked = (draw(9, 15), draw(-0.3, 0.3), draw(-0.3, 0.3), draw(-0.03, 0.03))
        got = wrench_of(mix(asked, ARM, RATIO, MOST), ARM, RATIO)
        assert got == pytest.approx(asked, abs=1e-12)


def test_allocation_times_mixer_is_identity():
    thrusts = (3.1, 2.4, 2.9, 3.3)
    assert allocate(wrench_of(thrusts, ARM, RATIO), ARM, RATIO, MOST) == pytest.approx(thrusts)


def test_signs_are_those_of_a_plus_frame():
    front, right, rear, left = allocate((HOVER, 0.0, 0.1, 0.0), ARM, RATIO, MOST)
    assert front > right == left > rear  # nose up
    front, right, rear, left = allocate((HOVER, 0.1, 0.0, 0.0), ARM, RATIO, MOST)
    assert left > front == rear > right  # right side down
    front, right, rear, left = allocate((HOVER, 0.0, 0.0, 0.01), ARM, RATIO, MOST)
    assert front == rear < right == left  # the counter-clockwise pair turns the nose right


def test_every_thrust_is_possible_whatever_is_asked():
    draw = Random(2).uniform
    for _ in range(2000):
        asked = (draw(-20, 60), draw(-3, 3), draw(-3, 3), draw(-1, 1))
        thrusts, _ = mixed(asked)
        assert all(0 <= f <= MOST + 1e-12 for f in thrusts)
        assert all(0 <= f <= MOST for f in clip(asked, ARM, RATIO, MOST))


def test_yaw_is_given_up_first():
    _, (*others, yaw) = mixed((HOVER, 0.5, -0.4, 5.0))
    assert others == pytest.approx((HOVER, 0.5, -0.4))
    assert 0 < yaw < 5.0


def test_thrust_is_given_up_before_roll_and_pitch():
    for thrust in (0.0, 4 * MOST):
        _, got = mixed((thrust, 0.7, -0.4, 0.0))
        assert got[1:] == pytest.approx((0.7, -0.4, 0.0))
        assert isclose(abs(got[0] - thrust), 4 * 0.7 / (2 * ARM))


def test_yaw_never_costs_thrust_at_the_limit():
    _, got = mixed((4 * MOST, 0.0, 0.0, 0.1))
    assert got == pytest.approx((4 * MOST, 0.0, 0.0, 0.0), abs=1e-12)


def test_roll_and_pitch_beyond_reach_keep_their_direction():
    _, (_, roll, pitch, _) = mixed((HOVER, 6.0, 3.0, 0.0))
    assert isclose(roll / pitch, 2.0)
    assert isclose(roll, MOST * ARM)
