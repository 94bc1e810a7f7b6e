"""A mission starts its vehicle, waits for the team, moves, lands, and knows when to give up."""

import pytest

from mavherd.gcs.station import RETRY_S, TRIES, Station, StationError, stack_of
from mavherd.gcs.team.mission import START_PATIENCE_S, Mission
from mavherd.scenarios.loader import load_scenario
from mavherd.transport.frames import swap_ned_enu
from mavherd.transport.wire import Phase, VehicleState
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.flight.modes import Mode
from mavherd.vehicles.vehicle import Vehicle

TICK_S = 0.05
GOTO = "goto: {east: 2, north: 0, up: 2}"


def scenario_of(tmp_path, text):
    path = tmp_path / "mission.yaml"
    path.write_text(f"name: test\nteam: {{start_sigma_m: 0}}\nrobots:\n{text}")
    return load_scenario(path)


ONE = f"  - {{name: q, kind: quadcopter, start: {{east: 0, north: 0}}, {GOTO}, then: THEN}}\n"
ROVER = "  - {name: r, kind: rover, start: {east: 6, north: 6}, hold: {}}\n"


class Alone:
    """One mission with its real vehicle; the rest of the team is what the test says it is."""

    def __init__(self, scenario):
        self.spec = spec = scenario.robots[0]
        self.vehicle = Vehicle(
            VehicleConfig(kind=spec.kind, system_id=spec.system_id, autopilot=spec.autopilot)
        )
        self.link = self.vehicle.converse()
        self.told = []
        self.station = Station(
            spec.name, spec.system_id, 20.0, kind=spec.kind, stack=stack_of(spec.autopilot)
        )
        self.mission = Mission(
            self.spec, scenario, self.station, lambda kind, text: self.told.append((kind, text))
        )
        self.others = {}
        self.deaf = False
        self.now = 0.0

    def state(self, name="q", position=None, phase=None):
        s = self.station.status
        return VehicleState(
            name, 1, 0, self.now, position or swap_ned_enu(s.position), (0, 0, 0), (1, 0, 0, 0),
            s.custom_mode, s.armed, self.mission.phase if phase is None else phase,
        )  # fmt: skip

    def run(self, seconds, until=None):
        for _ in range(round(seconds / TICK_S)):
            data = self.station.transmit(self.now)
            out = self.vehicle.handle(data, self.link) if not self.deaf else b""
            for _ in range(5):
                self.vehicle.step()
                out += self.vehicle.report(self.link, self.vehicle.take_broadcasts())
            self.now = self.vehicle.now_us * 1e-6
            self.station.receive(out, self.now)
            if self.station.status.heartbeat_at < 0 or self.station.status.position_at < 0:
                continue
            me = self.state()
            self.mission.update(self.now, me, {"q": me, **self.others})
            if target := self.mission.nominal(self.now) or self.mission.direct:
                self.station.send_target(self.now, position=swap_ned_enu(target.position))
            if self.mission.phase is until:
                return
        assert until is None, f"{self.mission.phase.name}, not {until.name}: {self.told}"

    @property
    def phases(self):
        return [text for kind, text in self.told if kind == "phase"]


@pytest.fixture
def alone(tmp_path):
    return Alone(scenario_of(tmp_path, ONE.replace("THEN", "land")))


def test_a_start_is_mode_then_arming_then_takeoff(alone):
    alone.run(20, until=Phase.READY)
    assert alone.phases == ["starting", "ready"]
    assert alone.vehicle.autopilot.armed
    assert alone.state().position[2] == pytest.approx(2, abs=0.25)


def test_it_stands_where_it_is_until_all_are_ready(alone):
    alone.others["r"] = alone.state("r", (9, 9, 0), Phase.STARTING)
    alone.run(20, until=Phase.READY)
    stand = alone.mission.nominal(alone.now).position
    alone.run(5)
    assert alone.mission.phase is Phase.READY
    assert alone.state().position == pytest.approx(stand, abs=0.1)
    alone.others["r"] = alone.state("r", (9, 9, 0), Phase.READY)
    alone.run(0.1)
    assert alone.mission.phase is Phase.ACTIVE


def test_a_landing_is_where_it_arrived(alone):
    alone.run(60, until=Phase.DONE)
    assert alone.phases == ["starting", "ready", "active", "dwell", "landing", "done"]
    assert alone.state().position == pytest.approx((2, 0, 0), abs=0.5)
    assert not alone.vehicle.autopilot.armed


def test_a_return_lands_on_the_pad(tmp_path):
    alone = Alone(scenario_of(tmp_path, ONE.replace("THEN", "return")))
    alone.run(60, until=Phase.DONE)
    assert alone.phases[-3:] == ["returning", "landing", "done"]
    assert alone.state().position == pytest.approx((0, 0, 0), abs=0.4)


def test_one_that_stays_stays_in_the_air(tmp_path):
    alone = Alone(scenario_of(tmp_path, ONE.replace("THEN", "stay")))
    alone.run(60, until=Phase.DONE)
    assert alone.phases[-2:] == ["dwell", "done"]
    assert alone.vehicle.autopilot.armed
    assert alone.state().position == pytest.approx((2, 0, 2), abs=0.3)


def test_it_does_not_land_on_a_rover(tmp_path):
    alone = Alone(scenario_of(tmp_path, ONE.replace("THEN", "land") + ROVER))
    below = alone.state("r", (2, 0, 0), Phase.DWELL)
    alone.others["r"] = below
    alone.run(60, until=Phase.DWELL)
    alone.run(5)
    assert alone.mission.phase is Phase.DWELL
    assert [text for kind, text in alone.told if kind == "wait"] == ["waits to land: r is near"]
    alone.others["r"] = below._replace(position=(5, 5, 0))
    alone.run(0.1)
    assert alone.mission.phase is Phase.LANDING


@pytest.mark.parametrize(
    ("phase", "away", "waits"),
    [
        (Phase.LANDING, 0.55, True),
        (Phase.LANDING, 0.65, False),
        (Phase.DONE, 0.45, True),
        (Phase.DONE, 0.55, False),
        (Phase.DWELL, 0.45, False),
    ],
)
def test_it_does_not_land_beside_another_that_lands_or_stands(tmp_path, phase, away, waits):
    second = ROVER.replace("rover", "quadcopter")
    alone = Alone(scenario_of(tmp_path, ONE.replace("THEN", "land") + second))
    alone.others["r"] = alone.state("r", (20, 0, 0), Phase.DWELL)
    alone.run(60, until=Phase.DWELL)
    place = alone.state().position
    alone.others["r"] = alone.state("r", (place[0] + away, place[1], 0), phase)
    alone.run(5)
    assert (alone.mission.phase is Phase.DWELL) == waits


def test_arming_is_retried_until_the_vehicle_agrees(alone, monkeypatch):
    reasons = {"no": "Gyros inconsistent"}
    monkeypatch.setattr(alone.vehicle.autopilot.arming, "refusal", lambda: reasons.get("no"))
    alone.run(10)
    assert alone.mission.phase is Phase.STARTING
    assert len(alone.station.status.texts) >= 8
    reasons.clear()
    alone.run(15, until=Phase.READY)


def test_a_vehicle_that_never_arms_ends_the_start_with_its_own_words(alone, monkeypatch):
    monkeypatch.setattr(alone.vehicle.autopilot.arming, "refusal", lambda: "Gyros inconsistent")
    with pytest.raises(StationError) as caught:
        alone.run(START_PATIENCE_S + 5)
    assert str(caught.value) == (
        "q: arming refused (FAILED): the vehicle says 'Arm: Gyros inconsistent'"
    )
    assert START_PATIENCE_S < alone.now < START_PATIENCE_S + 2


def test_a_vehicle_that_does_not_answer_ends_the_start_too(alone):
    alone.run(0.2)
    alone.deaf = True
    with pytest.raises(StationError, match=f"q: no answer to .* after {TRIES} tries"):
        alone.run(START_PATIENCE_S + 10)
    assert alone.now < START_PATIENCE_S + (TRIES + 1) * RETRY_S + 2


PX4_QUAD = ONE.replace("quadcopter,", "quadcopter, autopilot: px4,")
PX4_ROVER = (
    "  - {name: q, kind: rover, autopilot: px4, start: {east: 0, north: 0},"
    " goto: {east: 2, north: 0}}\n"
)


def test_a_px4_quadcopter_does_the_same(tmp_path):
    alone = Alone(scenario_of(tmp_path, PX4_QUAD.replace("THEN", "land")))
    alone.run(60, until=Phase.DONE)
    assert alone.phases == ["starting", "ready", "active", "dwell", "landing", "done"]
    assert alone.state().position == pytest.approx((2, 0, 0), abs=0.5)
    assert not alone.vehicle.autopilot.armed


def test_a_px4_quadcopter_that_stays_has_its_stream(tmp_path):
    alone = Alone(scenario_of(tmp_path, PX4_QUAD.replace("THEN", "stay")))
    alone.run(60, until=Phase.DONE)
    alone.run(5)
    assert alone.vehicle.autopilot.mode is Mode.GUIDED
    assert alone.state().position == pytest.approx((2, 0, 2), abs=0.3)


def test_a_px4_rover_does_the_same(tmp_path):
    alone = Alone(scenario_of(tmp_path, PX4_ROVER))
    alone.run(60, until=Phase.DONE)
    assert alone.phases == ["starting", "ready", "active", "dwell", "landing", "done"]
    assert not alone.vehicle.autopilot.armed


@pytest.mark.parametrize("phase", [Phase.READY, Phase.ACTIVE])
def test_a_pilot_who_takes_over_wins(alone, phase):
    if phase is Phase.READY:
        alone.others["r"] = alone.state("r", (9, 9, 0), Phase.STARTING)
    alone.run(20, until=phase)
    alone.vehicle.autopilot.set_mode(alone.vehicle.autopilot.modes.number(Mode.RTL))
    with pytest.raises(StationError, match=r"^q: left GUIDED for RTL at \d+\.\d s"):
        alone.run(1)
    assert alone.vehicle.autopilot.mode is Mode.RTL


def test_a_vehicle_that_disarms_itself_is_given_up(alone):
    alone.run(20, until=Phase.ACTIVE)
    alone.vehicle.autopilot.arming.disarm(force=True)
    with pytest.raises(StationError, match=r"^q: disarmed itself at \d+\.\d s"):
        alone.run(1)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_pilot_who_takes_over_in_the_landing_wins(tmp_path, autopilot):
    alone = Alone(
        scenario_of(
            tmp_path, ONE.replace("THEN", "land").replace("q,", f"q, autopilot: {autopilot},")
        )
    )
    alone.run(60, until=Phase.LANDING)
    alone.run(1.5)
    assert alone.vehicle.autopilot.mode is Mode.LAND
    alone.vehicle.autopilot.enter(Mode.HOLD)
    with pytest.raises(StationError, match=r"^q: left LAND for [A-Z.]+ at \d+\.\d s"):
        alone.run(5)
    assert alone.vehicle.autopilot.mode is Mode.HOLD


def test_a_driver_who_takes_over_a_rover_that_is_to_be_disarmed_wins(tmp_path, monkeypatch):
    alone = Alone(scenario_of(tmp_path, PX4_ROVER.replace("px4", "ardupilot")))
    monkeypatch.setattr(alone.vehicle.autopilot.arming, "disarm", lambda *_, **__: 4)
    alone.run(60, until=Phase.LANDING)
    alone.run(1.5)
    assert alone.vehicle.autopilot.mode is Mode.HOLD
    alone.vehicle.autopilot.set_mode(alone.vehicle.autopilot.modes.number(Mode.MANUAL))
    with pytest.raises(StationError, match=r"^q: left HOLD for MANUAL at"):
        alone.run(5)
    assert alone.vehicle.autopilot.mode is Mode.MANUAL
