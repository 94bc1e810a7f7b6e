"""The fleet clock: a run lasts as long as its scenario says, from when all could begin."""

import pytest

from mavherd.gcs.run.conductor import Clock, CoordinatorHandle
from mavherd.transport.errors import VehicleError


def clock(*prepared):
    coordinators = [CoordinatorHandle(f"c{i}", None, prepared=p) for i, p in enumerate(prepared)]
    return Clock([], coordinators, lambda: False, lambda event: None)


def test_a_run_of_our_own_vehicles_lasts_from_the_start():
    c = clock(True, True)
    assert not c.expired(10.0)
    c.now = 9.99
    assert not c.expired(10.0)
    c.now = 10.0
    assert c.expired(10.0)


def test_with_external_vehicles_it_lasts_from_when_all_are_prepared():
    c = clock(True, False)
    c.now = 100.0
    assert not c.expired(10.0)
    c.take(c.coordinators[1], {"prepared": True})
    assert not c.expired(10.0)
    assert c.prepared_at == 100.0
    c.now = 109.9
    assert not c.expired(10.0)
    c.now = 110.0
    assert c.expired(10.0)


def test_events_come_before_the_error_that_they_explain():
    seen = []
    c = clock(True)
    c.on_event = seen.append
    with pytest.raises(VehicleError, match="quad1 is lost"):
        c.take(c.coordinators[0], {"events": [{"text": "silent"}], "error": "quad1 is lost"})
    assert seen == [{"text": "silent"}]
