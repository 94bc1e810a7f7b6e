"""The tables of the flight stacks are sound, and a vehicle shows itself by them."""

import pytest
from pymavlink import mavutil

from mavherd.transport.mavlink import mav
from mavherd.vehicles.config import AUTOPILOTS, KINDS
from mavherd.vehicles.flight.autopilot import BEHAVIOURS
from mavherd.vehicles.flight.modes import Mode
from mavherd.vehicles.flight.personality import PERSONALITIES
from mavherd.vehicles.flight.position_target import rules_of
from mavherd.vehicles.flight.wording import wording

TABLES = [(s, k) for s in AUTOPILOTS for k in KINDS]
STANDARD_TYPES = {"quadcopter": mav.MAV_TYPE_QUADROTOR, "rover": mav.MAV_TYPE_GROUND_ROVER}
AUTOPILOT_BYTES = {
    "ardupilot": mav.MAV_AUTOPILOT_ARDUPILOTMEGA,
    "px4": mav.MAV_AUTOPILOT_PX4,
    "generic": mav.MAV_AUTOPILOT_GENERIC,
}


NOT_IN_4_6 = {"POSITION", "OF_LOITER", "RATE_ACRO", "LEARNING"}


def table_of(stack, kind):
    return PERSONALITIES[stack].modes[kind]


def test_there_is_a_personality_for_every_autopilot_that_can_be_asked_for():
    assert set(PERSONALITIES) == set(AUTOPILOTS)


@pytest.mark.parametrize(("stack", "kind"), TABLES)
def test_every_mode_is_flown_and_has_a_number_and_a_name_of_its_own(stack, kind):
    table = table_of(stack, kind)
    numbers = [table.number(mode) for mode in table.rows]
    names = [table.name(mode) for mode in table.rows]
    assert set(table.rows) <= set(BEHAVIOURS[kind])
    assert len(set(numbers)) == len(set(names)) == len(table.rows)
    for mode in table.rows:
        assert table.mode(table.number(mode)) is mode
    assert not set(table.refused) & set(numbers)
    assert not set(table.refused.values()) & set(names)
    assert table.boot in table.rows
    assert table.not_armable <= set(table.rows)
    assert table.boot not in table.not_armable


@pytest.mark.parametrize(("stack", "kind"), TABLES)
def test_every_way_to_leave_or_enter_a_mode_leads_to_one_that_is_there(stack, kind):
    personality, rows = PERSONALITIES[stack], table_of(stack, kind).rows
    assert personality.reposition_mode in rows
    assert personality.loiter_mode in rows
    assert {Mode.GUIDED, Mode.AUTO, Mode.RTL, Mode.HOLD} <= set(rows)
    assert (Mode.TAKEOFF in rows) is (personality.takeoff_enters_mode and kind == "quadcopter")
    assert rules_of(stack, kind).drives is (kind == "rover")
    assert wording(stack, kind)


@pytest.mark.parametrize("kind", KINDS)
def test_ardupilots_numbers_are_those_that_clients_know(kind):
    """DroneKit throws when a custom_mode is not in this table."""
    known = mavutil.mode_mapping_bynumber(STANDARD_TYPES[kind])
    table = table_of("ardupilot", kind)
    for number, name in table.rows.values():
        assert known[number] == name
    ours = {number for number, _ in table.rows.values()} | set(table.refused)
    others = {known[n] for n in known if n not in ours}
    assert others <= NOT_IN_4_6, "every mode of 4.6 is flown or refused by name"
    for number, name in table.refused.items():
        assert known.get(number, name) == name


@pytest.mark.parametrize("kind", KINDS)
def test_px4s_numbers_are_those_that_clients_know(kind):
    known = {main << 16 | sub << 24: name for name, (_, main, sub) in mavutil.px4_map.items()}
    names = {"LOITER": "HOLD", "STABILIZED": "STABILIZED", "RTGS": "RTL"}
    table = table_of("px4", kind)
    for number, name in table.rows.values():
        if number in known:
            assert names.get(known[number], known[number]) == name
    ours = {number for number, _ in table.rows.values()} | set(table.refused)
    missing = {known[number] for number in known if number not in ours}
    assert missing <= {"RTGS", "LAND", "TAKEOFF"}, "a rover neither takes off nor lands"
    assert kind == "rover" or missing <= {"RTGS"}


@pytest.mark.parametrize(("stack", "kind"), TABLES)
def test_a_vehicle_shows_its_personality(desk, stack, kind, of):
    vehicle = desk(kind, autopilot=stack)
    (_, heartbeat) = vehicle.ask(mav.MAV_CMD_REQUEST_MESSAGE, 0)
    assert (heartbeat.type, heartbeat.autopilot) == (STANDARD_TYPES[kind], AUTOPILOT_BYTES[stack])
    table = table_of(stack, kind)
    assert heartbeat.custom_mode == table.number(table.boot)
    assert heartbeat.base_mode & mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    (_, version) = vehicle.ask(mav.MAV_CMD_REQUEST_MESSAGE, 148)
    major, minor, _ = PERSONALITIES[stack].firmware
    assert version.flight_sw_version >> 16 == major << 8 | minor
    bytewise = mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    assert bool(version.capabilities & bytewise) is (stack == "px4")


def test_ardupilot_boots_as_it_does_without_a_transmitter(desk):
    assert desk("quadcopter").autopilot.modes.boot is Mode.STABILIZE
    assert desk("rover").autopilot.modes.boot is Mode.MANUAL
    assert PERSONALITIES["ardupilot"].firmware[:2] == (4, 6)
