"""The disturbance is uniform, unbiased, bounded, seeded, and of the form asked for."""

from itertools import pairwise
from math import isclose
from statistics import fmean, pvariance

import pytest

from mavherd.vehicles.config import Disturbance
from mavherd.vehicles.disturbance import BodyForce

DT = 0.002


def draw(form="white", count=20_000, seed=1, system_id=1, hold_s=0.1):
    force = BodyForce(Disturbance(form=form, amplitude=0.4, hold_s=hold_s), seed, system_id, DT)
    return [force.next() for _ in range(count)]


def test_off_is_no_force():
    assert draw("off", 3) == [None] * 3


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_white_force_has_the_moments_of_a_uniform_one(axis):
    values = [force[axis] for force in draw("white")]
    assert max(map(abs, values)) <= 0.4
    assert abs(fmean(values)) < 4 * 0.4 / (3 * len(values)) ** 0.5
    assert isclose(pvariance(values), 0.4**2 / 3, rel_tol=0.05)
    neighbours = fmean(a * b for a, b in pairwise(values))
    assert abs(neighbours) < 0.05 * 0.4**2 / 3


def test_axes_are_independent():
    forces = draw("white")
    assert abs(fmean(x * y for x, y, _ in forces)) < 0.05 * 0.4**2 / 3


def test_held_force_changes_every_hold_time_only():
    forces = draw("held", 500)
    changes = [i for i, (a, b) in enumerate(pairwise(forces), 1) if a != b]
    assert changes == list(range(50, 500, 50))


def test_constant_force_never_changes():
    assert len(set(draw("constant", 1000))) == 1


@pytest.mark.parametrize("form", ["held", "white", "constant"])
def test_the_same_seed_and_vehicle_draw_the_same_force(form):
    assert draw(form, 100) == draw(form, 100)
    assert draw(form, 100) != draw(form, 100, seed=2)
    assert draw(form, 100) != draw(form, 100, system_id=2)


def test_seed_and_system_id_do_not_run_together():
    assert draw(count=1, seed=1, system_id=11) != draw(count=1, seed=11, system_id=1)
