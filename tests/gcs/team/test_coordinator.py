"""The coordinator steers real vehicles in memory; central and distributed are the same thing."""

from dataclasses import replace
from math import dist, hypot, pi
from random import Random

import pytest

from mavherd.gcs.laws import HOLD, Command, LawError
from mavherd.gcs.station import StationError
from mavherd.gcs.team.coordinator import LOST_S, Coordinator, check_laws
from mavherd.scenarios.loader import draw_starts, load_scenario
from mavherd.scenarios.schema import Goto, Point, RobotSpec, Scenario, Team
from mavherd.transport.mavlink import Codec
from mavherd.transport.wire import Phase, pack_state, unpack_state
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.vehicle import Vehicle

TICK_US = 50_000


def vehicle_of(scenario, spec) -> Vehicle:
    return Vehicle(
        VehicleConfig(
            kind=spec.kind,
            system_id=spec.system_id,
            name=spec.name,
            origin=scenario.origin,
            north=spec.start.north,
            east=spec.start.east,
            yaw=1.5707963267948966 - spec.heading,
            disturbance=spec.disturbance or scenario.disturbance,
            seed=scenario.seed,
            params={"GUID_TIMEOUT": scenario.team.setpoint_timeout_s},
            latch_position=False,
        )
    )


class Fleet:
    """A scenario in memory: vehicles, coordinators, and the bytes of every link."""

    def __init__(self, scenario, *groups):
        self.scenario = scenario
        names = tuple(spec.name for spec in scenario.robots)
        self.coordinators = [Coordinator(scenario, own) for own in groups or (names,)]
        self.vehicles = {s.name: vehicle_of(scenario, s) for s in draw_starts(scenario)}
        self.links = {name: v.converse() for name, v in self.vehicles.items()}
        self.bytes = {name: bytearray() for name in names}
        self.outgoing = dict.fromkeys(names, b"")
        self.events = []
        self.dead = set()
        self.now_us = 0

    @property
    def now(self):
        return self.now_us * 1e-6

    def tick(self, period_us=TICK_US):
        self.now_us += period_us
        sent = {name: self._advance(name, period_us) for name in self.vehicles}
        for coordinator in self.coordinators:
            for name in coordinator.members:
                coordinator.receive(name, sent[name], self.now)
        # over the bus and back, in order of system id
        packed = [pack_state(s) for c in self.coordinators for s in c.states()]
        states = sorted((unpack_state(p) for p in packed), key=lambda s: s.system_id)
        for coordinator in self.coordinators:
            self.outgoing |= coordinator.tick(self.now, states)
            self.events += coordinator.take_events()
        return states

    def _advance(self, name, period_us):
        if name in self.dead:
            return b""
        vehicle, link, incoming = self.vehicles[name], self.links[name], self.outgoing[name]
        out = vehicle.handle(incoming, link) if incoming else b""
        for _ in range(period_us // 10_000):
            vehicle.step()
            out += vehicle.report(link, vehicle.take_broadcasts())
        self.bytes[name] += incoming + b"|" + out
        return out

    def run(self, seconds):
        for _ in range(round(seconds * 1e6 / TICK_US)):
            self.tick()

    def until_done(self, seconds=90):
        while self.now < seconds and not self.finished:
            self.tick()
        assert self.finished, [e["text"] for e in self.events]

    @property
    def finished(self):
        return all(c.finished for c in self.coordinators)

    def phases(self, name):
        return [e["text"] for e in self.events if (e["vehicle"], e["kind"]) == (name, "phase")]


FLYING = ["starting", "ready", "active", "dwell", "returning", "landing", "done"]


def test_one_quadcopter_flies_its_whole_mission_and_is_done():
    fleet = Fleet(load_scenario("one-quad"))
    fleet.until_done(60)
    assert fleet.phases("quad1") == FLYING
    k = fleet.vehicles["quad1"].robot.kinematics()
    assert k[:3] == pytest.approx((0, 0, 0), abs=0.3)
    assert not fleet.vehicles["quad1"].autopilot.armed
    assert fleet.links["quad1"].codec.lost == 0


def test_one_rover_drives_its_whole_mission_and_is_done():
    fleet = Fleet(load_scenario("one-rover"))
    fleet.until_done(60)
    assert fleet.phases("rover1") == ["starting", "ready", "active", "dwell", "landing", "done"]
    k = fleet.vehicles["rover1"].robot.kinematics()
    assert (k.east, k.north) == pytest.approx((0, 3), abs=0.3)
    assert not fleet.vehicles["rover1"].autopilot.armed


def test_six_robots_cross_and_are_done():
    fleet = Fleet(load_scenario("crossing-targets"))
    fleet.until_done(90)
    for spec in fleet.scenario.robots:
        assert fleet.phases(spec.name)[-1] == "done"


@pytest.mark.parametrize("seed", [1, 5])  # without slowing down they came to 0.57 and 0.67 m
def test_a_coordinator_that_is_often_late_keeps_quadcopters_well_apart(seed):
    places = {"a": Point(0, 0), "b": Point(8, 0.1)}
    robots = tuple(
        RobotSpec(
            name=name,
            kind="quadcopter",
            system_id=number,
            start=places[name],
            path=Goto(target=replace(places[other], up=3)),
        )
        for number, (name, other) in enumerate([("a", "b"), ("b", "a")], 1)
    )
    team = Team(start_sigma_m=0, setpoint_timeout_s=3.0)
    fleet = Fleet(Scenario(name="late", robots=robots, team=team))
    random, gaps = Random(seed), []
    while not fleet.finished and fleet.now < 90:
        late = random.random() < 0.2
        a, b = fleet.tick(random.randrange(20, 75) * 10_000 if late else TICK_US)
        if min(a.position[2], b.position[2]) > 1:
            gaps.append(dist(a.position, b.position))
    assert fleet.finished
    assert min(gaps) > 0.8


@pytest.mark.parametrize("law", ["safe", "paper", "off"])
def test_central_and_distributed_runs_are_the_same_bytes(law):
    scenario = load_scenario("crossing-targets", [f"team.law={law}", "disturbance=held"])
    names = [spec.name for spec in scenario.robots]
    central, each = Fleet(scenario), Fleet(scenario, *((name,) for name in names))
    halves = Fleet(scenario, tuple(names[::2]), tuple(names[1::2]))
    for fleet in (central, each, halves):
        fleet.run(15)
    assert all(len(data) > 10_000 for data in central.bytes.values())
    assert each.bytes == central.bytes
    assert halves.bytes == central.bytes
    phases = {s.phase for s in central.tick()}
    assert Phase.ACTIVE <= min(phases) < Phase.DONE


def test_a_vehicle_that_falls_silent_ends_the_run_after_ten_seconds():
    fleet = Fleet(load_scenario("one-quad"))
    fleet.run(5)
    fleet.dead.add("quad1")
    died = fleet.now
    with pytest.raises(StationError, match="quad1: no heartbeat for 10 s"):
        fleet.run(20)
    assert LOST_S - 1 < fleet.now - died <= LOST_S + 0.1


def test_a_vehicle_that_never_speaks_ends_the_run_too():
    fleet = Fleet(load_scenario("one-quad"))
    fleet.dead.add("quad1")
    with pytest.raises(StationError, match="no heartbeat"):
        fleet.run(20)
    assert fleet.now == pytest.approx(LOST_S, abs=0.1)


def test_nobody_starts_before_everybody_is_known():
    fleet = Fleet(load_scenario("crossing-targets"))
    missing = fleet.scenario.robots[0].name
    fleet.dead.add(missing)
    fleet.run(5)
    assert not any(v.autopilot.armed for v in fleet.vehicles.values())
    assert all(fleet.phases(spec.name) == [] for spec in fleet.scenario.robots)
    fleet.dead.clear()
    fleet.run(3)
    assert all(v.autopilot.armed for v in fleet.vehicles.values())


def test_a_state_is_unknown_until_the_vehicle_has_told_it():
    scenario = load_scenario("one-quad")
    coordinator = Coordinator(scenario, ("quad1",))
    (state,) = coordinator.states()
    assert state.time < 0
    assert coordinator.tick(0.05, [state])["quad1"]  # a heartbeat, so that it can answer


def test_states_are_enu():
    scenario = load_scenario(
        "one-rover", ["robots.rover1.start.east=3", "robots.rover1.start.north=-2"]
    )
    scenario = replace(scenario, team=replace(scenario.team, start_sigma_m=0.0))
    fleet = Fleet(scenario)
    fleet.run(0.2)
    (state,) = fleet.tick()
    assert state.position == pytest.approx((3, -2, 0), abs=1e-3)
    assert state.quaternion == pytest.approx((1, 0, 0, 0), abs=1e-3)  # heading 0 is east
    assert state.sequence == 5


def test_a_rover_asked_to_go_left_turns_left():
    """The border between ENU and NED, there and back: a path that bends left."""
    scenario = load_scenario("one-rover")
    fleet = Fleet(scenario)
    headings = []
    while fleet.now < 25:
        (state,) = fleet.tick()
        if state.phase is Phase.ACTIVE:
            w, _, _, z = state.quaternion
            headings.append(2 * (w * z))
            speed = hypot(state.velocity[0], state.velocity[1])
            if speed > 0.3:
                assert state.velocity[1] / speed == pytest.approx(2 * w * z, abs=0.15)
    # east, then north, then west: counter-clockwise, so sin(heading) goes up to one
    assert headings[0] == pytest.approx(0, abs=0.3)
    assert max(headings) > 0.95
    assert min(headings) > -0.4


def test_what_the_vehicle_says_becomes_an_event():
    fleet = Fleet(load_scenario("one-quad"))
    fleet.run(3)
    texts = [e for e in fleet.events if e["kind"] == "text"]
    assert [e["text"] for e in texts] == ["Arming motors"]
    assert texts[0]["vehicle"] == "quad1"


def test_setpoints_are_velocities_under_the_safe_law():
    fleet = Fleet(load_scenario("one-quad"))
    masks = set()
    while fleet.now < 15:
        fleet.tick()
        for m in Codec(1).decode(fleet.outgoing["quad1"], stream=False):
            if m.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
                masks.add(m.type_mask & 0x1FF)
    assert masks == {0x1C7}


def test_commands_cross_the_border_to_ned():
    fleet = Fleet(load_scenario("one-rover"))
    while {s.phase for s in fleet.tick()} != {Phase.ACTIVE}:
        assert fleet.now < 5
    (member,) = fleet.coordinators[0].members.values()
    member.law = lambda me, neighbours, nominal: Command(
        position=(1, 2, 3), velocity=(4, 5, 6), acceleration=(7, 8, 9), yaw=0.0, yaw_rate=0.25
    )
    fleet.tick()
    sent = Codec(1).decode(fleet.outgoing["rover1"], stream=False)
    (m,) = (m for m in sent if m.get_type() == "SET_POSITION_TARGET_LOCAL_NED")
    assert (m.x, m.y, m.z, m.vx, m.vy, m.vz) == (2, 1, -3, 5, 4, -6)
    assert (m.afx, m.afy, m.afz) == (8, 7, -9)
    assert m.yaw == pytest.approx(pi / 2)  # east
    assert m.yaw_rate == -0.25  # left
    assert m.type_mask == 0


def test_a_law_that_holds_sends_zero_velocity():
    fleet = Fleet(load_scenario("one-rover"))
    while {s.phase for s in fleet.tick()} != {Phase.ACTIVE}:
        assert fleet.now < 5
    (member,) = fleet.coordinators[0].members.values()
    member.law = lambda me, neighbours, nominal: HOLD
    fleet.run(2)
    sent = Codec(1).decode(fleet.outgoing["rover1"], stream=False)
    (m,) = (m for m in sent if m.get_type() == "SET_POSITION_TARGET_LOCAL_NED")
    assert (m.type_mask, m.vx, m.vy, m.vz) == (0xDC7, 0, 0, 0)
    (state,) = fleet.tick()
    assert state.velocity == pytest.approx((0, 0, 0), abs=0.02)


def test_a_law_that_cannot_be_made_is_known_before_the_run():
    scenario = load_scenario("one-quad")
    check_laws(scenario)
    with pytest.raises(LawError):
        check_laws(replace(scenario, team=replace(scenario.team, law="nonsense")))


@pytest.mark.parametrize(
    ("team", "overrides", "said"),
    [
        ("{law: foo}", (), "{file}:2: team.law: unknown law 'foo' (known: "),
        ("{law: safe}", ("team.law=foo",), "--set team.law=foo: team.law: unknown law 'foo'"),
        (
            "{law: safe, law_params: {no: 1}}",
            (),
            "{file}:2: team.law_params: law 'safe': unknown parameter 'no'",
        ),
    ],
)
def test_a_law_that_cannot_be_made_is_told_with_its_place(tmp_path, team, overrides, said):
    file = tmp_path / "field.yaml"
    robot = "{kind: rover, start: {east: 0, north: 0}, goto: {east: 5, north: 5}}"
    file.write_text(f"name: field\nteam: {team}\nrobots: [{robot}]\n")
    with pytest.raises(LawError) as error:
        check_laws(load_scenario(file, overrides))
    assert str(error.value).startswith(said.format(file=file))
