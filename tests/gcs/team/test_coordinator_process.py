"""A coordinator's process: states that were missed while joining are sent again."""

import socket
import threading

import pytest

from mavherd.gcs.team.coordinator_process import CoordinatorProcess, Job
from mavherd.scenarios.loader import load_scenario, scenario_to_yaml
from mavherd.transport.bus import Bus
from mavherd.transport.channel import Channel, ChannelClosed
from mavherd.transport.links import socket_pair_udp
from mavherd.transport.wire import Phase, VehicleState, pack_state, unpack_state
from mavherd.vehicles.grants import DONE, GRANT

PAIR = """
name: pair
robots:
  - {name: a, kind: rover, start: {east: 0, north: 0}, goto: {east: 4, north: 0}}
  - {name: b, kind: rover, start: {east: 0, north: 9}, goto: {east: 4, north: 9}}
"""
UNKNOWN = VehicleState(
    "b", 2, 1, -1.0, (0, 0, 0), (0, 0, 0), (1, 0, 0, 0), 0, armed=False, phase=Phase.WAITING
)


@pytest.fixture
def endpoint():
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{sock.getsockname()[1]}"


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
            answer = None
            while answer is None:  # it waits for b, which says the same until it is heard
                other.put(pack_state(UNKNOWN))
                answer = channel.receive(0.05)
            assert not answer["finished"]
            assert answer["ticks"] == 1, "its wall time is over"
            late = router.latest("vehicle/a/state")
            assert late.arrived.wait(5)
            assert unpack_state(late.latest["vehicle/a/state"]).sequence == 1
        finally:
            channel.close()
            thread.join(5)
            process.close()
            control.close()
            theirs.close()
