"""What a coordinator says on the bus: to those who listen, each state once a tick."""

from types import SimpleNamespace

import pytest

from mavherd.gcs.team.coordinator import Coordinator
from mavherd.gcs.team.exchange import Exchange
from mavherd.scenarios.loader import load_scenario
from mavherd.transport.bus import Queue
from mavherd.transport.errors import VehicleError
from mavherd.transport.local_bus import LocalBus
from mavherd.transport.wire import (
    Phase,
    unpack_snapshot,
    unpack_state,
    unpack_target,
    unpack_team,
)

SCENARIO = load_scenario("crossing-targets")
NAMES = tuple(spec.name for spec in SCENARIO.robots)
PERIOD = 0.05


@pytest.fixture
def bus():
    return LocalBus()


def listen(bus, key):
    """Keep every sample of a key."""
    queue = Queue(100)
    bus.publisher(key).listeners.append(queue)
    return queue


class Witness(LocalBus):
    """Knows which keys are present."""

    def __init__(self):
        super().__init__()
        self.present = set()

    def declare_token(self, key):
        self.present.add(key)
        return SimpleNamespace(undeclare=lambda: self.present.remove(key))


def coordinator(bus, *own, lockstep=True):
    """A coordinator whose vehicles have told where they are, and its exchange."""
    core = Coordinator(SCENARIO, own or NAMES)
    for place, member in enumerate(core.members.values()):
        status = member.station.status
        status.heartbeat_at = status.heard_at = status.position_at = 0.0
        status.position = (float(place), 2.0, 0.0)
    return core, Exchange(core, bus, lockstep=lockstep)


def test_the_team_is_sent_in_one_message_each_tick_while_somebody_listens(bus):
    _, exchange = coordinator(bus)
    exchange.offer(0.0)
    heard = listen(bus, "team")
    for tick in (2, 3):
        exchange.offer(tick * PERIOD)
    ticks, teams = zip(*(unpack_team(data) for _, data in heard.drain()), strict=True)
    assert ticks == (2, 3)
    assert [state.name for state in teams[0]] == list(NAMES)
    assert list(teams[1]) == exchange.gather(3 * PERIOD)


def test_vehicles_that_are_not_known_are_not_in_the_team_message(bus):
    core, exchange = coordinator(bus)
    heard = bus.latest("team")
    core.members[NAMES[0]].station.status.position_at = -1.0
    exchange.offer(0.0)
    _, states = unpack_team(heard.latest["team"])
    assert [state.name for state in states] == list(NAMES[1:])
    assert [state.name for state in exchange.gather(0.0)] == list(NAMES)


def test_the_only_coordinator_sends_single_states_to_those_who_listen_to_them(bus):
    _, exchange = coordinator(bus)
    heard = bus.latest(f"vehicle/{NAMES[2]}/state")
    exchange.offer(0.0)
    assert unpack_state(heard.latest[f"vehicle/{NAMES[2]}/state"]).name == NAMES[2]
    assert heard.received == 1


def test_who_begins_to_listen_to_a_state_is_served_within_half_a_second(bus):
    _, exchange = coordinator(bus)
    exchange.offer(0.0)
    heard = bus.latest("vehicle/*/state")
    for tick in range(1, 11):
        exchange.offer(tick * PERIOD)
    assert set(heard.latest) == {f"vehicle/{name}/state" for name in NAMES}


def fly(core, exchange, ticks):
    """Have everybody steered for so many ticks."""
    for tick in range(ticks):
        now = tick * PERIOD
        exchange.offer(now)
        for member in core.members.values():
            member.mission.phase = Phase.READY
            status = member.station.status
            status.armed, status.heartbeat_at, status.heard_at = True, now, now
            status.custom_mode = 4 if member.spec.kind == "quadcopter" else 15
        core.tick(now, exchange.gather(now))
        exchange.publish_targets()


def test_the_only_coordinator_shows_all_states_and_targets_ten_times_a_second(bus):
    core, exchange = coordinator(bus)
    watched = listen(bus, "snapshot")
    fly(core, exchange, 40)
    snapshots = [unpack_snapshot(data) for _, data in watched.drain()]
    assert [s.sequence for s in snapshots] == list(range(2, 41, 2))
    assert [s.now for s in snapshots] == pytest.approx(
        [(s.sequence - 1) * PERIOD for s in snapshots]
    )
    for part in snapshots[-1].states, snapshots[-1].targets:
        assert [each.name for each in part] == list(NAMES)
    assert {target.time for target in snapshots[-1].targets} == {snapshots[-1].now}


def test_of_several_coordinators_each_shows_its_own_vehicles(bus):
    watched = listen(bus, "snapshot")
    for own in (NAMES[:2], NAMES[2:]):
        _, exchange = coordinator(bus, *own)
        for now in (0.0, PERIOD):
            exchange.offer(now)
            exchange.publish_targets()
        ((_, data),) = watched.drain()
        shown = unpack_snapshot(data)
        assert ([state.name for state in shown.states], shown.now) == ([*own], PERIOD)


def test_a_crowd_is_shown_at_half_the_rate(bus, monkeypatch):
    monkeypatch.setattr("mavherd.gcs.team.exchange.CROWD", len(NAMES) - 1)
    core, exchange = coordinator(bus)
    watched = listen(bus, "snapshot")
    fly(core, exchange, 40)
    assert watched.received == 10


def test_targets_are_told_five_times_a_second_to_those_who_watch(bus):
    core, exchange = coordinator(bus)
    watched = listen(bus, f"vehicle/{NAMES[0]}/target")
    fly(core, exchange, 40)
    targets = [unpack_target(data) for _, data in watched.drain()]
    assert len(targets) == 10
    assert {target.name for target in targets} == {NAMES[0]}


def test_of_several_coordinators_each_learns_the_others_states_of_this_tick(bus):
    one = coordinator(bus, *NAMES[:2])
    two = coordinator(bus, *NAMES[2:])
    for _, exchange in (one, two):
        exchange.offer(0.0)
    states = [exchange.gather(0.0) for _, exchange in (one, two)]
    assert states[0] == states[1]
    assert [state.name for state in states[0]] == list(NAMES)
    assert {state.sequence for state in states[0]} == {1}


def test_in_lockstep_a_state_that_does_not_come_is_an_error_that_names_the_vehicle(
    bus, monkeypatch
):
    monkeypatch.setattr("mavherd.gcs.team.exchange.LIVENESS_S", 0.01)
    _, exchange = coordinator(bus, *NAMES[1:])
    exchange.offer(0.0)
    with pytest.raises(VehicleError, match=f"no state of {NAMES[0]} came"):
        exchange.gather(0.0)


def test_free_running_it_goes_on_with_what_is_known_and_tells_what_is_none(bus):
    core, exchange = coordinator(bus, *NAMES[1:], lockstep=False)
    exchange.offer(0.0)
    bus.publisher(f"vehicle/{NAMES[0]}/state").put(b"nonsense")
    assert [state.name for state in exchange.gather(0.0)] == list(NAMES[1:])
    assert [(e["vehicle"], e["kind"]) for e in core.take_events()] == [(NAMES[0], "bus")]


def test_a_vehicle_without_heartbeats_is_present_no_more_until_it_is_back():
    bus = Witness()
    core, exchange = coordinator(bus)
    key, status = f"vehicle/{NAMES[0]}/alive", core.members[NAMES[0]].station.status
    seen = []
    for now, heartbeat_at in ((0.0, 0.0), (2.9, 0.0), (3.1, 0.0), (3.2, 3.15)):
        status.heartbeat_at = heartbeat_at
        exchange.offer(now)
        seen.append(key in bus.present)
    assert seen == [True, True, False, True]
