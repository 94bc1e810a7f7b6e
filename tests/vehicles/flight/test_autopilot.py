"""The vehicle arms, flies, lands and disarms as ArduPilot would, with the physics it has."""

from math import cos, hypot, inf, nan, pi, radians, sin

import pytest

from mavherd.transport.frames import wrap_angle, yaw_of
from mavherd.transport.mavlink import mav
from mavherd.vehicles.flight.autopilot import DISARM_DELAY, RTL_ALTITUDE

ACCEPTED, DENIED, FAILED = 0, 2, 4
ARM, TAKEOFF, LAND, RTL, SET_MODE = 400, 22, 21, 20, 176
FORCE = 21196
POSITION, POSITION_YAW, VELOCITY, VELOCITY_TURN = 0xDF8, 0x9F8, 0xDC7, 0x5C7
COPTER = {"GUIDED": 4, "LOITER": 5, "RTL": 6, "LAND": 9, "BRAKE": 17}
ROVER = {"HOLD": 4, "LOITER": 5, "RTL": 11, "GUIDED": 15}


def heartbeats(messages):
    return [m for m in messages if m.get_type() == "HEARTBEAT"]


def echoes(messages):
    return [m for m in messages if m.get_type() == "POSITION_TARGET_LOCAL_NED"]


def landed_state(desk):
    (_, m) = desk.ask(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE)
    return m.landed_state


def speed(desk):
    k = desk.where
    return hypot(k.v_north, k.v_east, k.v_down)


def stream(desk, message, seconds, every=0.1):
    """Send the same target again and again, as clients do."""
    out = []
    for _ in range(round(seconds / every)):
        desk.send(message)
        out += desk.run(every)
    return out


# Arming


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
@pytest.mark.parametrize("value", [0.5, 2, -1, 0.999999, nan, inf, -inf, 1e38])
def test_only_exactly_0_and_1_arm_and_disarm(desk, kind, value):
    vehicle = desk(kind)
    assert vehicle.command(ARM, value) == DENIED
    assert not vehicle.autopilot.armed
    assert vehicle.command(ARM, 1) == ACCEPTED
    assert vehicle.command(ARM, value) == DENIED
    assert vehicle.autopilot.armed


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_arming_twice_and_disarming_twice_are_accepted(desk, kind):
    vehicle = desk(kind)
    for value in (0, 1, 1, 0, 0):
        assert vehicle.command(ARM, value) == ACCEPTED
        assert vehicle.autopilot.armed == bool(value)


def test_a_refused_arming_says_why(quad, texts):
    quad.command(SET_MODE, 1, COPTER["RTL"])
    assert quad.command(ARM, 1) == FAILED
    assert texts(quad.run(0.1)) == ["Arm: RTL mode not armable"]
    assert not quad.autopilot.armed


@pytest.mark.parametrize("mode", ["GUIDED", "LOITER", "LAND", "BRAKE"])
def test_a_landed_copter_arms_in_every_other_mode(quad, mode):
    quad.command(SET_MODE, 1, COPTER[mode])
    assert quad.command(ARM, 1) == ACCEPTED


def test_arming_in_the_air_is_refused(quad, texts):
    quad.fly()
    quad.command(ARM, 0, FORCE)
    quad.run(0.1)
    assert quad.command(ARM, 1) == FAILED
    assert "Arm: in the air" in texts(quad.run(0.1))


def test_an_armed_copter_stands_with_still_rotors_until_it_takes_off(quad):
    quad.command(SET_MODE, 1, COPTER["GUIDED"])
    quad.command(ARM, 1)
    for _ in range(50):
        quad.run(0.01)
        assert not any(quad.vehicle.robot.actuators())


def test_an_idle_copter_disarms_itself_after_ten_seconds(quad, texts):
    quad.command(ARM, 1)
    said = quad.run(DISARM_DELAY - 0.1)
    assert quad.autopilot.armed
    said += quad.run(0.2)
    assert not quad.autopilot.armed
    assert texts(said) == ["Arming motors", "Disarming motors"]


def test_an_idle_rover_stays_armed(rover):
    rover.fly()
    rover.run(DISARM_DELAY + 5)
    assert rover.autopilot.armed


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_home_is_where_it_was_armed(desk, kind):
    vehicle = desk(kind, north=12.0, east=-7.0, down=-3.0, yaw=1.0)
    if kind == "rover":
        vehicle.fly()
        stream(vehicle, vehicle.target(VELOCITY, vx=1.0), 5)
        vehicle.command(ARM, 0)
        vehicle.run(5)
    k = vehicle.where
    vehicle.command(ARM, 1)
    (_, home) = vehicle.ask(mav.MAV_CMD_GET_HOME_POSITION)
    assert (home.x, home.y, home.z) == pytest.approx(k[:3], abs=1e-4)
    assert yaw_of(home.q) == pytest.approx(yaw_of(k[6:10]), abs=1e-5)


# Takeoff, landing, the whole life


def test_a_life_from_arming_to_disarming(quad, texts):
    said = quad.run(0.1)
    assert landed_state(quad) == mav.MAV_LANDED_STATE_ON_GROUND
    quad.command(SET_MODE, 1, COPTER["GUIDED"])
    assert quad.command(ARM, 1) == ACCEPTED
    assert quad.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 4) == ACCEPTED
    said += quad.run(1.5)
    assert landed_state(quad) == mav.MAV_LANDED_STATE_TAKEOFF
    assert heartbeats(said)[-1].system_status == mav.MAV_STATE_ACTIVE
    said += quad.run(10)
    assert landed_state(quad) == mav.MAV_LANDED_STATE_IN_AIR
    assert quad.where.down == pytest.approx(-4, abs=0.1)
    assert speed(quad) < 0.1
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


def test_a_takeoff_is_metres_above_home_wherever_the_ground_is(desk):
    roof = desk("quadcopter", down=-30.0)
    roof.command(SET_MODE, 1, COPTER["GUIDED"])
    roof.command(ARM, 1)
    roof.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 3)
    roof.run(8)
    assert roof.where.down == pytest.approx(-33, abs=0.2)


@pytest.mark.parametrize("height", [0, -1, nan, inf, 1e5])
def test_a_takeoff_to_nowhere_is_refused(quad, height):
    quad.command(SET_MODE, 1, COPTER["GUIDED"])
    quad.command(ARM, 1)
    assert quad.command(TAKEOFF, 0, 0, 0, 0, 0, 0, height) == FAILED
    quad.run(1)
    assert not quad.autopilot.in_air


def test_a_takeoff_needs_arming_and_guided(quad):
    up = (0, 0, 0, 0, 0, 0, 3)
    assert quad.command(TAKEOFF, *up) == FAILED
    quad.command(SET_MODE, 1, COPTER["GUIDED"])
    assert quad.command(TAKEOFF, *up) == FAILED
    quad.command(ARM, 1)
    quad.command(SET_MODE, 1, COPTER["LOITER"])
    assert quad.command(TAKEOFF, *up) == FAILED
    quad.command(SET_MODE, 1, COPTER["GUIDED"])
    assert quad.command(TAKEOFF, *up) == ACCEPTED
    quad.run(6)
    assert quad.command(TAKEOFF, *up) == FAILED, "it flies already"


def test_a_rover_does_not_take_off_and_does_not_land(rover):
    rover.fly()
    assert rover.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 3) == mav.MAV_RESULT_UNSUPPORTED
    assert rover.command(LAND) == mav.MAV_RESULT_UNSUPPORTED


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


def test_a_landing_comes_down_where_it_was_ordered(quad):
    quad.fly()
    stream(quad, quad.target(VELOCITY, vx=1.0, vy=1.0), 3)
    k = quad.where
    quad.command(LAND)
    quad.run(15)
    assert not quad.autopilot.armed
    assert hypot(quad.where.north - k.north, quad.where.east - k.east) < 1.0


def test_a_landed_and_disarmed_copter_flies_again(quad):
    for _ in range(2):
        quad.fly(2)
        quad.command(LAND)
        quad.run(9)
        assert not quad.autopilot.armed


def test_a_copter_flown_into_the_ground_stays_there_and_disarms(quad):
    quad.fly(2)
    stream(quad, quad.target(VELOCITY, vz=0.7), 5)
    assert not quad.autopilot.in_air
    quad.run(DISARM_DELAY)
    assert not quad.autopilot.armed


# Modes


@pytest.mark.parametrize(
    ("kind", "modes"), [("quadcopter", COPTER), ("rover", ROVER)], ids=["copter", "rover"]
)
def test_mode_numbers_are_ardupilots(desk, kind, modes, texts):
    vehicle = desk(kind)
    for number in range(30):
        vehicle.run(1.1)  # the same text is said once a second
        known = number in modes.values()
        assert vehicle.command(SET_MODE, 1, number) == (ACCEPTED if known else FAILED)
        said = vehicle.run(0.01)
        if known:
            assert vehicle.autopilot.identity.number(vehicle.autopilot.mode) == number
        else:
            assert texts(said) == [f"No such mode {number}"]
    names = {name: number for number, name in vehicle.autopilot.identity.modes.values()}
    assert names == modes


def test_the_legacy_set_mode_message_is_obeyed_without_an_ack(quad):
    assert quad.send(mav.MAVLink_set_mode_message(1, 1, COPTER["GUIDED"])) == []
    assert heartbeats(quad.run(0.01))[-1].custom_mode == COPTER["GUIDED"]


def test_a_mode_that_is_not_custom_is_unsupported(quad):
    assert quad.command(SET_MODE, 0, COPTER["GUIDED"]) == mav.MAV_RESULT_UNSUPPORTED
    assert quad.autopilot.mode.name == "LOITER"


def test_a_change_of_mode_or_arming_is_in_a_heartbeat_at_once(quad):
    quad.run(0.5)
    quad.command(SET_MODE, 1, COPTER["GUIDED"])
    (m,) = heartbeats(quad.run(0.01))
    assert (m.custom_mode, m.base_mode) == (COPTER["GUIDED"], 1 | 8)
    quad.command(ARM, 1)
    (m,) = heartbeats(quad.run(0.01))
    assert m.base_mode == 1 | 8 | 128
    quad.command(ARM, 0)
    (m,) = heartbeats(quad.run(0.01))
    assert m.base_mode == 1 | 8


def test_unspoken_links_hear_of_a_change_at_once_too(quad):
    quad.run(0.5)
    shy = quad.vehicle.converse()
    quad.command(SET_MODE, 1, COPTER["GUIDED"])
    quad.autopilot.say("not for the shy")
    quad.vehicle.step()
    data = quad.vehicle.report(shy, quad.vehicle.take_broadcasts())
    assert [m.get_type() for m in quad.codec.decode(data)] == ["HEARTBEAT"]


@pytest.mark.parametrize("mode", ["LOITER", "BRAKE"])
def test_leaving_guided_stops_a_copter_and_forgets_its_target(quad, mode):
    quad.fly()
    quad.send(quad.target(POSITION, x=50, z=-3))
    quad.run(3)
    assert speed(quad) > 0.5
    quad.command(SET_MODE, 1, COPTER[mode])
    quad.run(8)
    assert speed(quad) < 0.1
    stopped_at = quad.where.north
    quad.command(SET_MODE, 1, COPTER["GUIDED"])
    quad.run(5)
    assert quad.where.north == pytest.approx(stopped_at, abs=0.3)


def test_a_return_climbs_flies_home_lands_and_disarms(quad):
    quad.fly()
    quad.send(quad.target(POSITION, x=6, y=-4, z=-3))
    quad.run(15)
    assert quad.command(RTL) == ACCEPTED
    top, low_while_away = 0.0, inf
    for _ in range(120):
        quad.run(1)
        k = quad.where
        top = max(top, -k.down)
        if hypot(k.north, k.east) > 5 and -k.down > 10:
            low_while_away = min(low_while_away, -k.down)
        if not quad.autopilot.armed:
            break
    assert top == pytest.approx(RTL_ALTITUDE, abs=0.5)
    assert not quad.autopilot.armed
    assert quad.where[:3] == pytest.approx((0, 0, 0), abs=0.3)
    assert quad.autopilot.mode.name == "LAND"


def test_a_return_from_above_does_not_come_down_first(quad):
    quad.fly(20)
    quad.send(quad.target(POSITION, x=5, z=-20))
    quad.run(12)
    quad.command(RTL)
    for _ in range(40):
        quad.run(0.25)
        if hypot(quad.where.north, quad.where.east) > 0.5:
            assert -quad.where.down > 19


def test_a_rover_returns_home_and_stops(rover):
    rover.fly()
    rover.send(rover.target(POSITION, x=4, y=3))
    rover.run(20)
    assert hypot(rover.where.north - 4, rover.where.east - 3) < 0.3
    assert rover.command(RTL) == ACCEPTED
    rover.run(25)
    assert hypot(rover.where.north, rover.where.east) < 0.3
    assert rover.autopilot.mode.name == "HOLD"
    assert rover.autopilot.armed
    assert speed(rover) < 0.01


def test_a_return_on_the_ground_stays_there(quad):
    quad.command(SET_MODE, 1, COPTER["GUIDED"])
    quad.command(ARM, 1)
    quad.command(RTL)
    quad.run(DISARM_DELAY + 1)
    assert quad.where[:3] == (0, 0, 0)
    assert not quad.autopilot.armed


# Setpoints


def test_setpoints_are_heard_in_guided_only(quad):
    quad.fly()
    quad.command(SET_MODE, 1, COPTER["LOITER"])
    quad.run(3)
    k = quad.where
    out = stream(quad, quad.target(POSITION, x=20, z=-3), 3)
    assert hypot(quad.where.north - k.north, quad.where.east - k.east) < 0.2
    assert echoes(out) == []


def test_setpoints_do_not_lift_a_copter_from_the_ground(quad):
    quad.command(SET_MODE, 1, COPTER["GUIDED"])
    quad.command(ARM, 1)
    stream(quad, quad.target(POSITION, z=-5), 3)
    assert not quad.autopilot.in_air
    assert not any(quad.vehicle.robot.actuators())


def test_setpoints_do_not_move_a_disarmed_rover(rover):
    rover.command(SET_MODE, 1, ROVER["GUIDED"])
    stream(rover, rover.target(VELOCITY, vx=1.0), 3)
    assert rover.where[:2] == (0, 0)


def test_one_position_target_is_enough(quad, texts):
    quad.fly()
    quad.send(quad.target(POSITION_YAW, x=6, y=2, z=-4, yaw=radians(90)))
    said = quad.run(15)
    assert quad.where[:3] == pytest.approx((6, 2, -4), abs=0.15)
    assert wrap_angle(yaw_of(quad.where[6:10]) - pi / 2) == pytest.approx(0, abs=0.05)
    assert texts(said) == []


def test_one_position_target_is_not_enough_without_latching(desk, texts):
    quad = desk("quadcopter", latch_position=False, params={"GUID_TIMEOUT": 0.5})
    quad.fly()
    quad.send(quad.target(POSITION, x=50, z=-3))
    said = quad.run(8)
    assert quad.where.north < 10
    assert speed(quad) < 0.1
    assert texts(said) == ["Target not received, stopping"]
    assert quad.autopilot.mode.name == "GUIDED"
    stream(quad, quad.target(POSITION, x=quad.where.north + 3, z=-3), 1, every=0.4)
    assert speed(quad) > 0.3


@pytest.mark.parametrize("timeout", [0.5, 3.0])
def test_a_velocity_expires_after_the_timeout(desk, timeout, texts):
    rover = desk("rover", params={"GUID_TIMEOUT": timeout})
    rover.fly()
    said = stream(rover, rover.target(VELOCITY, vx=1.0), 4)
    assert texts(said)[1:] == []
    assert speed(rover) == pytest.approx(1.0, abs=0.1)
    said = rover.run(timeout - 0.15)
    assert texts(said) == []
    assert speed(rover) == pytest.approx(1.0, abs=0.1)
    said = rover.run(5)
    assert texts(said) == ["Target not received, stopping"]
    assert speed(rover) < 0.02
    assert rover.autopilot.armed
    assert rover.autopilot.mode.name == "GUIDED"


def test_a_velocity_beside_a_latched_position_expires_and_the_position_stays(quad, texts):
    quad.fly()
    quad.send(quad.target(0xDC0, x=3, z=-3, vx=0.3))
    said = quad.run(15)
    assert texts(said) == ["Target not received, stopping"]
    assert quad.where.north == pytest.approx(3, abs=0.15)


def test_a_velocity_is_flown(quad):
    quad.fly()
    stream(quad, quad.target(VELOCITY, vx=1.0, vy=-0.5), 5)
    assert (quad.where.v_north, quad.where.v_east) == pytest.approx((1.0, -0.5), abs=0.15)


def test_a_rover_turns_on_the_spot_with_the_sign_of_ned(rover):
    rover.fly()
    stream(rover, rover.target(0x5FF, yaw_rate=0.4), 3)
    assert 0.3 < rover.where.yaw_rate < 0.5
    assert 0.5 < yaw_of(rover.where[6:10]) < 1.6
    assert hypot(rover.where.north, rover.where.east) < 0.2


def test_a_rover_with_speed_and_turn_rate_drives_a_circle(rover):
    rover.fly()
    message = rover.target(VELOCITY_TURN, frame=8, vx=0.5, yaw_rate=0.5)
    stream(rover, message, 2)
    far = 0.0
    for _ in range(13):
        stream(rover, message, 1)
        far = max(far, hypot(rover.where.north, rover.where.east))
    assert 1.0 < far < 3.5  # a circle of radius v / w = 1 m, not a straight line of 7 m


def test_a_setpoint_overrides_a_takeoff(quad):
    quad.command(SET_MODE, 1, COPTER["GUIDED"])
    quad.command(ARM, 1)
    quad.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 20)
    quad.run(3)
    assert quad.autopilot.in_air
    quad.send(quad.target(POSITION, z=-3))
    quad.run(10)
    assert quad.where.down == pytest.approx(-3, abs=0.15)


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
@pytest.mark.parametrize(
    "bad", [{"vx": nan}, {"vx": inf}, {"vx": 5000.0}, {"frame": 12}, {"mask": 0xFFF}]
)
def test_an_illegal_target_stops_the_vehicle_and_is_said_once_a_second(desk, kind, bad, texts):
    vehicle = desk(kind)
    vehicle.fly()
    stream(vehicle, vehicle.target(VELOCITY, vx=1.0), 3)
    assert speed(vehicle) > 0.8
    fields = {"mask": VELOCITY, "vx": 1.0, **bad}
    illegal = vehicle.target(**fields)
    said = texts(stream(vehicle, illegal, 5))
    assert speed(vehicle) < 0.1
    assert vehicle.autopilot.armed
    refusals = [t for t in said if t.startswith("Target refused: ")]
    assert said == refusals, "each in one message"
    assert 4 <= len(refusals) <= 6


def test_a_flood_of_different_illegal_targets_is_said_once_a_second(quad, texts):
    quad.fly()
    said = []
    for i in range(300):
        quad.send(quad.target(VELOCITY, vx=2000.0 + i))
        said += texts(quad.run(0.01))
    refusals = [t for t in said if t.startswith("Target refused")]
    assert 2 <= len(refusals) <= 4


def test_the_target_is_echoed_with_its_type_mask(quad):
    quad.fly()
    out = stream(quad, quad.target(0xDC0, x=3, y=1, z=-3, vx=0.2), 2)
    m = echoes(out)[-1]
    assert (m.type_mask, m.coordinate_frame) == (0xDC0, 1)
    assert (m.x, m.y, m.z, m.vx) == pytest.approx((3, 1, -3, 0.2))


def test_the_echo_is_in_local_ned_whatever_was_asked(rover):
    rover.fly()
    stream(rover, rover.target(VELOCITY, vx=1.0), 2)
    k = rover.where
    yaw = yaw_of(k[6:10])
    rover.send(rover.target(POSITION, frame=9, x=10.0))
    m = echoes(rover.run(1))[-1]
    assert (m.x, m.y) == pytest.approx((k.north + 10 * cos(yaw), k.east + 10 * sin(yaw)), abs=0.01)


def test_the_echo_of_an_idle_vehicle_does_not_invent_a_place(rover):
    rover.command(SET_MODE, 1, ROVER["GUIDED"])
    rover.send(rover.target(POSITION, x=7, y=1))
    m = echoes(rover.run(1))[-1]
    assert (m.x, m.y) == (7, 1)


def test_there_is_no_echo_outside_guided_or_without_a_target(quad):
    assert echoes(quad.run(1)) == []
    quad.fly()
    quad.send(quad.target(POSITION, z=-3))
    assert len(echoes(quad.run(1))) >= 3
    quad.command(SET_MODE, 1, COPTER["LOITER"])
    assert echoes(quad.run(1)) == []


def test_long_texts_arrive_whole(quad, texts):
    words = "a text that is longer than the fifty characters that one STATUSTEXT can hold, by far"
    quad.autopilot.say(words)
    assert "".join(texts(quad.run(0.1))) == words
