"""As PX4 the vehicle acknowledges, refuses and loses setpoints as PX4 does."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

ACCEPTED, REJECTED = mav.MAV_RESULT_ACCEPTED, mav.MAV_RESULT_TEMPORARILY_REJECTED
DENIED, UNSUPPORTED = mav.MAV_RESULT_DENIED, mav.MAV_RESULT_UNSUPPORTED
ARM, SET_MODE = mav.MAV_CMD_COMPONENT_ARM_DISARM, mav.MAV_CMD_DO_SET_MODE
REQUEST, TAKEOFF = mav.MAV_CMD_REQUEST_MESSAGE, mav.MAV_CMD_NAV_TAKEOFF
ARMED = mav.MAV_MODE_FLAG_SAFETY_ARMED
OFFBOARD, HOLD, MISSION, RETURN = 0x60000, 0x3040000, 0x4040000, 0x5040000
TAKING_OFF = 0x2040000
NOTHING, FORCE = float("nan"), 21196


@pytest.fixture(scope="module")
def px4(start):
    return start("quadcopter", "--autopilot", "px4", speed=3)


@pytest.fixture
def pilot(px4, connect):
    """A station whose vehicle stands disarmed in HOLD, before and after."""
    station = connect(px4, "udp")

    def calm():
        assert station.ask(ARM, 0, FORCE) == ACCEPTED
        assert station.ask(SET_MODE, 1, 4, 3) == ACCEPTED

    calm()
    yield station
    calm()
    station.wait("EXTENDED_SYS_STATE", where=lambda m: m.landed_state == 1)


def in_mode(number):
    return lambda m: m.custom_mode == number


def stay(vx=0.0):
    """Return a velocity setpoint."""
    return mav.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, 1, 0xDC7, 0, 0, 0, vx, 0, 0, 0, 0, 0, 0, 0
    )


@pytest.mark.parametrize(
    ("command", "params", "result"),
    [
        (31_999, [], UNSUPPORTED),
        (mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, [1], UNSUPPORTED),
        (mav.MAV_CMD_GET_HOME_POSITION, [], UNSUPPORTED),
        (REQUEST, [mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION], ACCEPTED),
        (REQUEST, [mav.MAVLINK_MSG_ID_HOME_POSITION], ACCEPTED),
        (REQUEST, [60_000], DENIED),
        (REQUEST, [mav.MAVLINK_MSG_ID_CAMERA_INFORMATION], DENIED),
        (SET_MODE, [1, 99], REJECTED),
    ],
)
def test_commands_are_acknowledged_as_px4_does(pilot, command, params, result):
    assert pilot.ask(command, *params) == result


def test_it_is_silent_when_a_component_is_meant_that_is_not_there(pilot):
    pilot.send(mav.MAVLink_command_long_message(1, 99, 31_999, 0, *[0.0] * 7))
    acks = [m.command for m in pilot.until_answered() if m.get_type() == "COMMAND_ACK"]
    assert acks == [mav.MAV_CMD_GET_MESSAGE_INTERVAL]


def test_it_says_what_it_is(pilot):
    beat = pilot.wait("HEARTBEAT")
    assert (beat.autopilot, beat.custom_mode) == (mav.MAV_AUTOPILOT_PX4, HOLD)
    pilot.ask(REQUEST, mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    bits = pilot.wait("AUTOPILOT_VERSION").capabilities
    assert bits & mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    assert not bits & mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST


def test_the_legacy_mode_message_is_acknowledged(pilot):
    pilot.send(mav.MAVLink_set_mode_message(1, 1 | ARMED, MISSION))
    assert pilot.wait("COMMAND_ACK").command == SET_MODE


def test_a_ping_is_answered(pilot):
    pilot.send(mav.MAVLink_ping_message(1, 77, 0, 0))
    answer = pilot.wait("PING")
    assert (answer.seq, answer.target_system) == (77, 255)


def test_a_mission_is_asked_for_with_mission_request_int(pilot):
    pilot.send(mav.MAVLink_mission_count_message(1, 1, 1, 0))
    assert pilot.wait("MISSION_REQUEST", "MISSION_REQUEST_INT").get_type() == "MISSION_REQUEST_INT"
    waypoint = 0, 6, mav.MAV_CMD_NAV_WAYPOINT, 1, 1, 0, 0, 0, 0, 473_978_000, 85_456_000, 5, 0
    pilot.send(mav.MAVLink_mission_item_int_message(1, 1, *waypoint))
    assert pilot.wait("MISSION_ACK").type == mav.MAV_MISSION_ACCEPTED
    pilot.send(mav.MAVLink_mission_request_list_message(1, 1, 0))
    assert pilot.wait("MISSION_COUNT").count == 1  # home is no item here
    pilot.send(mav.MAVLink_mission_clear_all_message(1, 1, 0))
    pilot.wait("MISSION_ACK")


@pytest.mark.parametrize("mode", [(6, 0), (4, 4)])
def test_it_does_not_arm_without_what_the_mode_needs(pilot, mode):
    """OFFBOARD needs setpoints, MISSION a mission."""
    assert pilot.ask(SET_MODE, 1, *mode) == ACCEPTED
    pilot.forget()
    assert pilot.ask(ARM, 1) == REJECTED
    refusal = "Arming denied", "Preflight Fail"
    pilot.wait("STATUSTEXT", where=lambda m: m.text.startswith(refusal))


def test_a_takeoff_is_a_mode_that_arming_begins(pilot):
    assert pilot.ask(TAKEOFF, NOTHING, 0, 0, NOTHING, NOTHING, NOTHING, NOTHING) == ACCEPTED
    pilot.wait("HEARTBEAT", where=in_mode(TAKING_OFF))
    assert pilot.ask(ARM, 1) == ACCEPTED
    pilot.wait("GLOBAL_POSITION_INT", where=lambda m: m.relative_alt > 2200)
    pilot.wait("HEARTBEAT", where=in_mode(HOLD))  # where it goes by itself
    assert pilot.ask(ARM, 0) == REJECTED
    assert pilot.ask(mav.MAV_CMD_NAV_LAND) == ACCEPTED
    pilot.wait("HEARTBEAT", where=lambda m: not m.base_mode & ARMED)


def loss_after(seconds):
    """Return what says how long OFFBOARD lives without setpoints."""
    kind = mav.MAV_PARAM_TYPE_REAL32
    return mav.MAVLink_param_set_message(1, 1, b"COM_OF_LOSS_T", seconds, kind)


def test_offboard_lives_as_long_as_its_setpoints(pilot):
    pilot.send(loss_after(60))  # until the last one, which may come late
    assert pilot.ask(TAKEOFF, NOTHING, 0, 0, NOTHING, NOTHING, NOTHING, NOTHING) == ACCEPTED
    assert pilot.ask(ARM, 1) == ACCEPTED
    pilot.wait("HEARTBEAT", where=in_mode(HOLD))
    began = pilot.wait("LOCAL_POSITION_NED").time_boot_ms
    while pilot.wait("LOCAL_POSITION_NED").time_boot_ms < began + 1500:  # comes at 10 Hz
        pilot.send(stay(1.0))
    assert pilot.ask(SET_MODE, 1, 6) == ACCEPTED
    pilot.wait("HEARTBEAT", where=in_mode(OFFBOARD))
    while pilot.wait("LOCAL_POSITION_NED").vx < 0.8:
        pilot.send(stay(1.0))
    question = mav.MAVLink_command_long_message(1, 1, 31_999, 0, *[0.0] * 7)
    together = [m.pack(pilot.link.mav) for m in (loss_after(1), stay(1.0), question)]
    pilot.forget()
    pilot.link.write(b"".join(together))  # one datagram: heard at one moment of the vehicle's time
    pilot.wait("COMMAND_ACK", where=lambda m: m.command == 31_999)
    last = pilot.wait("LOCAL_POSITION_NED").time_boot_ms
    pilot.wait("HEARTBEAT", where=in_mode(RETURN))
    lost = pilot.wait("LOCAL_POSITION_NED").time_boot_ms
    assert 900 <= lost - last <= 1300  # COM_OF_LOSS_T, and a look at it every 0.1 s
    assert any("ailsafe" in m.text for m in pilot.named("STATUSTEXT"))
