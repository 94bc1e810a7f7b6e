"""A vehicle's part of a tick: it hears first, then lives slice by slice and says what is due."""

import pytest

from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.config import SLICE_US
from mavherd.vehicles.lockstep import advance
from mavherd.vehicles.truth import PlaceLog

TICK_US = 50_000
BEAT = mav.MAVLink_heartbeat_message(
    mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, mav.MAV_STATE_ACTIVE, 3
)
ARM = mav.MAVLink_command_long_message(
    1, 1, mav.MAV_CMD_COMPONENT_ARM_DISARM, 0, 1, 0, 0, 0, 0, 0, 0
)


@pytest.fixture
def vehicle(desk):
    return desk("rover").vehicle


@pytest.fixture
def names():
    """Return the names of the messages in some bytes."""
    codec = Codec(254, 190)
    return lambda data: [m.get_type() for m in codec.decode(data, stream=False)]


def test_answers_come_before_what_is_due_in_the_tick(vehicle, names):
    link, ground = vehicle.converse(), Codec(254, 190)
    heard = [ground.encode([BEAT]), ground.encode([ARM])]
    said = [name for data in advance(vehicle, link, heard, TICK_US, None) for name in names(data)]
    assert vehicle.now_us == TICK_US
    assert said[0] == "COMMAND_ACK"
    assert "HEARTBEAT" in said[1:]


def test_a_tick_in_which_nothing_is_due_says_nothing(vehicle):
    link = vehicle.converse(channel=None)
    parts = [
        advance(vehicle, link, [], until, None) for until in range(TICK_US, 21 * TICK_US, TICK_US)
    ]
    assert all(all(part) for part in parts)  # nothing empty
    assert [] in parts


def test_ticks_of_any_length_are_the_same_life(desk):
    told, rows = [], []
    for tick_us in (SLICE_US, TICK_US, 1_000_000):
        vehicle, log = desk("quadcopter").vehicle, PlaceLog()
        link = vehicle.converse(channel=None)
        ticks = range(tick_us, 2_000_001, tick_us)
        told.append(b"".join(p for until in ticks for p in advance(vehicle, link, [], until, log)))
        rows.append(log.rows)
    assert told[0] == told[1] == told[2] != b""
    assert rows[0] == rows[1] == rows[2]
    assert len(rows[0]) == 200 * 4 * 8


def test_others_hear_after_every_slice_what_is_for_all(vehicle):
    vehicle.autopilot.say("to everybody", mav.MAV_SEVERITY_INFO)
    told = []
    advance(vehicle, vehicle.converse(channel=None), [], TICK_US, None, told.append)
    assert len(told) == TICK_US // SLICE_US
    assert "STATUSTEXT" in [m.get_type() for m in told[0]]
    assert told[1] == []
