"""Processes that start before it is known what they shall do, and end when nobody wants them."""

from pathlib import Path

from mavherd.gcs.run.head_start import HeadStart


def test_who_is_not_taken_is_gone_at_the_end():
    with HeadStart() as ahead:
        begun = children()
        assert len(begun) == 2
        nursery = ahead.nursery()
    assert len(children()) == 1
    nursery.close(at_once=True)
    assert not children()


def test_a_second_coordinator_starts_when_it_is_asked_for():
    with HeadStart(coordinator=False) as ahead:
        assert len(children()) == 1
        child, channel = ahead.coordinator()
        assert len(children()) == 2
        channel.close()  # end-of-file before any job
        assert child.end(20.0) == 0
    assert not children()


def children():
    """Return our child processes."""
    tasks = Path("/proc/self/task").glob("*/children")
    return [pid for task in tasks for pid in task.read_text().split()]
