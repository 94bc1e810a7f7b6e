"""An external vehicle's frame counts once it is verified, and is watched from then on."""

from math import hypot

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.gcs.station.alignment import FARTHEST_M, TOLERANCE_M, Alignment
from mavherd.transport.frames import Origin

FLEET = Origin()
STILL = (0.0, 0.0, 0.0)
metres = st.floats(-300, 300)


def origin_at(north, east, up=0.0):
    lat_deg, lon_deg = FLEET.to_geodetic(north, east)
    return Origin(lat_deg, lon_deg, FLEET.alt_m + up)


def told(north=30.0, east=-40.0, local=(5.0, 6.0, 7.0), off=0.0):
    """An alignment that has heard it all; its two positions are `off` metres apart."""
    alignment = Alignment(FLEET)
    alignment.hear_origin(origin_at(north, east), armed=False)
    hear(alignment, local, 1.0, north, east, off=off)
    return alignment


def hear(alignment, local, now, north=30.0, east=-40.0, *, off=0.0, armed=False):
    alignment.hear_local(local, STILL, now, stands=not armed)
    place = FLEET.to_geodetic(north + local[0] + off, east + local[1])
    alignment.hear_global(*place, now, armed=armed)


@given(metres, metres, metres, metres, metres)
def test_a_place_goes_to_the_fleets_frame_and_back(north, east, x, y, z):
    alignment = told(north, east, (x, y, z))
    assert alignment.aligned
    assert alignment.to_fleet((x, y, z)) == pytest.approx((north + x, east + y, 0), abs=1e-6)
    place = (1.0, 2.0, -3.0)
    assert alignment.to_fleet(alignment.to_local(place)) == pytest.approx(place, abs=1e-9)


def test_it_says_what_is_still_missing():
    alignment = Alignment(FLEET)
    assert "no local position" in alignment.waits_for
    alignment.hear_local(STILL, STILL, 1.0, stands=True)
    assert "GPS_GLOBAL_ORIGIN" in alignment.waits_for
    alignment.hear_origin(origin_at(1, 2), armed=False)
    alignment.hear_local(STILL, STILL, 1.0, stands=True)
    assert "not verified" in alignment.waits_for
    alignment.hear_global(*FLEET.to_geodetic(1, 2), 1.1, armed=False)
    assert alignment.aligned


def test_two_positions_that_disagree_do_not_count():
    assert told(off=TOLERANCE_M - 0.5).aligned
    wrong = told(off=TOLERANCE_M + 1)
    assert not wrong.aligned
    assert "4.0 m apart" in wrong.waits_for
    assert wrong.problem == ""  # its estimator may be settling
    hear(wrong, (5.0, 6.0, 7.0), 2.0)
    assert wrong.aligned


def test_a_place_far_from_its_origin_may_be_off_by_another_figure_of_the_earth():
    assert told(local=(1000.0, 0.0, 0.0), off=5.0).aligned
    assert not told(local=(10.0, 0.0, 0.0), off=5.0).aligned


def test_an_origin_far_away_is_a_problem_that_names_both_and_the_cure():
    alignment = Alignment(FLEET)
    alignment.hear_origin(Origin(-35.36326, 149.16524, 584), armed=False)
    for part in ("-35.36326, 149.16524", "47.39770, 8.54560", "--home 47.39", "`origin:`", " km"):
        assert part in alignment.problem
    near = Alignment(FLEET)
    near.hear_origin(origin_at(FARTHEST_M * 0.7, FARTHEST_M * 0.7), armed=False)
    assert near.problem == ""


def test_another_origin_is_taken_over_while_it_stands():
    alignment = told()
    alignment.hear_origin(origin_at(-10, 0), armed=False)
    assert not alignment.aligned
    hear(alignment, (1.0, 1.0, 0.0), 2.0, -10, 0)
    assert alignment.aligned
    assert alignment.to_fleet((1.0, 1.0, 0.0))[:2] == pytest.approx((-9, 1), abs=1e-6)


def test_another_origin_is_a_problem_while_it_is_armed():
    alignment = told()
    alignment.hear_origin(origin_at(33, -36), armed=True)
    assert "moved by 5.0 m" in alignment.problem
    assert alignment.to_fleet((0.0, 0.0, 7.0)) == pytest.approx((30, -40, 0), abs=1e-6)


def test_another_altitude_of_its_origin_changes_no_height():
    alignment = told()
    alignment.hear_origin(origin_at(30, -40, up=2.0), armed=True)  # its down grows by 2
    assert alignment.problem == ""
    assert alignment.to_fleet((0.0, 0.0, 9.0))[2] == pytest.approx(0)


def test_positions_that_part_while_armed_are_a_problem_after_a_while():
    alignment = told()
    for now in (2.0, 2.5):
        hear(alignment, (5.0, 6.0, 7.0), now, off=8.0, armed=True)
        assert alignment.problem == ""
    hear(alignment, (5.0, 6.0, 7.0), 3.0, off=8.0, armed=True)
    assert "8.0 m apart" in alignment.problem


def test_the_ground_is_where_it_stands_and_stays_when_it_flies():
    alignment = told()
    for tick in range(100):
        alignment.hear_local((0.0, 0.0, 7.2), STILL, 1 + tick * 0.05, stands=True)
    assert alignment.to_fleet((0.0, 0.0, 7.2))[2] == pytest.approx(0, abs=0.01)
    alignment.hear_local((0.0, 0.0, 3.0), STILL, 7.0, stands=False)
    assert alignment.to_fleet((0.0, 0.0, 3.0))[2] == pytest.approx(-4.2, abs=0.01)


def test_a_jump_of_height_on_the_ground_is_another_estimator():
    alignment = told()
    alignment.hear_local((0.0, 0.0, -481.0), STILL, 1.05, stands=True)
    assert alignment.to_fleet((0.0, 0.0, -481.0))[2] == 0


def test_one_first_heard_of_in_the_air_needs_its_home():
    alignment = Alignment(FLEET)
    alignment.hear_origin(origin_at(0, 0), armed=True)
    hear(alignment, (0.0, 0.0, -2.0), 1.0, 0, 0, armed=True)
    assert "HOME_POSITION" in alignment.waits_for
    alignment.hear_home(3.0)
    hear(alignment, (0.0, 0.0, -2.0), 1.5, 0, 0, armed=True)
    assert alignment.aligned
    assert alignment.to_fleet((0.0, 0.0, -2.0)) == pytest.approx((0, 0, -5), abs=1e-6)


def test_the_moments_of_two_positions_may_differ():
    alignment = told()
    alignment.hear_local((5.0, 6.0, 7.0), (8.0, 0.0, 0.0), 2.0, stands=False)
    ahead = FLEET.to_geodetic(30 + 5 + 6, -40 + 6)
    for now in (2.1, 2.2, 2.3, 2.4):
        alignment.hear_global(*ahead, now, armed=True)
    assert hypot(6) > TOLERANCE_M
    assert alignment.problem == ""
