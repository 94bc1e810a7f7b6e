"""Real autopilots' manners, played by test doubles: each run ends as it should, nobody left armed.

The runs of a group fly at the same time; every one starts with its first test.
"""

import os
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from math import dist

import pytest
from manners import Manners
from vehicle_double import VehicleDouble, vehicle_double

FAR_M = 3.0
LONG = 100.0  # s: it hangs
pytestmark = pytest.mark.timeout(300)  # real time, several at once
_SCENARIO = """
name: {name}
duration: 600
fence: {{east: [-20, 600], north: [-20, 20], up: 20}}
team: {{start_sigma_m: 0, ready_timeout_s: {ready_timeout_s}}}
robots:
{robots}
expect: {{collisions: 0}}
"""
_ROBOT = (
    "  - {{name: {name}, kind: {kind}, autopilot: {autopilot}, system_id: {system_id}, "
    "connect: '{connect}', start: {{east: 0, north: {north}}}, "
    "goto: {{east: {far}, north: {north}, up: {up}}}}}"
)


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A team of doubles and how long the run waits for them."""

    quad: Manners | None = field(default_factory=Manners)  # None: no such vehicle
    rover: Manners | None = None
    autopilot: str = "ardupilot"
    ready_timeout_s: float = 30
    link: str = "tcp"
    share_a_port: bool = False  # both send to one UDP port
    twice: bool = False  # a second quadcopter with the same id sends there, too
    expected_id: int = 1  # of the quadcopter, in the scenario
    expected_kind: str = "quadcopter"
    home: str | None = None
    far: float = FAR_M


_ARDUPILOT = Manners(
    origin_after_s=3,
    origin_off=(8, 6, -1.5),
    arming_refused_s=5,
    early_mode_lost_s=2,
    position_only=True,
    drives_while_turning=True,
)
_PX4 = Manners(
    streams_on_request=False, origin_after_s=3, origin_off=(-8, 6, 2), arming_refused_s=5
)
_SHORT = 12  # s that a run waits for vehicles which never get ready; others fly for longer
GROUPS = (
    {
        "ardupilot": Plan(quad=_ARDUPILOT, rover=_ARDUPILOT),
        "px4": Plan(quad=_PX4, rover=_PX4, autopilot="px4", link="serial"),
        "silent px4": Plan(
            quad=Manners(streams_on_request=False, silences=((7, 3),)), autopilot="px4"
        ),
        "silent ardupilot": Plan(
            quad=Manners(silences=((7, 5),)), rover=Manners(hangs_up_after_s=7)
        ),
    },
    {
        "unannounced": Plan(
            quad=Manners(arming_refused_s=6, refuses_unannounced=True),
            rover=Manners(),
            share_a_port=True,
        ),
        "disarms": Plan(quad=Manners(), rover=Manners(disarms_after_s=7)),
        "pilot": Plan(quad=Manners(pilot_after_s=7, pilot_mode="LOITER"), rover=Manners()),
        "refused": Plan(quad=Manners(arming_refused_s=600), ready_timeout_s=_SHORT),
        "wrong id": Plan(expected_id=4, share_a_port=True),
        "wrong kind": Plan(expected_kind="rover"),
    },
    {
        "twins": Plan(share_a_port=True, twice=True, ready_timeout_s=_SHORT),
        "far away": Plan(home="47.9,8.5456,488,0", ready_timeout_s=_SHORT),
        "no position": Plan(quad=Manners(origin_after_s=600), ready_timeout_s=_SHORT),
        "interrupted": Plan(rover=Manners(), far=500),
        "killed": Plan(rover=Manners(), far=500),
    },
)


class Flight:
    """One `mavherd run`, with its doubles."""

    def __init__(self, plan: Plan, name: str, sandbox, stack: ExitStack) -> None:
        self.sandbox = sandbox
        self.quad: VehicleDouble | None = None
        self.rover: VehicleDouble | None = None
        port = sandbox.free_port(socket.SOCK_DGRAM) if plan.share_a_port else 0
        common = {"autopilot": plan.autopilot, "link": "udpin" if port else plan.link, "port": port}
        if plan.home:
            common["home"] = plan.home

        def double(kind: str, manners: Manners, **options) -> VehicleDouble:
            options = {**common, **options}
            return stack.enter_context(vehicle_double(sandbox.folder, kind, manners, **options))

        robots = []
        if plan.quad:
            self.quad = double("quadcopter", plan.quad)
            robots.append(("quad1", plan.expected_kind, plan.expected_id, self.quad, 0))
        if plan.twice:
            double("quadcopter", plan.quad, position=(3, 3, 0))
        if plan.rover:
            self.rover = double("rover", plan.rover, system_id=2, position=(0, 4, 0))
            robots.append(("rover1", "rover", 2, self.rover, 4))
        text = _SCENARIO.format(
            name=name.replace(" ", "-"),
            ready_timeout_s=plan.ready_timeout_s,
            robots="\n".join(
                _ROBOT.format(
                    name=robot,
                    kind=kind,
                    system_id=system_id,
                    north=north,
                    autopilot=plan.autopilot,
                    connect=one.address,
                    far=plan.far,
                    up=2 if kind == "quadcopter" else 0,
                ).replace(", up: 0", "")
                for robot, kind, system_id, one, north in robots
            ),
        )
        (sandbox.folder / "team.yaml").write_text(text)
        self.process = sandbox.start("run", "team.yaml", "--no-record", "--confirm")
        self._finished = None

    @property
    def done(self):
        """What the run left behind, when it has ended."""
        self._finished = self._finished or self.sandbox.finish(self.process)
        return self._finished

    @property
    def events(self) -> str:
        return (self.done.folder / "events.jsonl").read_text()

    def fails(self, *words: str) -> None:
        """Assert that it ended with exit code 3, and a complaint of these words."""
        assert self.done.code == 3, self.done.err
        for word in words:
            assert word in self.done.complaint

    def never_armed(self) -> bool:
        return all(d.actor.armed_at is None for d in (self.quad, self.rover) if d)

    def ends_disarmed(self) -> None:
        for double in (self.quad, self.rover):
            if double:
                double.wait_until(lambda actor: not actor.armed, "disarming")

    def arrives(self) -> None:
        """Assert that all end at their targets, as the vehicles themselves have it."""
        assert self.done.code == 0, self.done.err + self.events
        assert self.done.report["all_arrived"]
        for double, north in ((self.quad, 0.0), (self.rover, 4.0)):
            if double:
                off = dist(double.actor.position[:2], (north, FAR_M))
                assert off < 1.0  # a disarmed rover rolls on; a frame mixed up is 10 m off
        self.ends_disarmed()


@pytest.fixture(scope="module")
def fly(make_sandbox) -> Iterator[Callable[[str], Flight]]:
    """Return the flight of a name; its group starts when the first of it is asked for."""
    with ExitStack() as stack:
        flights: dict[str, Flight] = {}

        def one(name: str) -> Flight:
            if name not in flights:
                (group,) = (g for g in GROUPS if name in g)
                for each, plan in group.items():
                    sandbox = make_sandbox(each.replace(" ", "-"))
                    flights[each] = Flight(plan, each, sandbox, stack)
            return flights[name]

        yield one


# what a patient ground station lives with


def test_streams_on_request_a_late_origin_elsewhere_and_ardurovers_driving(fly):
    flight = fly("ardupilot")
    flight.arrives()
    assert "Need Position Estimate" in flight.events
    for double in (flight.quad, flight.rover):
        assert double.actor.armed_at > 5


def test_px4_with_an_origin_of_its_own_at_serial_ports(fly):
    flight = fly("px4")
    flight.arrives()
    assert flight.quad.actor.armed_at > 5


def test_px4_that_went_home_when_the_link_was_silent_is_brought_back(fly):
    flight = fly("silent px4")
    flight.arrives()
    modes = flight.quad.actor.modes
    assert "OFFBOARD" in modes[modes.index("RTL") :]


def test_a_silent_link_and_a_broken_connection_delay_nobody_for_long(fly):
    flight = fly("silent ardupilot")
    flight.arrives()
    assert set(flight.quad.actor.modes[2:]) <= {"GUIDED", "LAND"}


def test_two_behind_one_port_one_refusing_to_arm_at_first(fly):
    flight = fly("unannounced")
    flight.arrives()
    assert flight.quad.actor.armed_at > 6


# what it ends a run for


def test_a_vehicle_that_disarms_itself(fly):
    flight = fly("disarms")
    flight.fails("rover1: disarmed itself at ")
    flight.ends_disarmed()
    assert "LAND" in flight.quad.actor.modes


def test_a_pilot_who_takes_over_wins(fly):
    flight = fly("pilot")
    flight.fails("quad1: left GUIDED for LOITER at ")
    flight.rover.wait_until(lambda actor: not actor.armed, "disarming")
    assert flight.quad.actor.mode == "LOITER"  # and nobody changes it


def test_a_vehicle_that_never_gets_ready_says_why(fly):
    flight = fly("refused")
    flight.fails(f"quad1: not ready after {_SHORT} s: ready: ", "Need Position Estimate")
    assert flight.never_armed()


def test_somebody_elses_vehicle_behind_the_port(fly):
    flight = fly("wrong id")
    flight.fails("quad1", "system 1 answers here, the scenario wants 4")
    assert flight.never_armed()
    assert flight.quad.actor.targets == 0


def test_another_kind_behind_the_address(fly):
    flight = fly("wrong kind")
    flight.fails("quad1: it says that it is a quadrotor, not a rover")
    assert flight.never_armed()


def test_two_with_one_system_id(fly):
    flight = fly("twins")
    flight.fails("two vehicles call themselves system 1")
    assert flight.never_armed()


def test_an_origin_far_away(fly):
    flight = fly("far away")
    flight.fails("quad1: its origin ", " is 56 km from the fleet's")
    assert flight.never_armed()


def test_no_position(fly):
    flight = fly("no position")
    flight.fails(f"quad1: not ready after {_SHORT} s: position: ")
    assert flight.never_armed()


# when the ground ends


def wait_for_flight(flight: Flight) -> None:
    flight.quad.wait_until(lambda actor: actor.position[2] < -1.5, "take-off", LONG)
    flight.sandbox.wait_for(lambda: '"active"' in event_log(flight), "the mission")


def event_log(flight: Flight) -> str:
    folder = flight.sandbox.run_folder()
    log = folder / "events.jsonl"
    return log.read_text() if log.exists() else ""


def test_ctrl_c_brings_all_to_hold_and_down(fly):
    flight = fly("interrupted")
    wait_for_flight(flight)
    flight.process.send_signal(signal.SIGINT)
    assert flight.done.code == 130
    flight.ends_disarmed()
    assert abs(flight.quad.actor.position[2]) < 0.3
    assert flight.quad.actor.modes[-1] == "LAND"


def test_a_launcher_that_is_killed_leaves_nobody_in_the_air(fly):
    flight = fly("killed")
    wait_for_flight(flight)
    os.kill(flight.process.pid, signal.SIGKILL)
    flight.quad.wait_until(lambda actor: not actor.armed, "landing", LONG)
    assert abs(flight.quad.actor.position[2]) < 0.3
    flight.rover.wait_until(lambda actor: not actor.armed, "disarming")
    flight.sandbox.wait_for(lambda: not flight.sandbox.processes(), "the coordinator's end")
