"""Processes that start before it is known what they shall do, and end when nobody wants them."""

from pathlib import Path

from mavherd.gcs.run.head_start import HeadStart


def test_who_is_not_taken_is_gone_at_the_end():
    before = children()
    with HeadStart() as ahead:
        assert len(children() - before) == 2
        nursery = ahead.nursery()
    assert len(children() - before) == 1
    nursery.close(0.0)
    assert not children() - before


def test_a_second_coordinator_starts_when_it_is_asked_for():
    before = children()
    with HeadStart(coordinator=False) as ahead:
        assert len(children() - before) == 1
        child, channel = ahead.coordinator()
        assert len(children() - before) == 2
        channel.close()  # end-of-file before any job
        assert child.end(20.0) == 0
    assert not children() - before


def children():
    """Return our child processes."""
    tasks = Path("/proc/self/task").glob("*/children")
    return {pid for task in tasks for pid in task.read_text().split()}
