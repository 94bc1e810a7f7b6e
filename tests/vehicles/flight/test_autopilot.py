"""The vehicle arms, takes off and changes modes as its flight stack would, with our physics."""

from itertools import product
from math import degrees, inf, nan, pi

import pytest

from mavherd.transport.frames import wrap_angle, yaw_of
from mavherd.transport.mavlink import mav

ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED = 0, 1, 2, 3, 4
ARM, TAKEOFF, LAND, RTL, LOITER, SET_MODE = 400, 22, 21, 20, 17, 176
FORCE = 21196
POSITION, VELOCITY = 0xDF8, 0xDC7
COPTER = {
    "STABILIZE": 0,
    "ALT_HOLD": 2,
    "AUTO": 3,
    "GUIDED": 4,
    "LOITER": 5,
    "RTL": 6,
    "LAND": 9,
    "BRAKE": 17,
}
ROVER = {"MANUAL": 0, "HOLD": 4, "LOITER": 5, "AUTO": 10, "RTL": 11, "GUIDED": 15}
STACKS = ("ardupilot", "px4", "generic")
KINDS = ("quadcopter", "rover")
REFUSED = {"ardupilot": FAILED, "px4": REJECTED, "generic": FAILED}
CUSTOM, GUIDED, STABILIZED, STICKS, ARMED = 1, 8, 16, 64, 128  # MAV_MODE_FLAG


def up(height):
    return (0, 0, 0, 0, 0, 0, height)


def landed_state(desk):
    (_, m) = desk.ask(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE)
    return m.landed_state


# Arming


@pytest.mark.parametrize(("stack", "kind"), [*product(STACKS, KINDS)])
@pytest.mark.parametrize("value", [0.5, 2, -1, 0.999999, nan, inf, -inf, 1e38])
def test_only_exactly_0_and_1_arm_and_disarm(desk, stack, kind, value):
    vehicle = desk(kind, autopilot=stack)
    assert vehicle.command(ARM, value) == UNSUPPORTED
    assert not vehicle.autopilot.armed
    assert vehicle.command(ARM, 1) == ACCEPTED
    assert vehicle.command(ARM, value) == UNSUPPORTED
    assert vehicle.autopilot.armed


@pytest.mark.parametrize("kind", KINDS)
def test_arming_twice_and_disarming_twice_are_accepted(desk, kind):
    vehicle = desk(kind)
    for value in (0, 1, 1, 0, 0):
        assert vehicle.command(ARM, value) == ACCEPTED
        assert vehicle.autopilot.armed == bool(value)


def test_a_refused_arming_says_why(quad, texts):
    quad.mode("RTL")
    assert quad.arm() == FAILED
    assert texts(quad.run(0.1)) == ["Arm: RTL mode not armable"]
    assert not quad.autopilot.armed


def test_a_refused_arming_of_a_rover_says_why_as_ardurover_does(rover, texts):
    rover.mode("RTL")
    assert rover.arm() == FAILED
    assert texts(rover.run(0.1)) == ["Arm: Mode not armable"]


def test_auto_needs_a_mission_to_arm(quad, texts):
    assert quad.mode("AUTO") == ACCEPTED
    assert quad.arm() == FAILED
    assert texts(quad.run(0.1)) == ["Arm: Mode requires mission"]


@pytest.mark.parametrize("mode", sorted(set(COPTER) - {"RTL", "AUTO"}))
def test_a_landed_copter_arms_in_every_other_mode(quad, mode):
    assert quad.mode(mode) == ACCEPTED
    assert quad.arm() == ACCEPTED


@pytest.mark.parametrize("mode", sorted(set(ROVER) - {"RTL", "AUTO"}))
def test_a_rover_arms_in_every_other_mode(rover, mode):
    assert rover.mode(mode) == ACCEPTED
    assert rover.arm() == ACCEPTED


def test_arming_in_the_air_is_refused(quad, texts):
    quad.fly()
    quad.command(ARM, 0, FORCE)
    quad.run(0.1)
    assert quad.arm() == FAILED
    assert "Arm: in the air" in texts(quad.run(0.1))


def test_an_armed_copter_stands_with_idle_rotors_until_it_takes_off(quad):
    quad.mode("GUIDED")
    quad.arm()
    for _ in range(50):
        quad.run(0.1)
        assert quad.where[:6] == (0, 0, 0, 0, 0, 0)
        assert all(0 <= share < 0.2 for share in quad.vehicle.robot.outputs())
    assert min(quad.vehicle.robot.actuators()) > 0, "one sees that it is armed"
    assert quad.command(ARM, 0) == ACCEPTED
    quad.run(3)
    assert not any(quad.vehicle.robot.actuators())


def test_an_idle_copter_disarms_itself_after_ten_seconds(quad, texts):
    quad.arm()
    said = quad.run(9.9)
    assert quad.autopilot.armed
    said += quad.run(0.2)
    assert not quad.autopilot.armed
    assert texts(said) == ["Arming motors", "Disarming motors"]


def test_an_idle_rover_stays_armed(rover):
    rover.fly()
    rover.run(15)
    assert rover.autopilot.armed


def test_disarming_in_the_air_is_refused_except_by_force(quad, texts):
    quad.fly()
    assert quad.command(ARM, 0) == FAILED
    assert "Disarm: in the air" in texts(quad.run(0.1))
    quad.run(2)
    assert quad.autopilot.armed
    assert quad.where.down < -2.5
    assert quad.command(ARM, 0, FORCE) == ACCEPTED
    quad.run(0.5)
    assert quad.where.v_down > 3, "it must fall"
    quad.run(2)
    assert not quad.autopilot.in_air
    assert quad.vehicle.robot.impact_speed > 5


# Takeoff, and the whole life


def test_a_life_from_arming_to_disarming(quad, texts, of):
    said = quad.run(0.1)
    assert landed_state(quad) == mav.MAV_LANDED_STATE_ON_GROUND
    quad.mode("GUIDED")
    assert quad.arm() == ACCEPTED
    assert quad.command(TAKEOFF, *up(4)) == ACCEPTED
    said += quad.run(1.5)
    assert landed_state(quad) == mav.MAV_LANDED_STATE_TAKEOFF
    assert of(said, "HEARTBEAT")[-1].system_status == mav.MAV_STATE_ACTIVE
    said += quad.run(10)
    assert landed_state(quad) == mav.MAV_LANDED_STATE_IN_AIR
    assert quad.where.down == pytest.approx(-4, abs=0.1)
    assert quad.speed < 0.1
    assert quad.command(LAND) == ACCEPTED
    said += quad.run(1)
    assert landed_state(quad) == mav.MAV_LANDED_STATE_LANDING
    assert quad.autopilot.armed
    said += quad.run(12)
    assert landed_state(quad) == mav.MAV_LANDED_STATE_ON_GROUND
    assert not quad.autopilot.armed
    assert quad.where[:3] == pytest.approx((0, 0, 0), abs=0.1)
    assert quad.vehicle.robot.impact_speed < 1.0
    assert texts(said) == ["Arming motors", "Disarming motors"]


@pytest.mark.parametrize("sent_as", ["long", "int"])
def test_a_takeoff_is_metres_above_home_wherever_the_ground_is(desk, sent_as):
    roof = desk("quadcopter", down=-30.0)
    roof.mode("GUIDED")
    roof.arm()
    assert roof.command(TAKEOFF, *up(3), sent_as=sent_as) == ACCEPTED
    roof.run(8)
    assert roof.where.down == pytest.approx(-33, abs=0.2)


def test_arducopter_takes_a_takeoff_as_command_int_in_one_frame_only(quad):
    quad.mode("GUIDED")
    quad.arm()
    for frame in set(range(22)) - {mav.MAV_FRAME_GLOBAL_RELATIVE_ALT}:
        assert quad.command(TAKEOFF, *up(3), sent_as="int", frame=frame) == DENIED
    quad.run(1)
    assert not quad.autopilot.in_air


def test_a_generic_vehicle_heeds_the_frame_of_a_takeoff(desk):
    quad = desk("quadcopter", autopilot="generic")
    quad.mode("GUIDED")
    quad.arm()
    amsl = quad.autopilot.origin.alt_m + 3
    assert quad.command(TAKEOFF, *up(amsl), sent_as="int", frame=mav.MAV_FRAME_GLOBAL) == ACCEPTED
    quad.run(7)
    assert quad.where.down == pytest.approx(-3, abs=0.2)


@pytest.mark.parametrize(
    ("height", "result"), [(0, FAILED), (-1, FAILED), (1e5, FAILED), (nan, DENIED), (inf, DENIED)]
)
def test_a_takeoff_to_nowhere_is_refused(quad, height, result):
    quad.mode("GUIDED")
    quad.arm()
    assert quad.command(TAKEOFF, *up(height)) == result
    quad.run(1)
    assert not quad.autopilot.in_air


def test_a_takeoff_needs_arming_and_a_mode_that_flies_by_itself(quad):
    assert quad.command(TAKEOFF, *up(3)) == FAILED
    quad.mode("GUIDED")
    assert quad.command(TAKEOFF, *up(3)) == FAILED
    quad.arm()
    for mode in ("STABILIZE", "BRAKE", "LAND", "RTL"):
        quad.mode(mode)
        assert quad.command(TAKEOFF, *up(3)) == FAILED, mode
    quad.mode("GUIDED")
    assert quad.command(TAKEOFF, *up(3)) == ACCEPTED
    quad.run(6)
    assert quad.command(TAKEOFF, *up(3)) == FAILED, "it flies already"


@pytest.mark.parametrize("mode", ["LOITER", "ALT_HOLD"])
def test_a_takeoff_works_in_modes_that_hold_their_height_too(quad, mode):
    quad.mode(mode)
    quad.arm()
    assert quad.command(TAKEOFF, *up(3)) == ACCEPTED
    quad.run(12)
    assert quad.autopilot.mode.name == mode
    assert quad.where.down == pytest.approx(-3, abs=0.3)
    assert quad.speed < 0.1


def test_a_rover_does_not_take_off_and_does_not_land(rover):
    rover.fly()
    for sent_as in ("long", "int"):
        assert rover.command(TAKEOFF, *up(3), sent_as=sent_as) == UNSUPPORTED
        assert rover.command(LAND, sent_as=sent_as) == UNSUPPORTED


@pytest.mark.parametrize("mode", ["LOITER", "BRAKE", "STABILIZE"])
def test_a_change_of_mode_ends_a_takeoff(quad, mode):
    quad.mode("GUIDED")
    quad.arm()
    quad.command(TAKEOFF, *up(20))
    quad.run(3)
    quad.mode(mode)
    quad.run(8)
    assert quad.autopilot.climb is None
    assert -10 < quad.where.down < -1
    assert quad.speed < 0.1


def test_a_takeoff_through_the_ceiling_of_the_fence_does_what_the_fence_says(desk, texts):
    fence = {"FENCE_ENABLE": 1, "FENCE_TYPE": 1, "FENCE_ALT_MAX": 6, "FENCE_ACTION": 1}
    quad = desk("quadcopter", params=fence)
    quad.mode("GUIDED")
    quad.arm()
    assert quad.command(TAKEOFF, *up(9)) == ACCEPTED
    said = texts(quad.run(10))
    assert any("Max Alt" in text for text in said)
    assert quad.autopilot.mode.name == "RTL"


def test_a_takeoff_beyond_a_fence_that_only_reports_ends_where_it_was_sent(desk):
    fence = {"FENCE_ENABLE": 1, "FENCE_TYPE": 1, "FENCE_ALT_MAX": 5, "FENCE_ACTION": 0}
    quad = desk("quadcopter", params=fence)
    quad.fly(7)
    quad.run(10)
    assert quad.where.down == pytest.approx(-7, abs=0.2)


def test_a_heading_asked_for_in_a_takeoff_is_taken_and_kept(quad):
    quad.mode("GUIDED")
    quad.arm()
    quad.command(TAKEOFF, *up(12))
    quad.run(1)
    assert quad.command(mav.MAV_CMD_CONDITION_YAW, 90, 30, 1, 0) == ACCEPTED
    quad.run(3.5)
    assert quad.where.down > -11.5, "it still climbs"
    assert abs(wrap_angle(quad.yaw - pi / 2)) < 0.2
    quad.run(10)
    assert abs(wrap_angle(quad.yaw - pi / 2)) < 0.05
    assert quad.where.down == pytest.approx(-12, abs=0.1)


# PX4


def test_px4_takes_off_disarmed_then_armed_climbs_and_holds(desk, texts):
    quad = desk("quadcopter", autopilot="px4", down=-5.0)
    amsl = quad.autopilot.origin.alt_m + 5 + 4
    assert quad.command(TAKEOFF, 0, 0, 0, nan, nan, nan, amsl) == ACCEPTED
    assert quad.autopilot.mode.name == "TAKEOFF"
    assert quad.run(1)
    assert not quad.autopilot.in_air
    assert quad.arm() == ACCEPTED
    assert landed_state(quad) == mav.MAV_LANDED_STATE_ON_GROUND
    said = quad.run(1)
    assert landed_state(quad) == mav.MAV_LANDED_STATE_TAKEOFF
    said += quad.run(9)
    assert quad.autopilot.mode.name == "HOLD"
    assert quad.where.down == pytest.approx(-9, abs=0.05)
    assert texts(said) == ["Armed by external command"]


@pytest.mark.parametrize("below", [nan, 0.0, -20.0])
def test_px4_takes_a_default_height_where_none_is_given(desk, below, texts):
    quad = desk("quadcopter", autopilot="px4", params={"MIS_TAKEOFF_ALT": 3.5})
    amsl = quad.autopilot.origin.alt_m + below
    assert quad.arm() == ACCEPTED
    assert quad.command(TAKEOFF, 0, 0, 0, 0, 0, 0, amsl) == ACCEPTED
    assert "Using default takeoff altitude: 3.5 m" in texts(quad.run(8))
    assert quad.where.down == pytest.approx(-3.5, abs=0.3)


def test_px4_armed_in_hold_and_left_alone_disarms_again(desk, texts):
    quad = desk("quadcopter", autopilot="px4")
    assert quad.arm() == ACCEPTED
    said = texts(quad.run(11))
    assert said == ["Armed by external command", "Disarmed by auto preflight disarming"]


def test_px4_offboard_is_entered_without_setpoints_but_not_armed(desk, texts):
    quad = desk("quadcopter", autopilot="px4")
    assert quad.mode("OFFBOARD") == ACCEPTED
    assert quad.arm() == REJECTED
    assert "Arming denied: Resolve system health failures first" in "".join(texts(quad.run(0.1)))
    quad.stream(quad.target(POSITION, z=-3), 1.2)
    assert quad.arm() == ACCEPTED


def test_px4_in_the_air_does_not_enter_offboard_without_setpoints(desk, texts):
    quad = desk("quadcopter", autopilot="px4")
    quad.arm()
    quad.command(TAKEOFF, *up(nan))
    quad.run(6)
    assert quad.mode("OFFBOARD") == REJECTED
    assert quad.autopilot.mode.name == "HOLD"
    assert any("OFFBOARD" in text for text in texts(quad.run(0.1)))
    quad.stream(quad.target(POSITION, z=-3), 0.5)
    assert quad.mode("OFFBOARD") == ACCEPTED


def test_px4_targets_take_off(desk):
    quad = desk("quadcopter", autopilot="px4")
    quad.stream(quad.target(POSITION, z=-4), 0.5)
    quad.mode("OFFBOARD")
    assert quad.arm() == ACCEPTED
    quad.stream(quad.target(POSITION, z=-4), 8)
    assert quad.where.down == pytest.approx(-4, abs=0.2)


def test_px4_stands_on_the_ground_while_the_target_is_there(desk):
    quad = desk("quadcopter", autopilot="px4")
    quad.stream(quad.target(POSITION), 0.5)
    quad.mode("OFFBOARD")
    quad.arm()
    quad.stream(quad.target(POSITION), 5)
    assert quad.where.down == pytest.approx(0, abs=0.05)


def test_px4_without_setpoints_returns(desk, texts):
    quad = desk("quadcopter", autopilot="px4")
    quad.stream(quad.target(POSITION, z=-4), 0.5)
    quad.mode("OFFBOARD")
    quad.arm()
    quad.stream(quad.target(POSITION, x=5, z=-4), 8)
    said = texts(quad.run(0.8))
    assert said == []
    said = texts(quad.run(0.5))
    assert "Failsafe activated" in said
    assert quad.autopilot.mode.name == "RTL"


def test_px4_keeps_the_last_target_until_the_failsafe_however_late_it_comes(desk):
    quad = desk("quadcopter", autopilot="px4", params={"COM_OF_LOSS_T": 10.0})
    quad.stream(quad.target(POSITION, z=-4), 0.5)
    quad.mode("OFFBOARD")
    quad.arm()
    quad.stream(quad.target(POSITION, z=-4), 6)
    quad.stream(quad.target(VELOCITY, vx=1.0), 2)
    quad.run(6)
    assert quad.where.v_north == pytest.approx(1.0, abs=0.15)


def test_px4_does_not_count_invalid_setpoints_as_a_stream(desk, texts):
    quad = desk("quadcopter", autopilot="px4")
    quad.stream(quad.target(POSITION, z=-4), 0.5)
    quad.mode("OFFBOARD")
    quad.arm()
    quad.stream(quad.target(POSITION, z=-4), 6)
    said = texts(quad.stream(quad.target(0xFFF), 2))
    assert "SET_POSITION_TARGET_LOCAL_NED invalid" in said
    assert "Failsafe activated" in said
    assert quad.autopilot.mode.name == "RTL"


# Modes


def custom_mode(desk, of):
    return of(desk.run(1.1), "HEARTBEAT")[-1].custom_mode


@pytest.mark.parametrize(
    ("kind", "modes", "boot"), [("quadcopter", COPTER, "STABILIZE"), ("rover", ROVER, "MANUAL")]
)
def test_mode_numbers_are_ardupilots(desk, kind, modes, boot, texts, of):
    vehicle = desk(kind)
    assert custom_mode(vehicle, of) == modes[boot]
    for number in range(40):
        vehicle.run(1.1)  # the same text is said once a second
        known = number in modes.values()
        if number == ROVER["AUTO"] and kind == "rover":
            continue  # needs a mission
        assert vehicle.command(SET_MODE, 1, number) == (ACCEPTED if known else FAILED)
        said = vehicle.run(0.01)
        if known:
            assert custom_mode(vehicle, of) == number
        else:
            (text,) = texts(said)
            assert text == f"No such mode {number}" or text.endswith(" is not supported")


def test_a_mode_that_ardupilot_has_and_we_do_not_is_refused_by_name(quad, rover, texts):
    for vehicle, number, name in ((quad, 7, "CIRCLE"), (quad, 21, "SMART_RTL"), (rover, 1, "ACRO")):
        assert vehicle.command(SET_MODE, 1, number) == FAILED
        assert f"Mode {name} is not supported" in texts(vehicle.run(0.01))


@pytest.mark.parametrize(
    ("kind", "modes"),
    [
        (
            "quadcopter",
            {
                "ALTCTL": (2, 0),
                "POSCTL": (3, 0),
                "TAKEOFF": (4, 2),
                "HOLD": (4, 3),
                "MISSION": (4, 4),
                "RTL": (4, 5),
                "LAND": (4, 6),
                "OFFBOARD": (6, 0),
                "STABILIZED": (7, 0),
            },
        ),
        (
            "rover",
            {
                "MANUAL": (1, 0),
                "POSCTL": (3, 0),
                "HOLD": (4, 3),
                "MISSION": (4, 4),
                "RTL": (4, 5),
                "OFFBOARD": (6, 0),
            },
        ),
    ],
)
def test_mode_numbers_are_px4s(desk, kind, modes, texts, of):
    vehicle = desk(kind, autopilot="px4")
    assert custom_mode(vehicle, of) == 4 << 16 | 3 << 24, "boots in HOLD"
    for main, sub in product(range(12), range(10)):
        vehicle.run(1.1)
        known = (main, sub) in modes.values()
        result = vehicle.command(SET_MODE, 1, main, sub)
        assert result == (ACCEPTED if known else REJECTED), (main, sub)
        said = texts(vehicle.run(0.01))
        if known:
            assert custom_mode(vehicle, of) == main << 16 | sub << 24
        else:
            (text,) = said
            assert text == "Unsupported main mode" or text.endswith(" is not supported")


@pytest.mark.parametrize("value", [nan, inf, -1.0, 3e38, -3e38])
@pytest.mark.parametrize("stack", STACKS)
def test_absurd_modes_are_refused(desk, stack, value):
    vehicle = desk("rover", autopilot=stack)
    assert vehicle.command(SET_MODE, 1, value, value) in (DENIED, REFUSED[stack])
    assert vehicle.command(SET_MODE, 1, 4, value) in (DENIED, REFUSED[stack], ACCEPTED)
    assert vehicle.command(SET_MODE, value, 4, 3) in (DENIED, ACCEPTED)
    vehicle.run(0.1)


def test_the_legacy_set_mode_message_is_obeyed_without_an_ack(quad, of):
    assert quad.send(mav.MAVLink_set_mode_message(1, 1, COPTER["GUIDED"])) == []
    assert of(quad.run(0.01), "HEARTBEAT")[-1].custom_mode == COPTER["GUIDED"]


@pytest.mark.parametrize(("stack", "mode"), [("px4", 4 << 16 | 5 << 24), ("generic", 5)])
def test_the_legacy_set_mode_message_is_acknowledged_by_others(desk, stack, mode, of):
    quad = desk("quadcopter", autopilot=stack)
    (ack,) = quad.send(mav.MAVLink_set_mode_message(1, 1, mode))
    assert (ack.command, ack.result) == (SET_MODE, ACCEPTED)
    assert of(quad.run(0.01), "HEARTBEAT")[-1].custom_mode == mode
    (ack,) = quad.send(mav.MAVLink_set_mode_message(1, 1, 99))
    assert (ack.command, ack.result) == (SET_MODE, REFUSED[stack])


@pytest.mark.parametrize("stack", STACKS)
def test_a_mode_that_is_not_custom_is_denied(desk, stack):
    quad = desk("quadcopter", autopilot=stack)
    before = quad.autopilot.mode
    assert quad.command(SET_MODE, 0, COPTER["GUIDED"]) == DENIED
    quad.send(mav.MAVLink_set_mode_message(1, 0, COPTER["GUIDED"]))
    assert quad.autopilot.mode is before


def test_the_commands_that_are_modes(desk):
    for stack, loiter in (("ardupilot", "LOITER"), ("px4", "HOLD")):
        quad = desk("quadcopter", autopilot=stack)
        for command, name in ((LAND, "LAND"), (RTL, "RTL"), (LOITER, loiter)):
            for sent_as in ("long", "int"):
                assert quad.command(command, sent_as=sent_as) == ACCEPTED
                assert quad.autopilot.mode.name == name
    rover = desk("rover")
    assert rover.command(RTL) == ACCEPTED
    assert rover.autopilot.mode.name == "RTL"
    assert rover.command(LOITER) == UNSUPPORTED, "ArduRover has no such command"


def test_a_change_of_mode_or_arming_is_in_one_heartbeat_at_once(quad, of):
    quad.run(0.5)
    flags = CUSTOM | STABILIZED | STICKS
    quad.mode("GUIDED")
    (m,) = of(quad.run(0.01), "HEARTBEAT")
    assert (m.custom_mode, m.base_mode) == (COPTER["GUIDED"], flags | GUIDED)
    quad.arm()
    (m,) = of(quad.run(0.01), "HEARTBEAT")
    assert m.base_mode == flags | GUIDED | ARMED
    quad.command(ARM, 0)
    (m,) = of(quad.run(0.01), "HEARTBEAT")
    assert m.base_mode == flags | GUIDED
    quad.mode("STABILIZE")
    (m,) = of(quad.run(0.01), "HEARTBEAT")
    assert m.base_mode == flags
    quad.mode("STABILIZE")
    assert of(quad.run(0.01), "HEARTBEAT") == [], "nothing has changed"


def test_a_mode_and_arming_at_once_are_one_heartbeat(quad, of):
    quad.run(0.5)
    quad.mode("GUIDED")
    quad.arm()
    (m,) = of(quad.run(0.01), "HEARTBEAT")
    assert (m.custom_mode, m.base_mode & ARMED) == (COPTER["GUIDED"], ARMED)


def test_a_rovers_flags_and_status_are_ardurovers(rover, of):
    for mode, number in ROVER.items():
        if mode == "AUTO":
            continue
        rover.mode(mode)
        m = of(rover.run(1.1), "HEARTBEAT")[-1]
        assert (m.type, m.autopilot, m.custom_mode) == (10, 3, number)
        sticks = {"MANUAL": STICKS, "HOLD": 0}.get(mode, GUIDED)
        assert m.base_mode == CUSTOM | sticks
        active = mav.MAV_STATE_STANDBY if mode == "HOLD" else mav.MAV_STATE_ACTIVE
        assert m.system_status == active


def test_unspoken_links_hear_of_a_change_at_once_too(quad):
    quad.run(0.5)
    shy = quad.vehicle.converse()
    quad.mode("GUIDED")
    quad.autopilot.say("not for the shy")
    quad.vehicle.step()
    data = quad.vehicle.report(shy, quad.vehicle.take_broadcasts())
    assert [m.get_type() for m in quad.codec.decode(data)] == ["HEARTBEAT"]


@pytest.mark.parametrize("mode", ["LOITER", "BRAKE"])
def test_leaving_guided_stops_a_copter_and_forgets_its_target(quad, mode):
    quad.fly()
    quad.send(quad.target(POSITION, x=50, z=-3))
    quad.run(3)
    assert quad.speed > 0.5
    quad.mode(mode)
    quad.run(8)
    assert quad.speed < 0.1
    stopped_at = quad.where.north
    quad.mode("GUIDED")
    quad.run(5)
    assert quad.where.north == pytest.approx(stopped_at, abs=0.3)


# Reboot


def test_a_reboot_takes_up_what_needs_one_and_starts_time_anew(quad, of):
    robot = quad.vehicle.robot
    mass = robot._params.mass
    quad.run(5)
    name, kind = b"HERD_MASS", mav.MAV_PARAM_TYPE_REAL32
    quad.send(mav.MAVLink_param_set_message(1, 1, name, mass * 1.2, kind))
    assert quad.vehicle.robot._params.mass == mass, "not before a reboot"
    assert quad.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == ACCEPTED
    said = quad.run(2)
    assert quad.vehicle.robot._params.mass == pytest.approx(mass * 1.2)
    assert max(m.time_boot_ms for m in of(said, "ATTITUDE")) < 2100
    quad.autopilot = quad.vehicle.autopilot
    quad.fly()


def test_a_reboot_keeps_links_place_parameters_and_missions(desk, of):
    rover = desk("rover")
    rover.fly()
    rover.stream(rover.target(VELOCITY, vx=1.0), 3)
    rover.command(ARM, 0)
    rover.run(3)
    place = rover.where[:3]
    rover.send(mav.MAVLink_param_set_message(1, 1, b"WP_RADIUS", 1.5, 9))
    other = rover.vehicle.converse(spoken=True)
    assert rover.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == ACCEPTED
    rover.run(1)
    assert rover.where[:3] == place
    assert rover.vehicle.settings.waypoint_radius == 1.5
    assert rover.vehicle.autopilot.mode.name == "MANUAL", "as after any boot"
    assert not rover.vehicle.autopilot.armed
    rover.link = other
    assert of(rover.run(1.1), "HEARTBEAT")
    assert rover.command(SET_MODE, 1, ROVER["HOLD"]) == ACCEPTED


def test_nothing_is_armed_that_is_about_to_reboot(quad):
    assert quad.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == ACCEPTED
    assert quad.command(ARM, 1) == FAILED
    quad.run(0.02)
    assert quad.command(ARM, 1) == ACCEPTED


def test_a_reboot_is_refused_while_armed_and_for_anything_but_1(quad, texts):
    reboot = mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
    for value in (0, 2, 3, nan, inf, 0.5):
        assert quad.command(reboot, value) == UNSUPPORTED
    quad.arm()
    quad.run(1)
    assert quad.command(reboot, 1) == FAILED
    assert any("armed" in text for text in texts(quad.run(0.1)))
    assert quad.vehicle.boots == 0
    assert quad.autopilot.armed


def test_a_reboot_is_refused_in_the_air_where_it_would_stand_on_nothing(quad, texts):
    quad.fly(10)
    assert quad.command(ARM, 0, 21196) == ACCEPTED
    quad.run(0.3)
    assert quad.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == FAILED
    assert "Reboot refused: in the air" in texts(quad.run(0.1))
    quad.run(5)
    assert quad.where.down == 0, "it has fallen"
    assert quad.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == ACCEPTED


def test_a_takeoff_to_below_where_the_vehicle_stands_fails(quad):
    quad.autopilot.set_home(quad.autopilot.home._replace(down=50.0))  # it stands on a hill
    assert quad.command(SET_MODE, 1, quad.guided) == ACCEPTED
    assert quad.arm() == ACCEPTED
    assert quad.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 5) == FAILED
    assert quad.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 53) == ACCEPTED
    quad.run(6)
    assert quad.where.down == pytest.approx(-3, abs=0.3)


def test_px4s_mode_takeoff_climbs_to_the_parameter_unless_the_command_has_said(desk):
    quad = desk("quadcopter", autopilot="px4")
    amsl = quad.autopilot.origin.alt_m + 10
    assert quad.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, amsl) == ACCEPTED
    assert quad.mode("HOLD") == ACCEPTED, "somebody has changed his mind"
    quad.autopilot.parameters.set("MIS_TAKEOFF_ALT", 4)
    assert quad.mode("TAKEOFF") == ACCEPTED
    assert quad.arm() == ACCEPTED
    quad.run(10)
    assert quad.where.down == pytest.approx(-4, abs=0.3)


def test_px4s_targets_outside_offboard_leave_the_nose_alone(desk):
    quad = desk("quadcopter", autopilot="px4")
    assert quad.mode("TAKEOFF") == ACCEPTED
    assert quad.arm() == ACCEPTED
    quad.run(8)
    assert quad.autopilot.mode.name == "HOLD"
    quad.autopilot.gaze.look_at(quad.autopilot.home._replace(east=30.0))
    quad.stream(quad.target(0x9C7, vx=1.0, yaw=-1.0), 1)
    nose = quad.autopilot.gaze.apply(quad.autopilot.behaviour.update()).yaw
    assert nose == pytest.approx(1.57, abs=0.01), "still at its region of interest"


@pytest.mark.parametrize("mode", ["LAND", "RTL"])
def test_a_copter_stops_first_and_does_not_fly_back(desk, mode):
    quad = desk("quadcopter", profile="ardupilot")
    quad.fly()
    quad.stream(quad.target(VELOCITY, vx=5), 4)
    begun = quad.where.north
    quad.mode(mode)
    quad.run(4)
    stopped = quad.where.north
    assert begun + 2 < stopped < begun + 10
    quad.run(2)
    assert quad.where.north == pytest.approx(stopped, abs=0.3)


@pytest.mark.parametrize(("behaviour", "expected"), [(None, 90), (0, 0)])
def test_the_nose_faces_the_way_of_a_target_without_a_yaw(desk, behaviour, expected):
    params = {} if behaviour is None else {"WP_YAW_BEHAVIOR": behaviour}
    quad = desk("quadcopter", profile="ardupilot", params=params)
    quad.fly()
    quad.send(quad.target(POSITION, y=20, z=-3))
    quad.run(8)
    assert degrees(yaw_of(quad.where[6:10])) == pytest.approx(expected, abs=3)
    quad.send(quad.target(0x9F8, y=20, z=-3, yaw=-1))
    quad.run(5)
    quad.send(quad.target(POSITION, y=20, z=-3))
    quad.run(3)
    assert yaw_of(quad.where[6:10]) == pytest.approx(-1, abs=0.05), "it stands still"


def test_terminating_a_flight_stops_the_motors(quad):
    quad.fly()
    for value, refusal in ((0, FAILED), (0.4, FAILED), (nan, DENIED)):
        assert quad.command(mav.MAV_CMD_DO_FLIGHTTERMINATION, value) == refusal
        assert quad.autopilot.armed
    assert quad.command(mav.MAV_CMD_DO_FLIGHTTERMINATION, 1) == ACCEPTED
    assert not quad.autopilot.armed
    quad.run(0.5)
    assert quad.where.v_down > 3


def test_long_texts_arrive_whole(quad, texts):
    words = "a text that is longer than the fifty characters that one STATUSTEXT can hold, by far"
    quad.autopilot.say(words)
    assert "".join(texts(quad.run(0.1))) == words
