"""Processes that start before it is known what they shall do, and end when nobody wants them."""

from mavherd.gcs.run.head_start import HeadStart


def test_who_is_not_taken_is_gone_at_the_end(children):
    before = children()
    with HeadStart() as ahead:
        assert len(children() - before) == 2
        nursery = ahead.nursery()
    assert len(children() - before) == 1
    nursery.close(0.0)
    assert not children() - before


def test_a_second_coordinator_starts_when_it_is_asked_for(children):
    before = children()
    with HeadStart(coordinator=False) as ahead:
        assert len(children() - before) == 1
        child, channel = ahead.coordinator()
        assert len(children() - before) == 2
        channel.close()  # end-of-file before any job
        assert child.end(60.0) == 0
    assert not children() - before
