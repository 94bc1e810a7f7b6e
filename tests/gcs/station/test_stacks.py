"""One station speaks to every flight stack: modes, takeoff and what must come first."""

from math import isnan

import pytest

from mavherd.gcs.station import ARDUPILOT, GENERIC, PX4, Station, stack_of
from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.flight.modes import Mode

STACKS = ("ardupilot", "px4", "generic")


@pytest.mark.parametrize("autopilot", STACKS)
@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_a_mode_that_is_accepted_shows_under_its_own_name(make_pair, kind, autopilot):
    pair = make_pair(kind, autopilot)
    pair.run(1)
    for mode in (Mode.HOLD, Mode.GUIDED, Mode.HOLD):
        request = pair.station.set_mode(mode, pair.now)
        pair.run(0.2)
        assert request.accepted
        assert pair.station.in_mode(mode)
        assert pair.station.mode_name() == stack_of(autopilot).modes(kind).name(mode)


def test_a_mode_that_the_stack_lacks_is_not_even_asked_for(make_pair):
    pair = make_pair("rover")
    pair.run(1)
    request = pair.station.set_mode(Mode.LAND, pair.now)
    assert request.done
    assert request.error == "q: mode LAND: ArduRover has no such mode"
    pair.run(1)
    assert not pair.commands(mav.MAV_CMD_DO_SET_MODE)


def test_before_the_stack_is_known_no_mode_can_be_set():
    station = Station("q", 5, 20, stack=None)
    assert "which flight stack" in station.set_mode(Mode.GUIDED, 1.0).error
    assert not station.in_mode(Mode.GUIDED)
    assert station.mode_name() == "MODE 0"


@pytest.mark.parametrize("autopilot", ["px4", "generic"])
def test_a_takeoff_is_that_many_metres_up_from_where_it_stands(make_pair, autopilot):
    pair = make_pair("quadcopter", autopilot, external=True)
    pair.until(lambda: pair.status.position_at > 0)
    station = pair.station
    if autopilot == "generic":
        station.set_mode(Mode.GUIDED, pair.now)
        pair.run(0.2)
    station.arm(pair.now)
    pair.run(0.2)
    assert station.take_off(4.0, pair.now).error == ""
    pair.run(8)
    assert -pair.status.position[2] == pytest.approx(4.0, abs=0.3)


def test_a_takeoff_above_the_sea_gives_no_place_to_fly_to(make_pair):
    pair = make_pair("quadcopter", "px4", external=True)
    pair.until(lambda: pair.status.global_position is not None)
    pair.station.take_off(4.0, pair.now)
    pair.run(0.1)
    (command,) = pair.commands(mav.MAV_CMD_NAV_TAKEOFF)
    assert isnan(command.param5)
    assert isnan(command.param6)
    assert command.param7 == pytest.approx(pair.status.global_position[2] + 4.0, abs=0.01)


def test_a_takeoff_above_the_sea_needs_to_know_the_altitude():
    station = Station("q", 5, 20, stack=PX4)
    assert "altitude" in station.take_off(4.0, 1.0).error
    assert Codec(5).decode(station.transmit(1.0))[0].get_type() == "HEARTBEAT"


def test_what_each_stack_needs():
    assert [s.needs_stream for s in (ARDUPILOT, PX4, GENERIC)] == [False, True, False]
    assert [s.climbs_by_target for s in (ARDUPILOT, PX4, GENERIC)] == [False, True, False]
    assert [s.takeoff_is_amsl for s in (ARDUPILOT, PX4, GENERIC)] == [False, True, False]
    assert "rover" not in ARDUPILOT.follows_velocity
    assert stack_of("auto") is None
