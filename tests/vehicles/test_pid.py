"""A PID adds up its three terms, and its integral is bounded, can be held and forgotten."""

from math import isclose

from mavherd.vehicles.pid import Gains, Pid


def test_output_is_the_sum_of_three_terms():
    pid = Pid(Gains(p=2.0, i=0.5, d=3.0, i_limit=10.0))
    assert isclose(pid.update(1.5, -0.2, 0.1), 2.0 * 1.5 + 0.5 * 1.5 * 0.1 + 3.0 * -0.2)


def test_the_integral_stops_at_its_limit_and_comes_back_at_once():
    pid = Pid(Gains(p=0.0, i=1.0, i_limit=0.3))
    for _ in range(1000):
        pid.update(1.0, 0.0, 0.01)
    assert pid.integral == 0.3
    assert pid.update(-1.0, 0.0, 0.1) < 0.3 - 0.09
    for _ in range(1000):
        pid.update(-1.0, 0.0, 0.01)
    assert pid.integral == -0.3


def test_a_step_of_no_time_holds_the_integral():
    pid = Pid(Gains(p=1.0, i=1.0, i_limit=1.0), integral=0.2)
    assert pid.update(5.0, 0.0, 0.0) == 5.2
    assert pid.integral == 0.2


def test_reset_forgets_the_past():
    pid = Pid(Gains(p=1.0, i=1.0, i_limit=1.0))
    pid.update(1.0, 0.0, 0.5)
    pid.reset()
    assert pid.update(0.0, 0.0, 0.5) == 0.0
