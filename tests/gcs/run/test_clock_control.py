"""What may be asked of a lockstep clock, when the next tick may begin, and what is refused."""

from math import inf

import pytest

from mavherd.gcs.run.clock_control import ClockControl
from mavherd.transport.errors import MavherdError

PERIOD = 0.05


def control(speed=None, *, paused=False):
    return ClockControl(PERIOD, speed, paused=paused, wall=100.0)


def run_until_it_waits(c, wall, most=1000):
    """Do ticks that take no time; return how many."""
    for done in range(most):
        if c.due > wall:
            return done
        c.ticked(c.now + PERIOD, wall)
    return most


def run_until_it_stands(c):
    """Do each tick as soon as it may begin; return how many."""
    done = 0
    while not c.standing:
        c.ticked(c.now + PERIOD, c.due)
        done += 1
    return done


def test_at_max_speed_no_tick_waits():
    assert run_until_it_waits(control(), 100.0) == 1000


def test_a_speed_makes_each_tick_wait_for_its_turn():
    c = control(2.0)
    assert run_until_it_waits(c, 100.0) == 1
    assert c.due == pytest.approx(100.025)
    assert run_until_it_waits(c, 100.11) == 4
    assert c.due == pytest.approx(100.125)


def test_ticks_that_are_overdue_may_be_done_at_once():
    c = control(2.0)
    assert [c.allowed(wall) for wall in (100.0, 100.024, 100.026, 100.051)] == [1, 1, 2, 3]
    c.ticked(3 * PERIOD, 100.051, ticks=3)
    assert c.due == pytest.approx(100.075)
    assert c.allowed(999.0) == 21  # not more than for half a second
    assert control().allowed(100.0) > 1000


def test_steps_may_be_done_at_once_where_no_speed_holds_them_back():
    c = control(paused=True)
    c.order("step 20", 100.0)
    assert c.allowed(100.0) == 20
    c.ticked(15 * PERIOD, 100.0, ticks=15)
    assert c.allowed(100.0) == 5
    c.order("speed 1", 100.0)
    assert c.allowed(999.0) == 1


def test_a_run_can_begin_paused_and_go_on():
    c = control(paused=True)
    assert c.standing
    assert c.due == inf
    assert c.order("resume", 105.0)
    assert not c.standing
    assert run_until_it_waits(c, 105.0) == 1000


@pytest.mark.parametrize("speed", [None, 1.0])
def test_steps_are_ticks_and_then_it_stands(speed):
    c = control(speed)
    c.order("step 3", 101.0)
    assert c.stepping
    assert run_until_it_stands(c) == 3
    assert not c.stepping
    c.order("step", 201.0)
    c.order("step", 201.0)
    assert run_until_it_stands(c) == 2
    assert c.paused


def test_a_pause_calls_off_steps_that_remain():
    c = control()
    c.order("step 10", 100.0)
    c.ticked(PERIOD, 100.0)
    c.order("pause", 100.0)
    assert c.standing


def test_toggle_is_pause_and_resume():
    c = control()
    assert [c.order("toggle", 100.0) and c.paused for _ in range(3)] == [True, False, True]


def test_asking_and_asking_again_changes_nothing():
    c = control()
    assert not c.order("status", 100.0)
    assert c.order("pause", 100.0)
    assert not c.order(" pause ", 101.0)
    assert c.status() == {"t": 0.0, "paused": True, "speed": "max"}


def test_a_new_speed_counts_from_when_it_was_given():
    c = control(0.01)
    c.ticked(PERIOD, 100.0)
    assert c.due == pytest.approx(105.0)
    c.order("speed 10", 101.0)
    assert c.due == 101.0
    c.ticked(2 * PERIOD, 101.0)
    assert c.due == pytest.approx(101.005)
    c.order("speed max", 101.0)
    assert c.speed is None
    assert run_until_it_waits(c, 101.0) == 1000


def test_faster_and_slower_climb_a_ladder_that_ends_in_max():
    c = control(1.0)
    seen = []
    for order in ["faster"] * 10 + ["slower"]:
        c.order(order, 100.0)
        seen.append(c.speed)
    assert seen == [2, 5, 10, 20, 50, 100, 200, 500, 1000, None, 0.5]  # nothing was measured yet
    for _ in range(5):
        c.order("slower", 100.0)
    assert c.speed == 0.1


def test_slower_than_max_is_slower_than_what_was_reached():
    c = control()
    for tick in range(1, 101):  # 5 s of fleet time in 0.2 s
        c.ticked(tick * PERIOD, 100.0 + tick * 0.002)
        c.measure(100.0 + tick * 0.002)
    assert c.rate == pytest.approx(25.0)
    c.order("slower", 101.0)
    assert c.speed == 20


def test_time_that_stands_still_is_known_and_no_part_of_the_rate():
    c = control()
    c.ticked(1.0, 101.0)
    c.measure(101.0)
    c.order("pause", 101.0)
    assert c.stood(111.0) == 10.0
    c.order("speed 2", 111.0)  # changes nothing in that
    c.order("step 20", 121.0)
    assert c.stood(125.0) == 20.0
    for tick in range(1, 21):
        c.ticked(1.0 + tick * PERIOD, 121.0 + tick * PERIOD)
    assert c.standing
    assert c.stood(132.0) == 30.0
    c.measure(132.0)
    assert c.rate == pytest.approx(1.0)


def test_ticks_are_late_only_at_the_speed_that_was_asked_for():
    c = control(10.0)  # a tick each 5 ms
    for tick in range(1, 11):
        c.ticked(tick * PERIOD, 100.0 + tick * 0.020)
    late = c.late
    assert late > 0
    c.order("speed max", 101.0)
    c.ticked(1.0, 109.0)
    assert c.late == late


def test_a_tick_is_late_once_however_late_it_is():
    c = control(1.0)
    c.ticked(PERIOD, 200.0)
    assert c.late == 1
    assert c.due == 200.0  # no race to catch up


@pytest.mark.parametrize(
    ("order", "said"),
    [
        ("", "'' is no command"),
        ("jump", "pause, resume, toggle, step [N]"),
        ("pause now", "no command"),
        ("step 0", "expected 1..1000000 ticks"),
        ("step -1", "expected 1..1000000 ticks"),
        ("step 1.5", "expected 1..1000000 ticks"),
        ("step " + "9" * 100, "expected 1..1000000 ticks"),
        ("step 1 2", "no command"),
        ("speed", "no command"),
        ("speed 0", "expected a factor of 0.01..1000, or max"),
        ("speed nan", "expected a factor of 0.01..1000, or max"),
        ("speed \x1b[2J", r"speed '\x1b[2J'"),
        ("\x1b[2J\u202e", r"\x1b[2J\u202e"),
        ("x" * 10_000, "xxx... is no command"),
    ],
)
def test_what_cannot_be_obeyed_is_refused_and_changes_nothing(order, said):
    c = control(2.0)
    with pytest.raises(MavherdError) as refusal:
        c.order(order, 100.0)
    text = str(refusal.value)
    assert said in text
    assert text.isprintable()
    assert len(text) < 250
    assert c.status() == {"t": 0.0, "paused": False, "speed": 2.0}
