"""The barrier of lockstep: everybody gets the same time, and who does not answer is named."""

import socket
from contextlib import ExitStack

import pytest

from mavherd.gcs.team import barrier as module
from mavherd.gcs.team.barrier import Barrier, Died, VehicleHandle
from mavherd.transport.errors import VehicleError
from mavherd.vehicles.grants import DONE, GRANT


class Enough(Exception):  # noqa: N818 - an order, not an error
    """What a wait is ended with."""


@pytest.fixture
def pair():
    """Two vehicles: our handles, and their own ends."""
    with ExitStack() as stack:
        ends = [[stack.enter_context(s) for s in socket.socketpair()] for _ in range(2)]
        names = "rover1", "quad1"
        handles = [
            VehicleHandle(name, 40 + i, ours)
            for i, (name, (ours, _)) in enumerate(zip(names, ends, strict=True))
        ]
        yield handles, [theirs for _, theirs in ends]


def never():
    raise AssertionError("nothing to wait for")


def test_everybody_is_granted_the_same_time_and_told_what_waits_for_it(pair):
    handles, (rover, quad) = pair
    barrier = Barrier(handles, never)
    barrier.incoming = [0, 2]
    rover.send(DONE.pack(50_000, 3, 1, 0))
    quad.send(DONE.pack(50_000, 1, 0, 0))
    assert barrier.advance(50_000) == [3, 1]
    assert GRANT.unpack(rover.recv(GRANT.size)) == (50_000, 0)
    assert GRANT.unpack(quad.recv(GRANT.size)) == (50_000, 2)
    assert [handle.outside_clients for handle in handles] == [1, 0]


def test_a_vehicle_that_has_died_is_named_with_the_time_that_all_have_reached(pair):
    handles, (rover, quad) = pair
    barrier = Barrier(handles, never)
    for end in (rover, quad):
        end.send(DONE.pack(50_000, 0, 0, 0))
    barrier.advance(50_000)
    rover.send(DONE.pack(100_000, 0, 0, 0))
    quad.send(DONE.pack(100_000, 0, 0, 0)[:7])  # in the midst of its answer
    quad.close()
    with pytest.raises(Died) as died:
        barrier.advance(100_000)
    assert (died.value.name, died.value.pid) == ("quad1", 41)
    assert died.value.now == pytest.approx(0.05)


def test_a_vehicle_that_is_frozen_is_named(pair, monkeypatch):
    monkeypatch.setattr(module, "SLICE_S", 0.01)
    monkeypatch.setattr(module, "LIVENESS_S", 0.05)
    handles, (_, quad) = pair
    quad.send(DONE.pack(50_000, 0, 0, 0))
    with pytest.raises(VehicleError, match=r"rover1 \(pid 40\) is frozen: no answer to the tick"):
        Barrier(handles, lambda: None).advance(50_000)


def test_a_wait_ends_when_it_makes_no_sense_any_more(pair, monkeypatch):
    monkeypatch.setattr(module, "SLICE_S", 0.01)
    handles, _ = pair

    def enough():
        raise Enough

    with pytest.raises(Enough):
        Barrier(handles, enough).advance(50_000)


def test_who_keeps_all_waiting_is_told_once(pair, monkeypatch):
    monkeypatch.setattr(module, "SLICE_S", 0.001)
    monkeypatch.setattr(module, "STALL_S", 0.01)
    monkeypatch.setattr(module, "LIVENESS_S", 0.1)
    handles, (_, quad) = pair
    quad.send(DONE.pack(50_000, 0, 0, 0))
    told = []
    with pytest.raises(VehicleError, match="frozen"):
        Barrier(handles, lambda: None, lambda *who: told.append(who)).advance(50_000)
    assert told == [("rover1", 0.0)]
