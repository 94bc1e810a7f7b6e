"""Who is best and who is worst, as far as what is shown tells them apart."""

import pytest

from mavherd.gcs.compare.measures import MEASURES, standings

KILLED = {"exit_code": 3, "error": "the run was killed: it left no report"}


def report(**changes):
    base = {
        "exit_code": 0,
        "error": None,
        "partial": False,
        "collisions": 0,
        "classes": [],
        "robots": [{"arrived": True, "arrival_s": 5.0}],
        "all_arrived": True,
        "fleet": {"last_arrival_s": 5.0, "deadlock_any_s": None},
    }
    return base | changes


def standing(reports, key, **options):
    return next(s for s in standings(reports, **options) if s.measure.key == key)


def arriving(*times):
    return [report(fleet={"last_arrival_s": t}) for t in times]


def test_low_is_better_or_high_is():
    fast = standing(arriving(9.0, 5.0, 7.0), "last_arrival_s")
    assert (fast.best, fast.worst) == ({1}, {0})
    near = [{"class": "rover-rover", "min_separation_m": m} for m in (0.9, 0.3, 2.0)]
    apart = standing([report(classes=[row]) for row in near], "nearest_rovers")
    assert (apart.best, apart.worst) == ({2}, {1})


def test_what_prints_alike_is_alike():
    same = standing(arriving(5.01, 5.04, 5.0), "last_arrival_s")
    assert (same.best, same.worst) == (set(), set())


def test_of_two_runs_none_is_called_the_worst():
    two = standing(arriving(5.0, 9.0), "last_arrival_s")
    assert (two.best, two.worst) == ({0}, set())


def test_what_most_of_them_are_is_not_marked():
    hits = standing([report(collisions=n) for n in (0, 0, 0, 2)], "collisions")
    assert (hits.best, hits.worst) == (set(), {3})


def test_runs_that_are_not_alike_are_not_ranked():
    mixed = standing(arriving(5.0, 9.0, 12.0), "last_arrival_s", alike=False)
    assert (mixed.best, mixed.worst) == (set(), set())


def test_who_has_not_arrived_has_no_time_of_arrival():
    late = report(all_arrived=False, robots=[{"arrived": False, "arrival_s": None}] * 2)
    found = standing([report(), late], "last_arrival_s")
    assert found.values == (5.0, None)
    assert standing([report(), late], "arrived").values == (1.0, 0.0)


def told(key, *reports):
    found = standing(reports, key)
    return found.best, found.worst


def costing(effort, **changes):
    return report(fleet={"last_arrival_s": 5.0, "control_effort_m2_s3": effort}, **changes)


def near(metres, **changes):
    return report(classes=[{"class": "rover-rover", "min_separation_m": metres}], **changes)


def test_who_does_not_do_the_work_or_collides_is_not_praised_for_its_cost():
    idle = costing(1.0, all_arrived=False, exit_code=1)
    hit = costing(2.0, collisions=6, exit_code=1)
    assert told("control_effort", idle, hit, costing(30.0), costing(20.0)) == ({3}, set())
    assert told("control_effort", idle, hit, costing(30.0)) == (set(), set())


def test_the_safest_is_one_in_which_all_arrived_and_the_most_dangerous_any():
    idle = near(3.0, all_arrived=False, exit_code=1)
    assert told("nearest_rovers", idle, near(0.1, exit_code=1), near(1.2)) == ({2}, {1})
    stuck = near(0.1, all_arrived=False, exit_code=4, error="timed out: not done after 30 s")
    assert told("nearest_rovers", near(2.0), stuck, near(1.2)) == ({0}, {1})
    assert told("nearest_rovers", idle, near(1.2)) == (set(), set())  # there is none to be best of


@pytest.mark.parametrize("changes", [KILLED, {"partial": True}])
def test_a_run_that_was_cut_short_is_neither_best_nor_worst(changes):
    cut, worst = near(9.0, **changes), near(0.01, **changes)
    assert told("nearest_rovers", cut, worst, near(1.0), near(2.0), near(3.0)) == ({4}, {2})


def test_what_no_run_has_is_left_out_and_an_old_report_lacks_much():
    old = report(collisions=1)
    del old["fleet"]
    keys = {s.measure.key for s in standings([old, old])}
    assert "deadlock_s" not in keys
    assert "collisions" in keys


@pytest.mark.parametrize("measure", MEASURES, ids=lambda measure: measure.key)
def test_every_measure_copes_with_a_report_that_knows_nothing(measure):
    empty = {"classes": [], "robots": [], "fleet": None, "cpu": None}
    assert measure.of(empty) is None
