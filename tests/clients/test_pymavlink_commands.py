"""Every command is acknowledged as ArduPilot 4.6 acknowledges it, over UDP and TCP."""

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

ACCEPTED, DENIED = mav.MAV_RESULT_ACCEPTED, mav.MAV_RESULT_DENIED
UNSUPPORTED, FAILED = mav.MAV_RESULT_UNSUPPORTED, mav.MAV_RESULT_FAILED
GUIDED, LOITER, RTL, LAND = 4, 5, 6, 9
REQUEST, INTERVAL = mav.MAV_CMD_REQUEST_MESSAGE, mav.MAV_CMD_SET_MESSAGE_INTERVAL
ARM, SET_MODE = mav.MAV_CMD_COMPONENT_ARM_DISARM, mav.MAV_CMD_DO_SET_MODE
FORCE = 21196
ARMED = mav.MAV_MODE_FLAG_SAFETY_ARMED


@pytest.fixture(scope="module")
def copter(start):
    return start("quadcopter", speed=3)


@pytest.fixture(scope="module", params=["tcp", "udp", "udp from vehicle"])
def station(copter, connect_once, request):
    return connect_once(copter, request.param)


@pytest.fixture
def pilot(copter, connect):
    """A station whose vehicle stands disarmed in LOITER, before and after."""
    station = connect(copter)

    def calm():
        assert station.ask(ARM, 0, FORCE) == ACCEPTED
        assert station.ask(SET_MODE, 1, LOITER) == ACCEPTED

    calm()
    yield station
    calm()
    station.wait("EXTENDED_SYS_STATE", where=lambda m: m.landed_state == 1)


@pytest.mark.parametrize("form", ["long", "int"])
@pytest.mark.parametrize(
    ("command", "params", "answer"),
    [
        (REQUEST, [mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION], "AUTOPILOT_VERSION"),
        (REQUEST, [mav.MAVLINK_MSG_ID_HOME_POSITION], "HOME_POSITION"),
        (REQUEST, [mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN], "GPS_GLOBAL_ORIGIN"),
        (REQUEST, [mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE], "EXTENDED_SYS_STATE"),
        (REQUEST, [mav.MAVLINK_MSG_ID_ATTITUDE], "ATTITUDE"),
        (mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, [1], "AUTOPILOT_VERSION"),
        (mav.MAV_CMD_GET_HOME_POSITION, [], "HOME_POSITION"),
        (
            mav.MAV_CMD_GET_MESSAGE_INTERVAL,
            [mav.MAVLINK_MSG_ID_HEARTBEAT],
            "MESSAGE_INTERVAL",
        ),
    ],
)
def test_a_request_is_accepted_and_answered(station, form, command, params, answer):
    assert station.ask(command, *params, form=form) == ACCEPTED
    assert station.wait(answer)


@pytest.mark.parametrize("form", ["long", "int"])
@pytest.mark.parametrize(
    ("command", "params", "result"),
    [
        (31_999, [], UNSUPPORTED),
        (mav.MAV_CMD_REQUEST_CAMERA_INFORMATION, [1], UNSUPPORTED),
        (mav.MAV_CMD_REQUEST_PROTOCOL_VERSION, [1], UNSUPPORTED),
        (REQUEST, [60_000], FAILED),
        (REQUEST, [mav.MAVLINK_MSG_ID_CAMERA_INFORMATION], FAILED),
        (INTERVAL, [60_000, 100_000], DENIED),
        (INTERVAL, [mav.MAVLINK_MSG_ID_ATTITUDE, 100_000], ACCEPTED),
        (mav.MAV_CMD_NAV_TAKEOFF, [0, 0, 0, 0, 0, 0, 5], FAILED),  # disarmed
        (ARM, [2], UNSUPPORTED),
        (ARM, [0.5], UNSUPPORTED),
        (ARM, [math.nan], UNSUPPORTED),
        (ARM, [-1], UNSUPPORTED),
        (SET_MODE, [1, 99], FAILED),
        (SET_MODE, [1, 7], FAILED),  # CIRCLE: ArduPilot's, not ours
        (SET_MODE, [1, math.nan], DENIED),
        (mav.MAV_CMD_RUN_PREARM_CHECKS, [], ACCEPTED),
    ],
)
def test_what_cannot_be_done_is_refused(pilot, form, command, params, result):
    assert pilot.ask(command, *params, form=form) == result


def test_a_refused_interval_says_why(pilot):
    pilot.ask(INTERVAL, 60_000, 1e5)
    pilot.wait("STATUSTEXT", where=lambda m: "60000" in m.text)


def test_the_version_tells_the_truth(station):
    station.ask(REQUEST, mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    version = station.wait("AUTOPILOT_VERSION")
    assert version.flight_sw_version >> 16 == 0x0406
    promised = {
        mav.MAV_PROTOCOL_CAPABILITY_MAVLINK2,
        mav.MAV_PROTOCOL_CAPABILITY_MISSION_INT,
        mav.MAV_PROTOCOL_CAPABILITY_COMMAND_INT,
        mav.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED,
        mav.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT,
        mav.MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET,
        mav.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE,
        mav.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY,
    }
    assert all(version.capabilities & bit for bit in promised)
    assert not version.capabilities & mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE


def after_the_answer(pilot):
    """Return the types of what has come after the vehicle had heard the command."""
    heard = [m.get_type() for m in pilot.seen]
    return heard[heard.index("COMMAND_ACK") :]


@pytest.mark.parametrize("mode", [GUIDED, RTL, LAND])
def test_a_mode_change_shows_in_a_heartbeat_at_once(pilot, mode):
    pilot.ask(INTERVAL, mav.MAVLINK_MSG_ID_ATTITUDE, 20_000)
    pilot.forget()
    pilot.ask(SET_MODE, 1, mode)
    pilot.wait("HEARTBEAT", where=lambda m: m.custom_mode == mode)
    assert after_the_answer(pilot).count("ATTITUDE") <= 5


def test_arming_shows_in_a_heartbeat_at_once(pilot):
    pilot.ask(INTERVAL, mav.MAVLINK_MSG_ID_ATTITUDE, 20_000)
    pilot.ask(SET_MODE, 1, GUIDED)
    for armed in (1, 0):
        pilot.forget()
        assert pilot.ask(ARM, armed) == ACCEPTED
        pilot.wait("HEARTBEAT", where=lambda m, armed=armed: bool(m.base_mode & ARMED) == armed)
        assert after_the_answer(pilot).count("ATTITUDE") <= 5


def test_the_legacy_mode_message_is_obeyed_without_an_acknowledgement(pilot):
    pilot.send(mav.MAVLink_set_mode_message(1, 1, GUIDED))
    pilot.wait("HEARTBEAT", where=lambda m: m.custom_mode == GUIDED)
    pilot.send(mav.MAVLink_set_mode_message(1, 1, LOITER))
    before = pilot.until_answered()
    assert [m.command for m in before if m.get_type() == "COMMAND_ACK"] == [
        mav.MAV_CMD_GET_MESSAGE_INTERVAL
    ]


@pytest.mark.parametrize(
    ("mode", "text"), [(RTL, "Arm: RTL mode not armable"), (3, "Arm: Mode requires mission")]
)
def test_arming_is_refused_with_the_reason(pilot, mode, text):
    assert pilot.ask(SET_MODE, 1, mode) == ACCEPTED
    pilot.forget()
    assert pilot.ask(ARM, 1) == FAILED
    assert pilot.wait("STATUSTEXT", where=lambda m: m.text.startswith("Arm")).text == text


def test_a_mode_that_is_not_there_is_named(pilot):
    assert pilot.ask(SET_MODE, 1, 99) == FAILED
    pilot.wait("STATUSTEXT", where=lambda m: m.text == "No such mode 99")


def test_an_armed_copter_that_does_not_take_off_disarms_itself(pilot):
    pilot.ask(SET_MODE, 1, GUIDED)
    assert pilot.ask(ARM, 1) == ACCEPTED
    assert pilot.ask(ARM, 1) == ACCEPTED  # again does no harm
    pilot.wait("HEARTBEAT", where=lambda m: m.base_mode & ARMED)
    pilot.wait("HEARTBEAT", where=lambda m: not m.base_mode & ARMED)


def test_a_flying_copter_disarms_only_by_force(pilot):
    pilot.ask(SET_MODE, 1, GUIDED)
    assert pilot.ask(ARM, 1) == ACCEPTED
    assert pilot.ask(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 3) == ACCEPTED
    pilot.wait("GLOBAL_POSITION_INT", where=lambda m: m.relative_alt > 2500)
    assert pilot.ask(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 3) == FAILED
    assert pilot.ask(ARM, 0) == FAILED
    assert pilot.wait("HEARTBEAT").base_mode & ARMED
    assert pilot.ask(ARM, 0, FORCE) == ACCEPTED
    pilot.wait("HEARTBEAT", where=lambda m: not m.base_mode & ARMED)


def test_a_rover_does_not_take_off(start, connect):
    station = connect(start("rover", speed=3))
    assert station.ask(SET_MODE, 1, 15) == ACCEPTED
    assert station.ask(ARM, 1) == ACCEPTED
    assert station.ask(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 5) == UNSUPPORTED
    assert station.ask(mav.MAV_CMD_NAV_LAND) == UNSUPPORTED
