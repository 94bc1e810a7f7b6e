"""A vehicle's clock is brought onto the recording's time line by when its messages arrive."""

import random
from itertools import pairwise

import pytest

from mavherd.gcs.recording.outside.clock import VehicleClock


def test_a_link_that_delays_does_not_shake_the_times():
    clock, dice = VehicleClock(), random.Random(1)
    delays = [0.02 + dice.expovariate(20) for _ in range(400)]
    heard = [clock.hear(100 + k / 20, k / 20 + late) for k, late in enumerate(delays)]
    steps = [b - a for a, b in pairwise(heard[100:])]
    assert max(abs(step - 1 / 20) for step in steps) < 0.005
    assert heard[-1] == pytest.approx(399 / 20 + min(delays), abs=0.02)


def test_nothing_is_dated_after_its_arrival():
    clock, dice = VehicleClock(), random.Random(2)
    for k in range(200):
        arrival = k / 10 + dice.random()
        assert clock.hear(5 + k / 10, arrival) <= arrival


def test_a_reboot_goes_on_where_the_recording_is():
    clock = VehicleClock()
    before = [clock.hear(500 + k / 10, k / 10) for k in range(100)]
    after = [clock.hear(1 + k / 10, 12 + k / 10) for k in range(10)]
    assert clock.reboots == 1
    assert before[-1] == pytest.approx(9.9, abs=0.01)
    assert after == pytest.approx([12 + k / 10 for k in range(10)], abs=0.01)


def test_messages_that_overtake_one_another_are_no_reboot():
    clock = VehicleClock()
    for boot_s in (10.0, 10.5, 10.2, 10.6):
        clock.hear(boot_s, boot_s - 9)
    assert clock.reboots == 0


def test_a_simulator_that_was_paused_is_found_again():
    clock = VehicleClock()
    clock.hear(10.0, 0.0)
    assert clock.hear(10.1, 60.1) == pytest.approx(60.1)
    assert clock.hear(10.2, 60.2) == pytest.approx(60.2)


def test_a_simulator_that_hurries_stays_on_the_time_line():
    clock = VehicleClock()
    assert [clock.hear(k / 2, k / 10) for k in range(5)] == pytest.approx(
        [k / 10 for k in range(5)]
    )
