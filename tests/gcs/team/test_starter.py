"""A starter has each step shown by the vehicle before the next, and says why it gives up."""

from itertools import pairwise

import pytest

from mavherd.gcs.station import Station, StationError, stack_of
from mavherd.gcs.team.starter import CLIMB_PATIENCE_S, RETRY_S, Starter
from mavherd.transport.frames import swap_ned_enu
from mavherd.transport.mavlink import Codec, mav
from mavherd.transport.wire import Phase, VehicleState
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.flight.modes import Mode
from mavherd.vehicles.vehicle import Vehicle

PATIENCE_S = 8.0
UP = 3.0


class Stand:
    """A starter and its vehicle; `direct` is streamed."""

    def __init__(self, kind="quadcopter", autopilot="ardupilot"):
        config = VehicleConfig(kind=kind, system_id=5, autopilot=autopilot, north=2.0, east=3.0)
        self.vehicle = Vehicle(config)
        self.link = self.vehicle.converse()
        self.station = Station("q", 5, 20.0, kind=kind, stack=stack_of(autopilot))
        self.starter = Starter(self.station, kind, PATIENCE_S)
        self.flies = kind == "quadcopter"
        self.sent = []
        self.drop = ()  # commands that get lost
        self.up = UP
        self.armed_at = self.up_at = None
        self.now = 0.0

    @property
    def me(self):
        s = self.station.status
        return VehicleState(
            "q", 5, 0, self.now, swap_ned_enu(s.position), (0, 0, 0), (1, 0, 0, 0),
            s.custom_mode, s.armed, Phase.STARTING,
        )  # fmt: skip

    def run(self, seconds, until=None):
        for _ in range(round(seconds * 20)):
            if until and until():
                return
            self.tick()
        assert until is None, self.station.status

    def tick(self):
        messages = Codec(5).decode(self.station.transmit(self.now))
        messages = [m for m in messages if getattr(m, "command", None) not in self.drop]
        self.sent += [(self.now, m) for m in messages]
        data = self.vehicle.handle(Codec(254, 190).encode(messages), self.link)
        for _ in range(5):
            self.vehicle.step()
            data += self.vehicle.report(self.link, self.vehicle.take_broadcasts())
        self.now = self.vehicle.now_us * 1e-6
        self.station.receive(data, self.now)
        if self.station.status.position_at < 0:
            return
        if self.starter.arm(self.now, self.me):
            self.armed_at = self.armed_at or self.now
            if self.flies and self.starter.climb(self.now, self.me, self.up):
                self.up_at = self.up_at or self.now
        if self.starter.direct:
            position = swap_ned_enu(self.starter.direct.position)
            self.station.send_target(self.now, position=position)

    def commands(self):
        return [(at, m.command) for at, m in self.sent if m.get_type() == "COMMAND_LONG"]


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4", "generic"])
def test_a_quadcopter_gets_armed_and_up(autopilot):
    stand = Stand("quadcopter", autopilot)
    stand.run(15, until=lambda: stand.up_at)
    assert stand.vehicle.autopilot.mode is Mode.GUIDED
    assert stand.vehicle.autopilot.armed
    assert stand.me.position == pytest.approx((3, 2, UP), abs=0.3)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4", "generic"])
def test_a_rover_gets_armed_where_it_stands(autopilot):
    stand = Stand("rover", autopilot)
    stand.run(5, until=lambda: stand.armed_at)
    assert stand.station.in_mode(Mode.GUIDED)
    assert stand.me.position == pytest.approx((3, 2, 0), abs=0.1)


def test_a_stack_that_wants_a_stream_has_had_one_when_it_is_asked():
    stand = Stand("quadcopter", "px4")
    stand.run(5, until=lambda: stand.armed_at)
    (mode_at, _) = next(c for c in stand.commands() if c[1] == mav.MAV_CMD_DO_SET_MODE)
    targets = [at for at, m in stand.sent if "POSITION_TARGET" in m.get_type() and at < mode_at]
    assert mode_at - targets[0] > 1.0
    assert len(targets) > 2 * (mode_at - targets[0])  # more than two a second
    assert mav.MAV_CMD_NAV_TAKEOFF not in {c for _, c in stand.commands()}


def offboard_from_before(monkeypatch, refusal):
    """Return a stand whose PX4 is in OFFBOARD already, and whose health bit goes by `refusal`."""
    stand = Stand("quadcopter", "px4")
    autopilot = stand.vehicle.autopilot
    autopilot.enter(Mode.GUIDED)
    monkeypatch.setattr(autopilot.arming, "prearm_refusal", lambda: refusal(autopilot))
    return stand


def arming_asked(stand):
    return [at for at, c in stand.commands() if c == mav.MAV_CMD_COMPONENT_ARM_DISARM]


def test_one_that_was_left_in_offboard_is_armed_when_it_says_that_it_is_well(monkeypatch):
    lacks = "no offboard signal"
    stand = offboard_from_before(monkeypatch, lambda a: lacks if a.lacks_stream else None)
    stand.run(5, until=lambda: stand.armed_at)
    assert len(arming_asked(stand)) == 1
    assert arming_asked(stand)[0] < 2.5
    assert not [t for _, _, t in stand.station.status.texts if "denied" in t]


def test_one_that_never_says_that_it_is_well_is_asked_all_the_same(monkeypatch):
    stand = offboard_from_before(monkeypatch, lambda _: "Gyros inconsistent")
    with pytest.raises(StationError, match="Gyros inconsistent"):
        stand.run(PATIENCE_S + 10)
    assert 3.0 <= arming_asked(stand)[0] < 4.0
    assert len(arming_asked(stand)) >= 4


def test_no_set_point_breaks_a_takeoff_off():
    stand = Stand()
    stand.run(15, until=lambda: stand.up_at)
    assert not [m for _, m in stand.sent if "POSITION_TARGET" in m.get_type()]


def test_a_mode_that_is_put_back_is_asked_for_again():
    stand = Stand("rover")
    stand.run(0.5, until=lambda: stand.station.in_mode(Mode.GUIDED))
    stand.vehicle.autopilot.set_mode(0)  # what ArduPilot's boot does
    stand.run(10, until=lambda: stand.armed_at)
    modes = [at for at, c in stand.commands() if c == mav.MAV_CMD_DO_SET_MODE]
    assert len(modes) == 2


def test_a_yes_that_never_shows_is_an_error_in_the_end(monkeypatch):
    stand = Stand("rover")
    monkeypatch.setattr(stand.vehicle.autopilot, "set_mode", lambda number: 0)
    with pytest.raises(StationError, match="q: accepts mode GUIDED, but does not do it"):
        stand.run(PATIENCE_S + 10)
    assert 2 <= [c for _, c in stand.commands()].count(mav.MAV_CMD_DO_SET_MODE) <= 6


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_arming_is_asked_for_every_second_until_patience_ends(autopilot, monkeypatch):
    stand = Stand("quadcopter", autopilot)
    monkeypatch.setattr(stand.vehicle.autopilot.arming, "refusal", lambda: "Gyros inconsistent")
    with pytest.raises(StationError) as caught:
        stand.run(PATIENCE_S + 10)
    assert "q: arming refused (" in str(caught.value)
    assert "Gyros inconsistent" in str(caught.value)
    asked = [at for at, c in stand.commands() if c == mav.MAV_CMD_COMPONENT_ARM_DISARM]
    assert PATIENCE_S < stand.now < PATIENCE_S + 2
    gaps = [b - a for a, b in pairwise(asked)]
    assert gaps == pytest.approx([RETRY_S] * len(gaps), abs=0.06)
    assert len(gaps) >= 5


def test_all_reasons_of_a_refusal_are_told(monkeypatch):
    stand = Stand("rover")
    reasons = iter(["Gyros inconsistent", "Compass not healthy"] * 20)
    monkeypatch.setattr(stand.vehicle.autopilot.arming, "refusal", lambda: next(reasons))
    with pytest.raises(StationError) as caught:
        stand.run(PATIENCE_S + 10)
    assert "Gyros inconsistent" in str(caught.value)
    assert "Compass not healthy" in str(caught.value)


def test_one_that_does_not_climb_is_given_up():
    stand = Stand()
    stand.drop = (mav.MAV_CMD_NAV_TAKEOFF,)
    with pytest.raises(StationError, match=r"q: does not climb: 0.0 m up, not 3 m \(q: no answer"):
        stand.run(4 * CLIMB_PATIENCE_S)
    assert stand.now < 2 * CLIMB_PATIENCE_S


def test_a_pilot_who_takes_it_on_its_way_up_has_it():
    stand = Stand()
    stand.run(15, until=lambda: stand.me.position[2] > 1)
    stand.vehicle.autopilot.set_mode(6)
    with pytest.raises(StationError, match=r"q: left GUIDED for RTL at \d"):
        stand.run(2)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_pilot_who_takes_it_before_it_has_left_the_ground_has_it(autopilot):
    stand = Stand("quadcopter", autopilot)
    stand.run(15, until=lambda: stand.armed_at)
    stand.vehicle.autopilot.enter(Mode.STABILIZE)
    with pytest.raises(StationError, match=r"q: left (GUIDED|OFFBOARD) for "):
        stand.run(2)
    assert stand.vehicle.autopilot.mode is Mode.STABILIZE


def test_one_that_is_disarmed_before_it_has_left_the_ground_is_not_armed_again():
    stand = Stand()
    stand.run(15, until=lambda: stand.armed_at)
    stand.vehicle.autopilot.arming.disarm(force=True)
    with pytest.raises(StationError, match="q: disarmed itself at"):
        stand.run(2)
    assert not stand.vehicle.autopilot.armed


def test_one_that_flies_already_climbs_by_a_target():
    stand = Stand()
    stand.run(15, until=lambda: stand.up_at)
    stand.starter = Starter(stand.station, "quadcopter", PATIENCE_S)
    stand.station.status.landed = False  # as an external vehicle tells
    stand.up, stand.up_at = UP + 2, None
    stand.sent.clear()
    stand.run(15, until=lambda: stand.up_at)
    assert stand.me.position == pytest.approx((3, 2, UP + 2), abs=0.4)
    assert not stand.commands()


def test_one_that_flies_already_is_taken_where_it_is():
    stand = Stand("quadcopter", "px4")
    stand.run(15, until=lambda: stand.up_at)
    height, stand.flies, stand.armed_at = stand.me.position[2], False, None
    stand.starter = Starter(stand.station, "quadcopter", PATIENCE_S)
    stand.vehicle.autopilot.set_mode(stand.station.modes.number(Mode.HOLD))
    stand.run(5, until=lambda: stand.armed_at)
    stand.run(2)
    assert stand.station.in_mode(Mode.GUIDED)
    assert stand.me.position[2] == pytest.approx(height, abs=0.15)
