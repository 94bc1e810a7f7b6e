"""A coordinator's process: states that were missed are sent again; last words tell how far."""

import socket
import threading
from contextlib import ExitStack

import pytest

from mavherd.gcs.run.children import converse, hand_over
from mavherd.gcs.run.onboard import vehicle_config
from mavherd.gcs.team.coordinator_process import CoordinatorProcess, Job
from mavherd.scenarios.loader import load_scenario, scenario_to_yaml
from mavherd.transport.bus import Bus
from mavherd.transport.channel import Channel, ChannelClosed
from mavherd.transport.links import socket_pair_udp
from mavherd.transport.wire import Phase, VehicleState, pack_state, unpack_state
from mavherd.vehicles.grants import DONE, GRANT
from mavherd.vehicles.lockstep import advance
from mavherd.vehicles.vehicle import Vehicle

PAIR = """
name: pair
robots:
  - {name: a, kind: rover, start: {east: 0, north: 0}, goto: {east: 4, north: 0}}
  - {name: b, kind: rover, start: {east: 0, north: 9}, goto: {east: 4, north: 9}}
"""
ONE = """
name: one
robots:
  - {name: a, kind: rover, start: {east: 0, north: 0}, goto: {east: 4, north: 0}}
"""
UNKNOWN = VehicleState(
    "b", 2, 1, -1.0, (0, 0, 0), (0, 0, 0), (1, 0, 0, 0), 0, armed=False, phase=Phase.WAITING
)
PATIENCE_S = 60.0  # for what happens at once, on a machine that stands still now and then


def said(channel, *words):
    """Return what a coordinator says with one of these words, and the events until then.

    In between it may tell that it waits for a vehicle: for us, who play it.
    """
    events = []
    while (message := channel.receive(PATIENCE_S)) is not None:
        events += [e for e in message.get("events", ()) if e["kind"] != "stall"]
        if any(word in message for word in words):
            return message, events
    raise AssertionError(f"none of {words} was said")


def test_who_subscribes_after_the_tick_still_gets_its_states(tmp_path, endpoint):
    (tmp_path / "pair.yaml").write_text(PAIR)
    (tmp_path / "vehicles" / "a").mkdir(parents=True)
    scenario = load_scenario(tmp_path / "pair.yaml")
    (tmp_path / "scenario.yaml").write_text(scenario_to_yaml(scenario))
    vehicle, ours = socket_pair_udp()
    control, its_control = socket.socketpair()
    launcher, theirs = socket.socketpair()
    with Bus.router(endpoint, "r", reliable=True) as router, vehicle:
        job = Job(
            folder=str(tmp_path), run_id="r", endpoint=endpoint, own={"a": ours.detach()},
            conducted=[("a", 1, its_control.detach())], lockstep=True,
        )  # fmt: skip
        process = CoordinatorProcess(job, Bus.client(endpoint, "r", reliable=True))
        channel = Channel(launcher)

        def serve():
            with pytest.raises(ChannelClosed):
                process.run_lockstep(Channel(theirs))

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            grant = {"until_us": 50_000, "period_us": 50_000, "ticks": 9, "wall_s": 0.0}
            channel.send(grant)
            assert GRANT.unpack(control.recv(GRANT.size)) == (50_000, 0)
            control.sendall(DONE.pack(50_000, 0, 0, 0))  # it has lived, and has nothing to say
            other = router.publisher("vehicle/b/state")
            answer = {}
            while "ticks" not in answer:  # it waits for b, which says the same until it is heard
                other.put(pack_state(UNKNOWN))
                answer = channel.receive(0.05) or {}
            assert not answer["finished"]
            assert answer["ticks"] == 1, "its wall time is over"
            late = router.latest("vehicle/a/state")
            assert late.arrived.wait(PATIENCE_S)
            assert unpack_state(late.latest["vehicle/a/state"]).sequence == 1
        finally:
            channel.close()
            thread.join(PATIENCE_S)
            process.close()
            control.close()
            theirs.close()


@pytest.mark.parametrize(("period_us", "last_words"), [(50_000, "died"), ("?", "parted")])
def test_who_breaks_off_in_mid_batch_says_how_far_it_came(
    tmp_path, endpoint, period_us, last_words
):
    """Of the second tick no answer tells: the third one fails, by a death or by a bug."""
    (tmp_path / "one.yaml").write_text(ONE)
    scenario = load_scenario(tmp_path / "one.yaml")
    (tmp_path / "vehicles" / "a").mkdir(parents=True)
    (tmp_path / "scenario.yaml").write_text(scenario_to_yaml(scenario))
    vehicle = Vehicle(vehicle_config(scenario, *scenario.robots))
    with ExitStack() as stack:
        stack.enter_context(Bus.router(endpoint, "r", reliable=True))
        link, ours = map(stack.enter_context, socket_pair_udp())
        control, its_control = map(stack.enter_context, socket.socketpair())
        child, channel = converse("mavherd.gcs.team.coordinator_process")
        stack.callback(child.end, 5.0)
        stack.callback(channel.close)
        hand_over(channel, [ours, its_control])
        log, folder = str(tmp_path / "log.txt"), str(tmp_path)
        channel.send(
            {"log": log, "folder": folder, "run_id": "r", "endpoint": endpoint, "lockstep": True}
            | {"own": ["a"], "linked": ["a"], "conducted": [("a", 7)]}
        )
        its_control.close()
        assert channel.receive(PATIENCE_S) == {"ready": True}
        talk = vehicle.converse(channel=None)
        for until_us, period in (50_000, 50_000), (100_000, period_us):
            grant = {"until_us": until_us, "period_us": period, "ticks": until_us // 50_000}
            channel.send({**grant, "wall_s": 60.0})
            control.recv(GRANT.size)
            heard = [link.recv(65535)] if until_us > 50_000 else []
            link.send(b"".join(advance(vehicle, talk, heard, until_us, None)))
            control.sendall(DONE.pack(until_us, 1, 0, 0))
            if until_us == 50_000:
                answer, _ = said(channel, "ticks")
                assert answer["ticks"] == 1
        if last_words == "died":
            control.recv(GRANT.size)
            control.close()
        last, events = said(channel, "died", "parted")
    assert last_words in last
    assert last["done"] == [100_000 * 1e-6, 2]
    assert [event["vehicle"] for event in events] == ["a"]
