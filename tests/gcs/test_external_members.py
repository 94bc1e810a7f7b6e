"""External vehicles of both flight stacks: cleared first, flown like our own, brought to rest."""

from dataclasses import replace
from itertools import pairwise
from math import dist, hypot

import pytest

import mavherd.gcs.safety.rest
from mavherd.gcs.safety.aside import COPTER_ROOM, ROVER_ROOM
from mavherd.gcs.safety.clearance import COMPLAINT_S
from mavherd.gcs.script.orders import Arm, Land, Move
from mavherd.gcs.script.scripted import Scripted
from mavherd.gcs.station import StationError
from mavherd.gcs.team.coordinator import LOST_S, Coordinator
from mavherd.scenarios.loader import load_scenario
from mavherd.transport.mavlink import Codec, mav
from mavherd.transport.wire import Phase
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.flight.modes import Mode
from mavherd.vehicles.vehicle import Vehicle

TICK_US = 50_000
NOWHERE = "tcp:127.0.0.1:1"  # nobody opens it here


def external(scenario, *stacks):
    """Return `scenario` with vehicles that somebody else has started, of these stacks in turn."""
    robots = tuple(
        replace(spec, connect=NOWHERE, autopilot=stacks[i % len(stacks)])
        for i, spec in enumerate(scenario.robots)
    )
    return replace(scenario, robots=robots)


class Waits:
    """The conduct of a script that has not said anything yet."""

    phase, direct = Phase.WAITING, None

    def __init__(self, *_):
        pass

    def nominal(self, now):
        return None

    def update(self, now, me, team):
        pass


class Field:
    """A scenario in memory whose vehicles are reached as outside clients reach them."""

    def __init__(self, scenario, **coordinator):
        names = tuple(spec.name for spec in scenario.robots)
        self.scenario = scenario
        self.coordinator = Coordinator(scenario, names, **coordinator)
        self.members = self.coordinator.members
        self.vehicles = {spec.name: self.vehicle(spec) for spec in scenario.robots}
        self.links = {name: v.converse(channel=0) for name, v in self.vehicles.items()}
        self.outgoing = dict.fromkeys(names, b"")
        self.silent = set()  # whose links are down
        self.drop = {}  # which messages of whom do not get through
        self.events = []
        self.now_us = 0

    def vehicle(self, spec):
        return Vehicle(
            VehicleConfig(
                kind=spec.kind,
                system_id=spec.system_id,
                name=spec.name,
                origin=self.scenario.origin,
                north=spec.start.north,
                east=spec.start.east,
                yaw=1.5707963267948966 - spec.heading,
                autopilot="ardupilot" if spec.autopilot == "auto" else spec.autopilot,
                profile="ardupilot",
            )
        )

    @property
    def now(self):
        return self.now_us * 1e-6

    def tick(self):
        self.now_us += TICK_US
        for name, vehicle in self.vehicles.items():
            incoming, link = self.outgoing[name], self.links[name]
            out = b""
            if incoming and name not in self.silent:
                out += vehicle.handle(incoming, link)
            for _ in range(TICK_US // 10_000):
                vehicle.step()
                out += vehicle.report(link, vehicle.take_broadcasts())
            if name in self.drop:
                heard = Codec(1).decode_frames(out)
                out = b"".join(f for m, f in heard if m.get_type() not in self.drop[name])
            if out and name not in self.silent:
                self.coordinator.receive(name, out, self.now)
        self.outgoing = self.coordinator.tick(self.now, self.coordinator.states())
        self.events += self.coordinator.take_events()

    def run(self, seconds):
        for _ in range(round(seconds * 1e6 / TICK_US)):
            self.tick()

    def until(self, condition, seconds):
        end = self.now + seconds
        while not condition():
            assert self.now < end, [(e["t"], e["vehicle"], e["text"]) for e in self.events]
            self.tick()

    def until_phase(self, phase, seconds=40):
        self.until(lambda: all(m.mission.phase >= phase for m in self.members.values()), seconds)

    def texts(self, name, kind):
        return [e["text"] for e in self.events if (e["vehicle"], e["kind"]) == (name, kind)]

    def armed(self):
        return {name for name, vehicle in self.vehicles.items() if vehicle.autopilot.armed}


@pytest.mark.parametrize("stacks", [("ardupilot",), ("px4",), ("auto", "px4")])
def test_a_team_that_somebody_else_has_started_flies_its_whole_mission(stacks):
    scenario = external(load_scenario("crossing-targets"), *stacks)
    field = Field(scenario)
    field.until(lambda: field.coordinator.finished, 90)
    assert not field.armed()
    for spec in scenario.robots:
        assert field.texts(spec.name, "preflight")[-1] == "ready"
        assert field.texts(spec.name, "phase")[-1] == "done"


def test_nobody_arms_before_all_are_cleared():
    field = Field(external(load_scenario("crossing-targets"), "ardupilot"))
    field.silent.add("rover2")
    field.run(8)
    assert not field.armed()
    assert not field.coordinator.prepared
    (text,) = field.texts("rover2", "preflight")
    assert text.startswith("waits for link: nothing heard on tcp:127.0.0.1:1")
    field.silent.clear()
    field.until(lambda: field.armed() == set(field.vehicles), 10)
    assert field.coordinator.prepared


def test_a_vehicle_that_does_not_get_ready_ends_the_run_with_what_it_lacks():
    scenario = external(load_scenario("one-quad"), "ardupilot")
    scenario = replace(scenario, team=replace(scenario.team, ready_timeout_s=6.0))
    field = Field(scenario)
    field.silent.add("quad1")
    with pytest.raises(StationError, match=r"quad1: not ready after 6 s: link: nothing heard"):
        field.run(10)
    assert field.now == pytest.approx(6.0, abs=0.2)


def test_what_its_line_complains_of_is_told_and_ends_the_run():
    field = Field(external(load_scenario("one-quad"), "ardupilot"))
    field.silent.add("quad1")
    field.members["quad1"].complaint = "system 7 answers here, the scenario wants 1"
    field.run(3)
    assert field.texts("quad1", "preflight") == [
        "waits for system 7 answers here, the scenario wants 1"
    ]
    with pytest.raises(StationError, match="quad1: system 7 answers here"):
        field.run(COMPLAINT_S)


def test_what_is_missing_behind_the_complaint_of_a_line_is_told_when_that_ends():
    scenario = external(load_scenario("one-quad"), "ardupilot")
    field = Field(scenario)
    (spec,) = scenario.robots
    far = replace(spec, start=replace(spec.start, east=spec.start.east + 9.0))
    field.vehicles["quad1"] = field.vehicle(far)
    field.links["quad1"] = field.vehicles["quad1"].converse(channel=0)
    member = field.members["quad1"]
    for seconds in range(8):
        member.complaint = f"tcp:x:1: system 1 has been silent for {seconds} s"
        field.run(1)
    member.complaint = "tcp:x:1: heard; listening for a second system 1"
    field.run(2)
    member.complaint = ""
    field.run(3)
    silent, listens, place = field.texts("quad1", "preflight")
    assert silent.startswith("waits for tcp:x:1: system 1 has been silent for ")
    assert "listening for a second" in listens
    assert place.startswith("waits for place: stands at east ")


def test_the_wrong_kind_of_vehicle_is_told_nothing_and_ends_the_run_at_once():
    scenario = external(load_scenario("one-quad"), "ardupilot")
    field = Field(scenario)
    rover = replace(scenario.robots[0], kind="rover")
    field.vehicles["quad1"] = field.vehicle(rover)
    field.links["quad1"] = field.vehicles["quad1"].converse(channel=0)
    with pytest.raises(StationError, match="rover"):
        field.run(5)
    assert not field.armed()


def test_a_link_that_is_silent_for_five_seconds_and_comes_back_does_not_end_the_run():
    field = Field(external(load_scenario("one-quad"), "ardupilot"))
    field.until_phase(Phase.ACTIVE)
    field.silent.add("quad1")
    field.run(5)
    assert field.texts("quad1", "link") == ["link silent"]
    field.silent.clear()
    field.until(lambda: field.coordinator.finished, 60)
    (_, back) = field.texts("quad1", "link")
    assert back in ("link back after 5.0 s", "link back after 5.1 s")


def reboot(field, name):
    """Put a vehicle in the place of one, which has just booted and knows no origin yet."""
    spec = next(s for s in field.scenario.robots if s.name == name)
    field.vehicles[name] = field.vehicle(spec)
    field.links[name] = field.vehicles[name].converse(channel=0)
    field.drop[name] = ("GPS_GLOBAL_ORIGIN", "HOME_POSITION")


def test_a_reboot_under_way_ends_the_run_and_brings_the_others_to_rest():
    """Else nobody would be steered until its origin is known, half a minute later."""
    field = Field(external(load_scenario("crossing-targets"), "ardupilot"))
    field.until_phase(Phase.ACTIVE)
    reboot(field, "rover1")
    with pytest.raises(StationError, match=r"rover1: has rebooted at \d"):
        field.run(1)
    rest(field, "land", 40)
    assert not field.armed()


def test_one_that_reboots_on_its_way_to_rest_is_not_waited_for(monkeypatch):
    field = Field(external(load_scenario("crossing-targets"), "ardupilot"))
    field.until_phase(Phase.ACTIVE)
    field.coordinator.come_to_rest(field.now, "land")
    field.run(0.5)
    reboot(field, "rover1")
    monkeypatch.setattr(mavherd.gcs.safety.clearance, "missing", lambda checks: checks[:1])
    field.until(lambda: field.coordinator.at_rest, 40)
    assert not field.armed()


def test_a_landed_vehicle_that_no_longer_knows_its_place_does_not_stop_the_others():
    field = Field(external(load_scenario("crossing-targets"), "ardupilot"))
    landed = field.members["rover1"]
    field.until(lambda: landed.mission.phase is Phase.DONE, 60)
    field.drop["rover1"] = ("GLOBAL_POSITION_INT",)
    away = [round(deg * 1e7) for deg in field.scenario.origin.to_geodetic(60.0, 60.0)]
    for _ in range(10):
        steered = [n for n, m in field.members.items() if m.mission.nominal(field.now)]
        m = mav.MAVLink_global_position_int_message(field.now_us // 1000, *away, 0, 0, 0, 0, 0, 0)
        field.coordinator.receive("rover1", Codec(landed.spec.system_id).encode([m]), field.now)
        assert "apart" in landed.station.waits_for
        field.tick()
        for name in steered:
            sent = {m.get_type() for m in Codec(1).decode(field.outgoing[name])}
            assert "SET_POSITION_TARGET_LOCAL_NED" in sent
    assert steered


def test_what_is_no_longer_ready_when_the_last_one_is_keeps_all_from_arming(monkeypatch):
    field = Field(external(load_scenario("crossing-targets"), "ardupilot"))
    field.silent.add("rover2")
    field.run(8)
    assert field.members["quad1"].prepared
    with monkeypatch.context() as patched:
        arming = field.vehicles["quad1"].autopilot.arming
        patched.setattr(arming, "_hindrances", lambda: iter(["Gyros inconsistent"]))
        field.run(3)
        field.silent.clear()
        field.run(5)
        assert not field.armed()
        assert field.texts("quad1", "preflight")[-1].startswith("waits for ready: ")
    field.until(lambda: field.armed() == set(field.vehicles), 20)
    assert field.texts("quad1", "preflight")[-1] == "ready"


def test_a_script_s_vehicle_is_cleared_once_but_again_after_a_reboot():
    field = Field(external(load_scenario("one-quad"), "ardupilot"), strict=False, conduct=Waits)
    member = field.members["quad1"]
    field.run(5)
    member.station.status.prearm_ok = False
    member.station.status.battery_remaining = 0.1
    field.tick()
    assert member.prepared
    reboot(field, "quad1")
    field.run(5)
    assert not member.prepared
    field.drop.clear()
    field.until(lambda: member.prepared, 20)


def test_one_that_stays_silent_ends_it():
    field = Field(external(load_scenario("one-quad"), "ardupilot"))
    field.until_phase(Phase.ACTIVE)
    field.silent.add("quad1")
    silent_at = field.now
    with pytest.raises(StationError, match="quad1: no heartbeat for 10 s"):
        field.run(20)
    assert LOST_S - 1 < field.now - silent_at <= LOST_S + 0.1


def speed(member):
    return hypot(*member.station.status.velocity)


def apart(field, one, other):
    """Return how far two vehicles are from each other, horizontally."""
    places = (field.members[name].state(0).position[:2] for name in (one, other))
    return dist(*places)


def rest(field, at_end, seconds=40):
    """Break off; return the modes that each vehicle then goes through."""
    field.coordinator.come_to_rest(field.now, at_end)
    modes = {name: [] for name in field.vehicles}
    end = field.now + seconds
    while not field.coordinator.at_rest and field.now < end:
        field.tick()
        for name, vehicle in field.vehicles.items():
            if vehicle.autopilot.mode not in modes[name][-1:]:
                modes[name].append(vehicle.autopilot.mode)
    assert field.coordinator.at_rest
    return modes


@pytest.mark.parametrize("stack", ["ardupilot", "px4"])
@pytest.mark.parametrize(
    ("at_end", "copter", "rover", "armed"),
    [
        ("land", [Mode.HOLD, Mode.LAND], [Mode.HOLD], set()),
        ("hold", [Mode.HOLD], [Mode.HOLD], {"quad", "rover"}),
        ("return", [Mode.HOLD, Mode.RTL], [Mode.HOLD, Mode.RTL], set()),
    ],
)
def test_a_run_that_is_broken_off_holds_first_and_then_ends_as_configured(
    stack, at_end, copter, rover, armed
):
    scenario = external(load_scenario("crossing-targets"), stack)
    field = Field(scenario)
    for vehicle in field.vehicles.values():
        vehicle.autopilot.settings.rtl_height = 4.0
    field.until_phase(Phase.ACTIVE)
    field.run(3)
    modes = rest(field, at_end, 60)
    for spec in scenario.robots:
        wanted = copter if spec.kind == "quadcopter" else rover
        assert [m for m in modes[spec.name] if m is not Mode.GUIDED] == wanted
    kinds = {name.rstrip("0123456789") for name in field.armed()}
    assert kinds == armed
    at_once = {e["t"] for e in field.events if e["kind"] == "rest" and "brought" in e["text"]}
    assert len(at_once) == 1
    if at_end == "land":
        assert field.texts("quad1", "rest") == [
            "is brought to hold, then land",
            "moves aside to land: rover3 is below",
            "is disarmed",
        ]
        copters = [spec.name for spec in scenario.robots if spec.kind == "quadcopter"]
        for name in copters:
            others = [other for other in scenario.robots if other.name != name]
            for other in others:
                room = ROVER_ROOM if other.kind == "rover" else COPTER_ROOM
                assert apart(field, name, other.name) > room


@pytest.mark.parametrize("stack", ["ardupilot", "px4"])
def test_a_copter_that_does_not_get_clear_of_who_is_below_lands_after_a_while(stack, monkeypatch):
    monkeypatch.setattr(mavherd.gcs.safety.rest, "place_aside", lambda *_: None)
    field = Field(external(load_scenario("crossing-targets"), stack))
    field.until_phase(Phase.ACTIVE)
    field.run(3)  # now a rover is right below
    field.coordinator.come_to_rest(field.now, "land")
    field.run(15)
    assert field.armed() == {"quad1"}
    field.run(20)
    assert not field.armed()
    assert field.texts("quad1", "rest")[1:] == [
        "moves aside to land: rover3 is below",
        "lands all the same: rover3 is below",
        "is disarmed",
    ]


@pytest.mark.parametrize("stack", ["ardupilot", "px4"])
def test_a_copter_gets_clear_also_of_one_of_whom_nothing_is_heard_any_more(stack):
    field = Field(external(load_scenario("crossing-targets"), stack))
    field.until_phase(Phase.ACTIVE)
    field.run(3)
    field.silent.add("rover3")
    field.run(1.5)
    quad, rover = (field.members[name].station.status for name in ("quad1", "rover3"))
    rover.position = (*quad.position[:2], 0.0)  # there it was when it fell silent
    rest(field, "land")
    assert "quad1" not in field.armed()
    assert not any("all the same" in text for text in field.texts("quad1", "rest"))
    assert apart(field, "quad1", "rover3") > ROVER_ROOM
    assert "moves aside to land: rover3 is below" in field.texts("quad1", "rest")


@pytest.mark.parametrize("stack", ["ardupilot", "px4"])
@pytest.mark.parametrize("broken_off", [True, False])
def test_a_rover_is_braked_before_it_is_put_on_hold(stack, broken_off):
    scenario = external(load_scenario("crossing-targets"), stack)
    rover = scenario.robots[0]
    field = Field(replace(scenario, robots=(replace(rover, dwell_s=0.0),)))
    member, autopilot = field.members[rover.name], field.vehicles[rover.name].autopilot
    if broken_off:
        field.until_phase(Phase.ACTIVE)
        field.run(3)
        field.coordinator.come_to_rest(field.now, "land")
    else:
        field.until_phase(Phase.LANDING, 60)
    assert speed(member) > 0.2
    field.until(lambda: autopilot.mode is Mode.HOLD, 4)
    assert speed(member) < 0.15
    assert rover.name in field.armed()
    field.until(lambda: not field.armed(), 2)


@pytest.mark.parametrize("stack", ["ardupilot", "px4"])
def test_a_script_s_rover_is_braked_before_it_is_put_on_hold(stack):
    scenario = external(load_scenario("crossing-targets"), stack)
    rover = scenario.robots[0]
    field = Field(replace(scenario, robots=(rover,)), conduct=Scripted, strict=False)
    member, autopilot = field.members[rover.name], field.vehicles[rover.name].autopilot
    field.until(lambda: member.prepared, 30)
    arming = member.mission.give(Arm(10.0))
    field.until(lambda: arming.done, 10)
    member.mission.give(Move((1.0, 0.0, 0.0)))
    field.run(4)
    landing = member.mission.give(Land())
    assert speed(member) > 0.5
    field.until(lambda: autopilot.mode is Mode.HOLD, 4)
    assert speed(member) < 0.15
    field.until(lambda: landing.done, 4)
    assert not landing.error


def test_a_pilot_may_take_a_rover_while_it_brakes():
    scenario = external(load_scenario("crossing-targets"), "ardupilot")
    rover = scenario.robots[0]
    field = Field(replace(scenario, robots=(replace(rover, dwell_s=0.0),)))
    field.until_phase(Phase.LANDING, 60)
    field.tick()
    field.vehicles[rover.name].autopilot.enter(Mode.MANUAL)
    with pytest.raises(StationError, match="left GUIDED for MANUAL"):
        field.run(2)


@pytest.mark.parametrize("stack", ["ardupilot", "px4"])
def test_who_would_not_arm_is_asked_why_and_says_so_at_once(stack, monkeypatch):
    field = Field(external(load_scenario("one-quad"), stack))
    autopilot = field.vehicles["quad1"].autopilot
    run_checks, asked_at = autopilot.arming.run_checks, []

    def asked():
        asked_at.append(field.now)
        return run_checks()

    monkeypatch.setattr(autopilot.arming, "run_checks", asked)
    with monkeypatch.context() as patched:
        patched.setattr(autopilot.arming, "_hindrances", lambda: iter(["Gyros inconsistent"]))
        field.until(lambda: field.texts("quad1", "preflight"), 15)
        assert "Gyros inconsistent" in field.texts("quad1", "preflight")[0]
        field.run(18)
        assert len(asked_at) >= 4
        assert all(after - before >= 5 for before, after in pairwise(asked_at))
    field.until(lambda: field.armed(), 20)
    before = len(asked_at)
    field.run(10)
    assert len(asked_at) == before


@pytest.mark.parametrize("stack", ["ardupilot", "px4"])
def test_a_run_may_be_broken_off_at_any_moment_of_the_start(stack):
    scenario = external(load_scenario("one-quad"), stack)
    for ticks in range(0, 60, 2):
        field = Field(scenario)
        field.until_phase(Phase.STARTING)
        field.run(0.05 * ticks)
        rest(field, "land")
        field.run(2)
        assert not field.armed(), ticks
        assert field.texts("quad1", "rest")[-1] in ("is disarmed", "is not to arm any more")


def test_who_was_on_the_way_down_goes_on_landing():
    field = Field(external(load_scenario("one-quad"), "px4"))
    field.until_phase(Phase.LANDING, 60)
    field.until(lambda: field.vehicles["quad1"].autopilot.mode is Mode.LAND, 5)
    assert rest(field, "land") == {"quad1": [Mode.LAND]}
    assert field.texts("quad1", "rest") == ["is in LAND already", "is disarmed"]
    assert not field.armed()


def test_a_pilot_who_has_taken_over_is_left_alone():
    field = Field(external(load_scenario("one-quad"), "ardupilot"))
    field.until_phase(Phase.ACTIVE)
    field.vehicles["quad1"].autopilot.enter(Mode.LOITER)
    with pytest.raises(StationError, match="left GUIDED for LOITER"):
        field.run(2)
    rest(field, "land")
    field.run(1)
    assert field.vehicles["quad1"].autopilot.mode is Mode.LOITER
    assert field.armed() == {"quad1"}
    assert field.texts("quad1", "rest") == ["is in LOITER: left to its pilot"]


def test_who_was_never_told_to_arm_is_told_nothing_at_the_end_either():
    field = Field(external(load_scenario("crossing-targets"), "ardupilot"))
    field.silent.add("rover2")
    field.run(5)
    assert set(map(tuple, rest(field, "land").values())) <= {(), (Mode.STABILIZE,), (Mode.MANUAL,)}
    field.silent.clear()
    field.run(5)
    assert not field.armed()


def test_a_lost_vehicle_does_not_keep_the_others_from_coming_to_rest():
    field = Field(external(load_scenario("crossing-targets"), "ardupilot"))
    field.until_phase(Phase.ACTIVE)
    field.silent.add("quad2")
    rest(field, "land", 30)
    assert field.armed() == {"quad2"}
    assert "no heartbeat" in field.texts("quad2", "problem")[0]


def test_a_script_goes_on_with_the_others_and_with_the_lost_one_when_it_is_back():
    field = Field(external(load_scenario("crossing-targets"), "ardupilot"), strict=False)
    field.until_phase(Phase.ACTIVE)
    field.silent.add("rover1")
    field.run(LOST_S + 1)
    assert "no heartbeat" in field.members["rover1"].problem
    assert [m.problem for m in field.members.values() if m.problem] == [
        field.members["rover1"].problem
    ]
    assert len(field.texts("rover1", "problem")) == 1
    field.silent.clear()
    field.run(1)
    assert field.members["rover1"].problem == ""
