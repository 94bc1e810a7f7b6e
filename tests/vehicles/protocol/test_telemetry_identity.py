"""A vehicle says who it is, and promises only what it does."""

import pytest
from pymavlink.dialects.v20 import all as whole

from mavherd.transport.mavlink import Codec, mav

REQUEST = mav.MAV_CMD_REQUEST_MESSAGE
AVAILABLE_MODES, CURRENT_MODE, PROTOCOL_VERSION = 435, 436, 300

PROMISES = {
    mav.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT: "MISSION_ITEM",
    mav.MAV_PROTOCOL_CAPABILITY_MISSION_INT: "MISSION_ITEM_INT",
    mav.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE: "MISSION_COUNT",
    mav.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY: "MISSION_COUNT",
    mav.MAV_PROTOCOL_CAPABILITY_COMMAND_INT: "COMMAND_INT",
    mav.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT: "PARAM_SET",
    mav.MAV_PROTOCOL_CAPABILITY_FTP: "FILE_TRANSFER_PROTOCOL",
    mav.MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET: "SET_ATTITUDE_TARGET",
    mav.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED: "SET_POSITION_TARGET_LOCAL_NED",
    mav.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT: "SET_POSITION_TARGET_GLOBAL_INT",
}
ENCODINGS = {
    "ardupilot": 0,
    "px4": mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE,
    "generic": mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST,
}


def read(message):
    """Read a message as a client does whose dialect has it."""
    return whole.MAVLink(None).decode(bytearray(Codec(1).encode([message])))


def test_the_heartbeat_says_what_it_is(desk, ask):
    for kind, mav_type, base_mode in (("quadcopter", 2, 81), ("rover", 10, 65)):
        m = ask(desk(kind), "HEARTBEAT")
        assert (m.type, m.autopilot, m.base_mode) == (mav_type, 3, base_mode)
        assert m.system_status in (mav.MAV_STATE_STANDBY, mav.MAV_STATE_ACTIVE)


@pytest.mark.parametrize("stack", ENCODINGS)
@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_every_promised_capability_is_there(desk, ask, kind, stack):
    vehicle = desk(kind, autopilot=stack)
    capabilities = ask(vehicle, "AUTOPILOT_VERSION").capabilities
    for bit, message in PROMISES.items():
        assert capabilities & bit
        assert message in vehicle.link.heeds
    terminate = vehicle.command(mav.MAV_CMD_DO_FLIGHTTERMINATION, 1)
    assert capabilities & mav.MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION
    assert terminate == mav.MAV_RESULT_ACCEPTED
    encodings = capabilities & (ENCODINGS["px4"] | ENCODINGS["generic"])
    assert encodings == ENCODINGS[stack]
    known = sum(PROMISES) | mav.MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION | ENCODINGS[stack]
    assert capabilities == known | mav.MAV_PROTOCOL_CAPABILITY_MAVLINK2


@pytest.mark.parametrize(
    ("stack", "version"), [("ardupilot", (4, 6)), ("px4", (1, 16)), ("generic", (4, 6))]
)
def test_the_version_is_that_of_the_flight_stack(desk, ask, stack, version):
    m = ask(desk(autopilot=stack, system_id=9), "AUTOPILOT_VERSION")
    assert (m.flight_sw_version >> 24, m.flight_sw_version >> 16 & 255) == version
    assert m.flight_sw_version & 255 == mav.FIRMWARE_VERSION_TYPE_OFFICIAL
    assert m.uid == 9


def test_ardupilot_has_no_modes_and_no_protocol_version_to_show(quad):
    for message_id in (AVAILABLE_MODES, CURRENT_MODE, PROTOCOL_VERSION):
        assert quad.command(REQUEST, message_id) == mav.MAV_RESULT_FAILED


@pytest.mark.parametrize("stack", ["px4", "generic"])
@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_modes_are_listed_one_by_one_or_all(desk, stack, kind):
    vehicle = desk(kind, autopilot=stack)
    telemetry, table = vehicle.vehicle.telemetry, vehicle.autopilot.modes
    listed = [read(m) for m in telemetry.request(AVAILABLE_MODES, 0)]
    assert [m.mode_index for m in listed] == list(range(1, len(table.rows) + 1))
    assert {m.number_modes for m in listed} == {len(table.rows)}
    assert [(m.custom_mode, m.mode_name) for m in listed] == list(table.rows.values())
    for index in (1, len(listed)):
        (one,) = telemetry.request(AVAILABLE_MODES, index)
        assert read(one).mode_name == listed[index - 1].mode_name
    for index in (-1, len(listed) + 1, 1.5, float("inf")):
        assert telemetry.request(AVAILABLE_MODES, index) == []
    assert len(telemetry.request(AVAILABLE_MODES, float("nan"))) == len(listed)


def test_modes_are_asked_for_by_command(desk):
    vehicle = desk(autopilot="px4")
    assert vehicle.command(REQUEST, AVAILABLE_MODES, 1) == mav.MAV_RESULT_ACCEPTED
    assert vehicle.command(REQUEST, AVAILABLE_MODES, 99) == mav.MAV_RESULT_DENIED
    rate = vehicle.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, AVAILABLE_MODES, 1e6)
    assert rate == mav.MAV_RESULT_FAILED


def test_the_current_mode_is_in_the_list(desk):
    vehicle = desk(autopilot="px4")
    telemetry = vehicle.vehicle.telemetry
    now = read(telemetry.make(CURRENT_MODE))
    listed = {m.custom_mode for m in telemetry.request(AVAILABLE_MODES)}
    assert now.custom_mode == now.intended_custom_mode == vehicle.autopilot.heartbeat().custom_mode
    assert now.custom_mode in listed


def test_mavlink_1_and_2_are_spoken(desk):
    m = desk(autopilot="px4").vehicle.telemetry.make(PROTOCOL_VERSION)
    assert (m.min_version, m.version, m.max_version) == (100, 200, 200)
