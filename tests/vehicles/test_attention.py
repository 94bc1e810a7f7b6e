"""A link may have a burst of work done, but no more than its share for long."""

from mavherd.vehicles.attention import Attention


def test_a_burst_is_welcome():
    attention = Attention(5.0)
    attention.spend(0.09)
    assert not attention.is_exhausted(5.0)


def test_a_flood_has_to_wait_and_is_heard_again_later():
    attention = Attention(0.0)
    attention.spend(0.11)
    assert attention.is_exhausted(0.0)
    assert attention.is_exhausted(0.2), "until half of it is worn off"
    assert not attention.is_exhausted(0.26)
    attention.spend(0.04)
    assert not attention.is_exhausted(0.26), "and then a burst is welcome again"


def test_for_long_a_link_gets_a_quarter_of_the_time():
    attention, now, work = Attention(0.0), 0.0, 0.0
    while now < 60:
        if not attention.is_exhausted(now):
            attention.spend(0.003)
            work += 0.003
        now += 0.004
    assert 0.24 < work / now < 0.26


def test_who_asks_for_less_never_waits():
    attention = Attention(0.0)
    for tick in range(10_000):
        assert not attention.is_exhausted(tick * 0.01)
        attention.spend(0.002)


def test_patience_does_not_pile_up():
    attention = Attention(0.0)
    assert not attention.is_exhausted(1e6)
    attention.spend(0.11)
    assert attention.is_exhausted(1e6)
