"""Each link gets the rates its peer asked for, and nobody else's."""

from itertools import pairwise

import pytest

from mavherd.transport.mavlink import mav
from mavherd.vehicles.config import SLICE_US
from mavherd.vehicles.protocol.streams import DEFAULT_RATES_HZ, Streams

HEARTBEAT = mav.MAVLINK_MSG_ID_HEARTBEAT
ATTITUDE = mav.MAVLINK_MSG_ID_ATTITUDE
QUATERNION = mav.MAVLINK_MSG_ID_ATTITUDE_QUATERNION


def sent(streams: Streams, seconds: float, start_us: int = 0) -> dict[int, list[int]]:
    """Let time pass; return when (us) each message was due."""
    times: dict[int, list[int]] = {message_id: [] for message_id in DEFAULT_RATES_HZ}
    for now in range(start_us, start_us + round(seconds * 1e6), SLICE_US):
        for message_id in streams.due(now):
            times[message_id].append(now)
    return times


def test_a_link_that_has_spoken_gets_the_default_rates():
    times = sent(Streams(0, 1, spoken=True), 20)
    for message_id, rate in DEFAULT_RATES_HZ.items():
        assert abs(len(times[message_id]) - 20 * rate) <= 1


def test_an_unspoken_link_gets_heartbeats_only_until_it_speaks():
    streams = Streams(0, 1, spoken=False)
    times = sent(streams, 10)
    assert {m for m, at in times.items() if at} == {HEARTBEAT}
    assert len(times[HEARTBEAT]) == 10
    streams.heard(10_000_000)
    times = sent(streams, 10, 10_000_000)
    assert abs(len(times[ATTITUDE]) - 100) <= 1


@pytest.mark.parametrize("rate", [0.2, 1, 3, 7, 20, 30, 50, 99, 100])
def test_an_asked_rate_is_kept_on_the_long_run(rate):
    streams = Streams(0, 1, spoken=True)
    streams.set_interval(ATTITUDE, 1e6 / rate, 0)
    count = len(sent(streams, 60)[ATTITUDE])
    assert abs(count - 60 * rate) <= max(1, 0.01 * 60 * rate)


def test_nothing_is_faster_than_a_slice():
    streams = Streams(0, 1, spoken=True)
    streams.set_interval(ATTITUDE, 1, 0)
    assert streams.interval_us(ATTITUDE) == SLICE_US
    assert len(sent(streams, 1)[ATTITUDE]) == 100


@pytest.mark.parametrize("stop", [-1, -0.5, -3e38])
def test_a_negative_interval_stops_a_message(stop):
    streams = Streams(0, 1, spoken=True)
    streams.set_interval(ATTITUDE, stop, 0)
    assert streams.interval_us(ATTITUDE) == -1
    assert sent(streams, 5)[ATTITUDE] == []


@pytest.mark.parametrize("message_id", DEFAULT_RATES_HZ)
def test_zero_restores_the_default(message_id):
    plain, changed = Streams(0, 1, spoken=True), Streams(0, 1, spoken=True)
    for interval in (-1, 20_000, 0):
        changed.set_interval(message_id, interval, 0)
    assert changed.interval_us(message_id) == plain.interval_us(message_id)
    assert sent(changed, 10) == sent(plain, 10)


def test_the_slowest_rate_is_what_the_answer_can_say():
    streams = Streams(0, 1, spoken=True)
    streams.set_interval(ATTITUDE, 3e38, 0)
    assert 0 < streams.interval_us(ATTITUDE) < 2**31


def test_a_message_that_is_off_by_default_can_be_had():
    streams = Streams(0, 1, spoken=True)
    assert sent(streams, 2)[QUATERNION] == []
    streams.set_interval(QUATERNION, 50_000, 2_000_000)
    assert len(sent(streams, 2, 2_000_000)[QUATERNION]) == 40


def test_heartbeats_of_a_fleet_do_not_fall_on_one_tick():
    first = [sent(Streams(0, i, spoken=True), 1)[HEARTBEAT][0] for i in range(1, 101)]
    busiest = max(first.count(at) for at in set(first))
    assert busiest <= 2


def test_a_pause_is_not_caught_up():
    streams = Streams(0, 1, spoken=True)
    sent(streams, 1)
    after = sent(streams, 1, 60_000_000)[ATTITUDE]
    assert len(after) <= 11
    assert min(b - a for a, b in pairwise(after)) == 100_000
