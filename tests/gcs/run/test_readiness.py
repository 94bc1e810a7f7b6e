"""A run counts from the moment when the last robot has begun its path."""

from mavherd.gcs.run.readiness import Readiness


def event(t, vehicle, text, kind="phase"):
    return {"t": t, "vehicle": vehicle, "kind": kind, "text": text}


def test_it_is_the_moment_of_the_last_one():
    ready = Readiness(2)
    ready.note(event(1.0, "one", "active"))
    ready.note(event(1.5, "two", "starting"))
    ready.note(event(1.7, "two", "active", kind="text"))  # which anybody may say
    assert ready.at is None
    ready.note(event(2.0, "two", "active"))
    assert ready.at == 2.0


def test_a_robot_that_begins_twice_is_one_robot_and_later_ones_change_nothing():
    ready = Readiness(2)
    for t in (1.0, 2.0):
        ready.note(event(t, "one", "active"))
    assert ready.at is None
    for t in (3.0, 4.0):
        ready.note(event(t, "two", "active"))
    assert ready.at == 3.0
