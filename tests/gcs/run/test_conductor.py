"""The fleet clock: a run lasts as long as its scenario says, from when all could begin."""

import socket
from contextlib import closing

import pytest

from mavherd.gcs.run.conductor import Clock, CoordinatorHandle, Died, Lockstep
from mavherd.transport.channel import Channel
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


def test_who_gives_up_tells_how_far_it_came():
    c = clock(True)
    c.now, c.ticks = 29.5, 590
    with pytest.raises(VehicleError, match="refused"):
        c.take(c.coordinators[0], {"error": "refused", "done": [30.15, 603]})
    assert (c.now, c.ticks) == (30.15, 603)


@pytest.mark.parametrize("ask", [lambda c: c.advance(50_000), lambda c: c.look()])
@pytest.mark.parametrize("gone", [False, True])
def test_last_words_pass_for_no_answer(ask, gone):
    ours, theirs = map(Channel, socket.socketpair())
    seen = []
    with closing(ours), closing(theirs):
        c = Lockstep([], [CoordinatorHandle("c0", ours)], lambda: False, seen.append)
        facts = {"late": 0, "ticks": 0}
        theirs.send({"parted": facts, "events": [{"text": "begun"}], "done": [0.3, 6]})
        if gone:
            theirs.close()
        with pytest.raises(Died, match=r"c0 died at 0\.30 s"):
            ask(c)
        assert c.coordinators[0].parted
    assert (c.now, c.ticks, seen) == (0.3, 6, [{"text": "begun"}])


def test_who_is_waited_for_is_told_while_we_wait():
    ours, theirs = map(Channel, socket.socketpair())
    seen = []
    with closing(ours), closing(theirs):
        c = Lockstep([], [CoordinatorHandle("c0", ours)], lambda: False, seen.append)
        theirs.send({"events": [{"text": "no answer"}]})
        theirs.send({"team": "", "outside": 2})
        assert c.look() == [b""]
    assert (seen, c.outside) == ([{"text": "no answer"}], 2)
