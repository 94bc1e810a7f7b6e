"""Setpoints are followed, kept and forgotten by each flight stack's rules (mavlink.md A3, B2.4)."""

from itertools import combinations, product
from math import atan2, cos, hypot, inf, nan, pi, radians, sin

import pytest

from mavherd.transport.frames import quaternion_from_euler, wrap_angle
from mavherd.transport.mavlink import mav

ACCEPTED, DENIED, FAILED = 0, 2, 4
TAKEOFF, CONDITION_YAW, CHANGE_SPEED, REPOSITION = 22, 115, 178, 192
POSITION, POSITION_YAW, VELOCITY, VELOCITY_TURN = 0xDF8, 0x9F8, 0xDC7, 0x5C7
POSITION_VELOCITY, VELOCITY_YAW, ACCELERATION = 0xDC0, 0x9C7, 0xC3F
YAW_ONLY, TURN_ONLY, NOTHING = 0x9FF, 0x5FF, 0xFFF
LOCAL, OFFSET, BODY, BODY_OFFSET = 1, 7, 8, 9
SILENCE = "target not received last 3secs, stopping"
KINDS = ("quadcopter", "rover")


@pytest.fixture
def flying(desk):
    """A copter that hovers at 3 m, or a rover that may drive, in GUIDED; of any stack."""

    def make(kind="quadcopter", **config):
        vehicle = desk(kind, **config)
        if vehicle.autopilot.personality.name == "px4":
            place = vehicle.target(POSITION, z=-3)
            vehicle.stream(place, 0.5)
            assert vehicle.mode("OFFBOARD") == ACCEPTED
            assert vehicle.arm() == ACCEPTED
            vehicle.stream(place, 6)
        else:
            vehicle.fly()
        vehicle.send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        vehicle.run(0.5)
        return vehicle

    return make


@pytest.fixture
def texts(of):
    """Return the STATUSTEXTs among messages, those in chunks put together."""

    def pick(messages):
        whole = []
        for m in of(messages, "STATUSTEXT"):
            if m.id and m.chunk_seq:
                whole[-1] += m.text
            else:
                whole.append(m.text)
        return whole

    return pick


def echo(desk, name="POSITION_TARGET_LOCAL_NED"):
    """Return the echo as it is now, None if there is none."""
    number = getattr(mav, f"MAVLINK_MSG_ID_{name}")
    (_, *echoes) = desk.ask(mav.MAV_CMD_REQUEST_MESSAGE, number)
    return echoes[0] if echoes else None


def world(desk, mask, frame, north, east, altitude, **fields):
    """Return a SET_POSITION_TARGET_GLOBAL_INT to a place in local NED."""
    lat_deg, lon_deg = desk.autopilot.origin.to_geodetic(north, east)
    names = ("vx", "vy", "vz", "afx", "afy", "afz", "yaw", "yaw_rate")
    return mav.MAVLink_set_position_target_global_int_message(
        0, 1, 1, frame, mask, round(lat_deg * 1e7), round(lon_deg * 1e7), altitude,
        *(fields.get(n, 0.0) for n in names),
    )  # fmt: skip


def heads(desk, yaw, within=0.05):
    return abs(wrap_angle(desk.yaw - yaw)) < within


# Who listens


@pytest.mark.parametrize("mode", ["LOITER", "BRAKE", "ALT_HOLD"])
def test_setpoints_are_heard_in_guided_only(flying, mode, of):
    quad = flying()
    quad.mode(mode)
    quad.run(3)
    k = quad.where
    out = quad.stream(quad.target(POSITION, x=20, z=-3), 3)
    assert hypot(quad.where.north - k.north, quad.where.east - k.east) < 0.2
    assert of(out, "POSITION_TARGET_LOCAL_NED") == []
    quad.mode("GUIDED")
    quad.run(3)
    assert hypot(quad.where.north - k.north, quad.where.east - k.east) < 0.3, "it is forgotten"


@pytest.mark.parametrize("mode", ["MANUAL", "HOLD", "LOITER"])
def test_a_rover_hears_setpoints_in_guided_only(flying, mode):
    rover = flying("rover")
    rover.mode(mode)
    rover.stream(rover.target(VELOCITY, vx=1.0), 2)
    assert rover.speed < 0.01


@pytest.mark.parametrize(
    "fields",
    [
        {"mask": POSITION, "z": -5.0},
        {"mask": VELOCITY, "vz": -1.0},
        {"mask": ACCELERATION, "afz": -5.0},
    ],
)
def test_setpoints_do_not_lift_arducopter_from_the_ground(quad, fields):
    quad.mode("GUIDED")
    quad.arm()
    quad.stream(quad.target(**fields), 3)
    assert not quad.autopilot.in_air
    assert max(quad.vehicle.robot.outputs()) < 0.2, "the rotors idle"
    assert quad.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 3) == ACCEPTED
    quad.run(6)
    assert quad.where.down == pytest.approx(-3, abs=0.2), "targets before it are forgotten"


def test_setpoints_do_not_move_a_disarmed_rover(rover):
    rover.mode("GUIDED")
    rover.stream(rover.target(VELOCITY, vx=1.0), 3)
    assert rover.where[:2] == (0, 0)


@pytest.mark.parametrize("stack", ["ardupilot", "generic"])
def test_a_target_takes_over_from_a_takeoff(desk, stack):
    quad = desk("quadcopter", autopilot=stack)
    quad.mode("GUIDED")
    quad.arm()
    quad.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 20)
    quad.run(3)
    assert quad.autopilot.in_air
    quad.send(quad.target(POSITION, z=-3))
    quad.run(10)
    assert quad.where.down == pytest.approx(-3, abs=0.15)


def test_a_stream_of_targets_on_the_ground_stops_ones_own_takeoff(quad):
    quad.mode("GUIDED")
    quad.arm()
    ground = quad.target(POSITION)
    quad.send(ground)
    assert quad.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 5) == ACCEPTED
    quad.stream(ground, 5)
    assert quad.where.down > -0.3


# All combinations, flown


TRIPLES = {"position": 0x007, "velocity": 0x038, "acceleration": 0x1C0}
TURNS = {(): 0xC00, ("yaw",): 0x800, ("yaw_rate",): 0x400, ("yaw", "yaw_rate"): 0}
MOTIONS = [m for count in range(4) for m in combinations(TRIPLES, count)]
COMBINATIONS = list(product(MOTIONS, TURNS))
SAMPLE = {
    "x": 2.0, "y": -1.0, "z": -3.5, "vx": 0.3, "vy": 0.2, "vz": 0.0,
    "afx": 0.1, "afy": 0.0, "afz": 0.0, "yaw": 0.8, "yaw_rate": 0.2,
}  # fmt: skip


def mask_of(motion, turn):
    return sum(bits for name, bits in TRIPLES.items() if name not in motion) | TURNS[turn]


def arducopter_flies(motion, turn):
    return motion in (
        ("position",),
        ("position", "velocity"),
        ("position", "velocity", "acceleration"),
        ("velocity",),
        ("velocity", "acceleration"),
        ("acceleration",),
    )


def ardurover_drives(motion, turn):
    if "acceleration" in motion or (not motion and not turn):
        return False
    return "position" in motion or len(turn) < 2


@pytest.mark.parametrize(("motion", "turn"), COMBINATIONS)
def test_every_combination_is_flown_or_stops_a_copter(flying, motion, turn, texts):
    quad = flying()
    quad.stream(quad.target(VELOCITY, vx=1.0), 1.5)
    said = texts(quad.stream(quad.target(mask_of(motion, turn), **SAMPLE), 2.5))
    if not arducopter_flies(motion, turn):
        assert echo(quad) is None
        assert quad.speed < 0.15
        assert abs(quad.yaw) < 0.05
        assert said == [], "ArduCopter says nothing either"
        return
    m = echo(quad)
    assert m.type_mask == mask_of(motion, turn)
    if motion == ("velocity",):
        assert (quad.where.v_north, quad.where.v_east) == pytest.approx((0.3, 0.2), abs=0.1)
    if motion == ("position",):
        quad.run(8)
        assert quad.where[:3] == pytest.approx((2, -1, -3.5), abs=0.15)
    if turn == ("yaw",):
        assert heads(quad, 0.8)
    elif turn == ("yaw_rate",) and "position" not in motion:
        assert quad.where.yaw_rate == pytest.approx(0.2, abs=0.1)
    elif turn == ():
        assert abs(quad.yaw) < 0.05


@pytest.mark.parametrize(("motion", "turn"), COMBINATIONS)
def test_every_combination_is_driven_or_dropped_by_a_rover(flying, motion, turn, texts):
    rover = flying("rover")
    before = rover.target(VELOCITY, vx=0.7)
    rover.stream(before, 1.5)
    said = texts(rover.stream(rover.target(mask_of(motion, turn), **SAMPLE), 2))
    m = echo(rover)
    if not ardurover_drives(motion, turn):
        assert (m.type_mask, m.vx) == (VELOCITY, pytest.approx(0.7)), "it goes on as before"
        assert rover.where.v_north == pytest.approx(0.7, abs=0.1)
        ignored = "Ignoring SET_POSITION_TARGET_LOCAL_NED; set ACC_IGNORE in mask"
        assert set(said) == ({ignored} if "acceleration" in motion else set())
        return
    assert said == []
    assert m.type_mask == mask_of(motion, turn)
    if motion == ("position",):
        rover.run(10)
        assert rover.where[:2] == pytest.approx((2, -1), abs=0.2)
    elif motion == ("velocity",) and turn == ():
        assert heads(rover, atan2(0.2, 0.3))
        assert rover.speed == pytest.approx(hypot(0.3, 0.2), abs=0.05)
    elif motion == () and turn == ("yaw",):
        assert heads(rover, 0.8, within=0.1)
        assert rover.speed < 0.05


# Frames


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("frame", [LOCAL, OFFSET, BODY, BODY_OFFSET])
def test_positions_in_every_local_frame(flying, kind, frame):
    vehicle = flying(kind, yaw=pi / 2)
    vehicle.send(vehicle.target(POSITION, x=2, y=0, z=-4))
    vehicle.run(10)
    k, yaw = vehicle.where, vehicle.yaw
    vehicle.send(vehicle.target(POSITION, frame=frame, x=3, y=1, z=-1))
    vehicle.run(15)
    expected = {
        LOCAL: (3.0, 1.0, -1.0),
        OFFSET: (k.north + 3, k.east + 1, k.down - 1),
        BODY: (k.north + 3 * cos(yaw) - sin(yaw), k.east + 3 * sin(yaw) + cos(yaw), k.down - 1),
    }
    expected[BODY_OFFSET] = expected[BODY]
    n = 3 if kind == "quadcopter" else 2
    assert vehicle.where[:n] == pytest.approx(expected[frame][:n], abs=0.2)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("frame", [0, 3, 5, 6, 10, 11])
def test_positions_in_every_global_frame(flying, kind, frame):
    vehicle = flying(kind, down=-20.0)  # home is 20 m above the origin
    home_up = 20.0 if frame in (0, 5) else 0.0
    above = home_up + 5 + (vehicle.autopilot.origin.alt_m if frame in (0, 5) else 0)
    vehicle.send(world(vehicle, POSITION, frame, 4, -3, above))
    vehicle.run(15)
    assert vehicle.where[:2] == pytest.approx((4, -3), abs=0.2)
    if kind == "quadcopter":
        assert vehicle.where.down == pytest.approx(-25, abs=0.2)
    m = echo(vehicle, "POSITION_TARGET_GLOBAL_INT")
    assert (m.coordinate_frame, m.type_mask) == (0, POSITION)
    assert m.alt == pytest.approx(vehicle.autopilot.origin.alt_m + 25, abs=0.01)


@pytest.mark.parametrize("frame", [0, 3, 10])
def test_velocities_in_global_messages_are_north_and_east(flying, frame):
    quad = flying(yaw=2.0)
    quad.stream(world(quad, VELOCITY, frame, 0, 0, 0, vx=1.0, vy=-0.5), 4)
    assert (quad.where.v_north, quad.where.v_east) == pytest.approx((1.0, -0.5), abs=0.15)


@pytest.mark.parametrize("frame", [LOCAL, OFFSET, BODY, BODY_OFFSET])
def test_velocities_of_a_copter_turn_with_body_frames(flying, frame):
    quad = flying(yaw=2.0)
    quad.stream(quad.target(VELOCITY, frame=frame, vx=1.0), 4)
    turn = 2.0 if frame in (BODY, BODY_OFFSET) else 0.0
    got = quad.where.v_north, quad.where.v_east
    assert got == pytest.approx((cos(turn), sin(turn)), abs=0.15)


@pytest.mark.parametrize("frame", [LOCAL, BODY])
def test_a_copters_yaw_is_relative_in_body_frames(flying, frame):
    quad = flying(yaw=1.0)
    quad.send(quad.target(POSITION_YAW, frame=frame, z=-3.0 if frame == LOCAL else 0.0, yaw=0.5))
    quad.run(5)
    assert heads(quad, 1.5 if frame == BODY else 0.5)


@pytest.mark.parametrize("kind", KINDS)
def test_px4_takes_two_local_frames_and_names_the_others(flying, kind, texts):
    vehicle = flying(kind, autopilot="px4")
    vehicle.stream(vehicle.target(VELOCITY, frame=BODY, vx=0.6), 3)
    assert vehicle.where.v_north == pytest.approx(0.6, abs=0.1)
    said = texts(vehicle.stream(vehicle.target(VELOCITY, frame=OFFSET, vx=0.6), 0.6))
    assert said == ["SET_POSITION_TARGET_LOCAL_NED coordinate frame 7 unsupported"]


# Latching and expiry


@pytest.mark.parametrize("kind", KINDS)
def test_one_position_target_is_enough(flying, kind, texts):
    vehicle = flying(kind)
    vehicle.send(vehicle.target(POSITION_YAW, x=6, y=2, z=-4, yaw=radians(90)))
    said = vehicle.run(20)
    down = -4 if kind == "quadcopter" else 0
    assert vehicle.where[:3] == pytest.approx((6, 2, down), abs=0.15)
    assert heads(vehicle, pi / 2)
    assert texts(said) == []


def test_one_position_target_is_not_enough_without_latching(flying, texts):
    quad = flying(latch_position=False, params={"GUID_TIMEOUT": 0.5})
    quad.send(quad.target(POSITION, x=50, z=-3))
    said = quad.run(8)
    assert quad.where.north < 10
    assert quad.speed < 0.1
    assert texts(said) == ["target not received last 0.5secs, stopping"]
    assert quad.autopilot.mode.name == "GUIDED"
    quad.stream(quad.target(POSITION, x=quad.where.north + 3, z=-3), 1, every=0.4)
    assert quad.speed > 0.3


@pytest.mark.parametrize("timeout", [0.5, 3.0])
def test_a_velocity_expires_after_the_timeout_and_a_rover_says_so(flying, timeout, texts):
    rover = flying("rover", params={"GUID_TIMEOUT": timeout})
    said = rover.stream(rover.target(VELOCITY, vx=1.0), 4)
    assert texts(said) == []
    assert rover.speed == pytest.approx(1.0, abs=0.1)
    said = rover.run(timeout - 0.15)
    assert texts(said) == []
    assert rover.speed == pytest.approx(1.0, abs=0.1)
    said = rover.run(5)
    assert texts(said) == [f"target not received last {timeout:g}secs, stopping"]
    assert rover.speed < 0.02
    assert rover.autopilot.armed
    assert rover.autopilot.mode.name == "GUIDED"
    assert echo(rover) is None


@pytest.mark.parametrize(
    "fields",
    [
        {"mask": VELOCITY, "vx": 1.0},
        {"mask": ACCELERATION, "afx": 0.5},
        {"mask": 0xC07, "vx": 1.0, "afx": 0.1},
        {"mask": VELOCITY_TURN, "vx": 1.0, "yaw_rate": 0.5},
        {"mask": VELOCITY_YAW, "vx": 1.0, "yaw": 1.0},
    ],
)
def test_what_moves_a_copter_expires_in_silence_and_it_stays_guided(flying, fields, texts):
    quad = flying()
    quad.stream(quad.target(**fields), 2)
    assert quad.speed > 0.6
    quad.run(2.7)
    assert quad.speed > 0.6
    said = quad.run(6)
    assert texts(said) == []
    assert quad.speed < 0.1
    assert abs(quad.where.yaw_rate) < 0.02
    assert quad.autopilot.armed
    assert quad.autopilot.mode.name == "GUIDED"


def test_a_yaw_rate_beside_a_position_expires(flying):
    quad = flying()
    quad.stream(quad.target(0x5F8, x=2, z=-3, yaw_rate=0.4), 2)
    assert quad.where.yaw_rate == pytest.approx(0.4, abs=0.1)
    quad.run(8)
    assert abs(quad.where.yaw_rate) < 0.02
    assert quad.where[:3] == pytest.approx((2, 0, -3), abs=0.15)
    assert echo(quad).type_mask == POSITION


def test_a_velocity_beside_a_position_expires_and_the_position_stays(flying, texts):
    quad = flying()
    quad.send(quad.target(POSITION_VELOCITY, x=3, z=-3, vx=0.3))
    said = quad.run(15)
    assert texts(said) == []
    assert quad.where.north == pytest.approx(3, abs=0.15)


@pytest.mark.parametrize(
    "fields",
    [
        {"mask": TURN_ONLY, "yaw_rate": 0.4},
        {"mask": VELOCITY_TURN, "vx": 0.5, "yaw_rate": 0.4},
    ],
)
def test_a_rovers_turn_expires(flying, fields, texts):
    rover = flying("rover")
    rover.stream(rover.target(**fields), 2)
    assert rover.where.yaw_rate == pytest.approx(0.4, abs=0.05)
    said = texts(rover.run(5))
    assert said == [SILENCE]
    assert abs(rover.where.yaw_rate) < 0.02


@pytest.mark.parametrize("kind", KINDS)
def test_attitude_targets_are_followed_and_expire(flying, kind, texts):
    vehicle = flying(kind)
    q = list(quaternion_from_euler(0.0, radians(-8) if kind == "quadcopter" else 0.0, 0.5))
    thrust = 0.5 if kind == "quadcopter" else 0.6
    target = mav.MAVLink_set_attitude_target_message(0, 1, 1, 7, q, 0, 0, 0, thrust)
    vehicle.stream(target, 2.5)
    assert heads(vehicle, 0.5, within=0.1)
    assert vehicle.speed > 0.4
    assert echo(vehicle) is None, "it is no position target"
    said = texts(vehicle.run(8))
    assert vehicle.speed < 0.1
    assert said == ([] if kind == "quadcopter" else [SILENCE])


# A rover


def test_a_rovers_velocity_is_a_course_and_a_speed_that_is_clipped(flying):
    rover = flying("rover")
    rover.stream(rover.target(VELOCITY, vx=-3.0, vy=4.0), 6)
    assert heads(rover, atan2(4, -3))
    assert rover.speed == pytest.approx(rover.vehicle.robot.limits.speed, abs=0.05)
    assert rover.where.v_north < 0 < rover.where.v_east


@pytest.mark.parametrize("frame", [LOCAL, BODY])
def test_a_rover_with_speed_and_turn_rate_drives_a_circle(flying, frame):
    rover = flying("rover", yaw=1.0)
    message = rover.target(VELOCITY_TURN, frame=frame, vx=0.5, yaw_rate=0.5)
    rover.stream(message, 2)
    far = 0.0
    for _ in range(13):
        rover.stream(message, 1)
        far = max(far, hypot(rover.where.north, rover.where.east))
        assert rover.where.yaw_rate == pytest.approx(0.5, abs=0.05)
    assert 1.0 < far < 3.5  # a circle of radius v / w = 1 m, not a straight line of 7 m


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("frame", [LOCAL, BODY])
def test_a_rover_turns_to_a_yaw_and_drives_along_it_or_backwards(flying, frame, sign):
    rover = flying("rover")
    rover.stream(rover.target(VELOCITY_YAW, vx=sign * 0.6, yaw=1.2), 4)
    assert heads(rover, 1.2)
    got = rover.where.v_north, rover.where.v_east
    assert got == pytest.approx((sign * 0.6 * cos(1.2), sign * 0.6 * sin(1.2)), abs=0.05)


def test_a_rover_reverses_straight_on_a_negative_speed_with_a_turn_rate(flying):
    rover = flying("rover")
    rover.stream(rover.target(VELOCITY_TURN, frame=BODY, vx=-0.5), 3)
    assert rover.where.v_north == pytest.approx(-0.5, abs=0.05)
    assert abs(rover.yaw) < 0.02


def test_a_rover_turns_on_the_spot_with_the_sign_of_ned(flying):
    rover = flying("rover")
    rover.stream(rover.target(TURN_ONLY, yaw_rate=0.4), 3)
    assert 0.3 < rover.where.yaw_rate < 0.5
    assert 0.5 < rover.yaw < 1.6
    assert hypot(rover.where.north, rover.where.east) < 0.2


def test_a_rover_turns_to_a_yaw_on_the_spot(flying):
    rover = flying("rover")
    rover.stream(rover.target(YAW_ONLY, yaw=-2.0), 4)
    assert heads(rover, -2.0)
    assert hypot(rover.where.north, rover.where.east) < 0.2


def test_a_rovers_position_wins_over_its_velocity(flying):
    rover = flying("rover")
    rover.stream(rover.target(POSITION_VELOCITY, x=3, y=1, vx=-0.2, vy=0.1), 8)
    rover.run(8)
    assert rover.where[:2] == pytest.approx((3, 1), abs=0.2)


# Illegal ones


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("bad", [{"vx": nan}, {"vx": inf}, {"vx": 5000.0}])
def test_an_illegal_value_stops_the_vehicle_and_is_said_once_a_second(flying, kind, bad, texts):
    vehicle = flying(kind)
    vehicle.stream(vehicle.target(VELOCITY, vx=1.0), 3)
    assert vehicle.speed > 0.8
    said = texts(vehicle.stream(vehicle.target(VELOCITY, **bad), 5))
    assert vehicle.speed < 0.1
    assert vehicle.autopilot.armed
    refusals = [t for t in said if t.startswith("Target refused: ")]
    assert said == refusals, "each in one message"
    assert 4 <= len(refusals) <= 6


@pytest.mark.parametrize("stack", ["ardupilot", "generic"])
def test_a_wrong_frame_stops_a_copter(flying, stack, texts):
    quad = flying(autopilot=stack)
    quad.stream(quad.target(VELOCITY, vx=1.0), 3)
    said = texts(quad.stream(quad.target(VELOCITY, frame=12, vx=1.0), 1.5))
    assert "Target refused: frame 12 is not supported" in said
    assert quad.speed < 0.1


def test_a_wrong_frame_does_not_disturb_ardurover(flying):
    rover = flying("rover")
    rover.stream(rover.target(VELOCITY, vx=0.8), 2)
    rover.stream(rover.target(VELOCITY, frame=12, vx=-0.8), 1.5)
    assert rover.where.v_north == pytest.approx(0.8, abs=0.05)


@pytest.mark.parametrize("kind", KINDS)
def test_a_target_with_nothing_in_it_is_ignored_in_silence_by_a_vehicle_that_stays(
    flying, kind, texts
):
    vehicle = flying(kind)
    place = vehicle.target(POSITION, x=2, y=1, z=-3)
    vehicle.send(place)
    vehicle.run(10)
    k = vehicle.where
    assert texts(vehicle.stream(vehicle.target(NOTHING), 4)) == []
    assert vehicle.where[:3] == pytest.approx(k[:3], abs=0.1)
    assert vehicle.autopilot.mode.name == "GUIDED"


def test_an_illegal_target_ends_a_takeoff(quad):
    quad.mode("GUIDED")
    quad.arm()
    quad.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 20)
    quad.run(3)
    quad.send(quad.target(NOTHING))
    quad.run(5)
    assert quad.where.down > -15
    assert quad.speed < 0.1


def test_a_flood_of_different_illegal_targets_is_said_once_a_second(flying, texts):
    quad = flying()
    said = []
    for i in range(300):
        quad.send(quad.target(VELOCITY, vx=2000.0 + i))
        said += texts(quad.run(0.01))
    refusals = [t for t in said if t.startswith("Target refused")]
    assert 2 <= len(refusals) <= 4


@pytest.mark.parametrize("kind", KINDS)
def test_a_place_beyond_the_fence_is_not_gone_to_and_the_way_goes_on(flying, kind, texts):
    fence = {"FENCE_ENABLE": 1, "FENCE_TYPE": 2, "FENCE_RADIUS": 10}
    vehicle = flying(kind, params=fence)
    vehicle.send(vehicle.target(POSITION, x=5, z=-3))
    vehicle.run(1)
    vehicle.send(vehicle.target(POSITION, x=30, z=-3))
    said = texts(vehicle.run(12))
    assert said == ["Target refused: beyond the Circle fence"]
    assert vehicle.where[:2] == pytest.approx((5, 0), abs=0.2)
    vehicle.send(world(vehicle, POSITION, 3, 0, 30, 3))
    vehicle.run(5)
    assert vehicle.where[:2] == pytest.approx((5, 0), abs=0.2)


# The echo


def test_the_target_is_echoed_with_its_type_mask(flying, of):
    quad = flying()
    out = quad.stream(quad.target(POSITION_VELOCITY, x=3, y=1, z=-3, vx=0.2), 2)
    m = of(out, "POSITION_TARGET_LOCAL_NED")[-1]
    assert (m.type_mask, m.coordinate_frame) == (POSITION_VELOCITY, 1)
    assert (m.x, m.y, m.z, m.vx) == pytest.approx((3, 1, -3, 0.2))


def test_a_triple_that_is_ignored_in_part_is_echoed_as_ignored(flying):
    quad = flying()
    quad.send(quad.target(VELOCITY & ~0x006, vx=0.5))  # x is ignored, y and z are not
    assert echo(quad).type_mask == VELOCITY


def test_the_echo_is_in_local_ned_whatever_was_asked(flying):
    rover = flying("rover")
    rover.stream(rover.target(VELOCITY, vx=1.0), 2)
    k, yaw = rover.where, rover.yaw
    rover.send(rover.target(POSITION, frame=BODY_OFFSET, x=10.0))
    m = echo(rover)
    assert (m.x, m.y) == pytest.approx((k.north + 10 * cos(yaw), k.east + 10 * sin(yaw)), abs=0.01)


def test_the_echo_of_an_idle_vehicle_does_not_invent_a_place(rover, of):
    rover.mode("GUIDED")
    rover.send(rover.target(POSITION, x=7, y=1))
    m = of(rover.run(1), "POSITION_TARGET_LOCAL_NED")[-1]
    assert (m.x, m.y) == (7, 1)


@pytest.mark.parametrize("name", ["POSITION_TARGET_LOCAL_NED", "POSITION_TARGET_GLOBAL_INT"])
def test_there_is_no_echo_outside_guided_or_without_a_target(quad, name):
    assert echo(quad, name) is None
    quad.fly()
    quad.send(quad.target(POSITION, z=-3))
    assert echo(quad, name) is not None
    quad.mode("LOITER")
    assert echo(quad, name) is None


# DO_REPOSITION


def reposition(desk, north, east, altitude, *, frame=0, flags=0, yaw=nan, speed=-1.0, form="int"):
    lat_deg, lon_deg = desk.autopilot.origin.to_geodetic(north, east)
    place = (round(lat_deg * 1e7), round(lon_deg * 1e7)) if form == "int" else (lat_deg, lon_deg)
    params = (speed, flags, 0, yaw, *place, altitude)
    return desk.command(REPOSITION, *params, sent_as=form, frame=frame)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("frame", [0, 3, 5, 6, 10, 11])
def test_a_reposition_goes_there_in_every_frame(flying, kind, frame):
    vehicle = flying(kind, down=-10.0)
    alt = 15 + vehicle.autopilot.origin.alt_m if frame in (0, 5) else 5
    assert reposition(vehicle, 4, -3, alt, frame=frame) == ACCEPTED
    vehicle.run(15)
    down = -15 if kind == "quadcopter" else -10
    assert vehicle.where[:3] == pytest.approx((4, -3, down), abs=0.2)
    assert echo(vehicle).type_mask == POSITION


def test_a_reposition_in_another_frame_or_to_nowhere_is_denied(flying):
    quad = flying()
    for frame in set(range(22)) - {0, 3, 5, 6, 10, 11}:
        assert reposition(quad, 4, -3, 5, frame=frame) == DENIED
    for x, y in ((0, 0), (910000000, 80000000), (470000000, 1810000000)):
        assert quad.command(REPOSITION, -1, 0, 0, nan, x, y, 5, sent_as="int") == DENIED
    for altitude in (nan, inf, 1e9):
        assert reposition(quad, 4, -3, altitude) == DENIED
    quad.run(3)
    assert hypot(quad.where.north, quad.where.east) < 0.1


@pytest.mark.parametrize(("kind", "mode"), [("quadcopter", "LOITER"), ("rover", "HOLD")])
def test_a_reposition_changes_the_mode_only_when_asked_to(flying, kind, mode):
    vehicle = flying(kind)
    vehicle.mode(mode)
    assert reposition(vehicle, 4, -3, 5, frame=3) == DENIED
    assert vehicle.autopilot.mode.name == mode
    assert reposition(vehicle, 4, -3, 5, frame=3, flags=1) == ACCEPTED
    assert vehicle.autopilot.mode.name == "GUIDED"
    vehicle.run(15)
    assert vehicle.where[:2] == pytest.approx((4, -3), abs=0.2)


@pytest.mark.parametrize(
    ("stack", "yaw", "expected"),
    [("ardupilot", 1.5, 1.5), ("ardupilot", 0, 1.0), ("generic", 0, 0.0), ("generic", nan, 1.0)],
)
def test_a_reposition_turns_the_nose_where_it_is_told(flying, stack, yaw, expected):
    quad = flying(yaw=1.0, autopilot=stack)
    assert reposition(quad, 3, 0, 4, frame=3, yaw=yaw) == ACCEPTED
    quad.run(8)
    assert heads(quad, expected)


@pytest.mark.parametrize("kind", KINDS)
def test_a_reposition_has_its_speed(flying, kind):
    vehicle = flying(kind)
    assert reposition(vehicle, 20, 0, 3, frame=3, speed=0.5) == ACCEPTED
    fastest = 0.0
    for _ in range(60):
        vehicle.run(0.1)
        fastest = max(fastest, vehicle.speed)
    assert fastest == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("value", [inf, -inf])
def test_a_reposition_with_an_infinite_speed_or_yaw_is_denied(flying, value):
    quad = flying()
    assert reposition(quad, 3, 0, 3, frame=3, yaw=value) == DENIED
    assert reposition(quad, 3, 0, 3, frame=3, speed=value) == DENIED


@pytest.mark.parametrize("kind", KINDS)
def test_a_reposition_beyond_the_fence_fails(flying, kind, texts):
    vehicle = flying(kind, params={"FENCE_ENABLE": 1, "FENCE_TYPE": 2, "FENCE_RADIUS": 10})
    assert reposition(vehicle, 30, 0, 3, frame=3) == FAILED
    assert texts(vehicle.run(0.1)) == ["Reposition refused: beyond the Circle fence"]
    vehicle.run(3)
    assert abs(vehicle.where.north) < 0.1


def test_a_reposition_ends_a_takeoff(quad):
    quad.mode("GUIDED")
    quad.arm()
    quad.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 20)
    quad.run(3)
    assert reposition(quad, 3, 0, 4, frame=3) == ACCEPTED
    quad.run(12)
    assert quad.where[:3] == pytest.approx((3, 0, -4), abs=0.2)


def px4_holding(desk, **config):
    quad = desk("quadcopter", autopilot="px4", **config)
    quad.arm()
    quad.command(TAKEOFF, 0, 0, 0, nan, nan, nan, quad.autopilot.origin.alt_m + 5)
    quad.run(8)
    assert quad.autopilot.mode.name == "HOLD"
    return quad


@pytest.mark.parametrize("form", ["long", "int"])
def test_px4_repositions_in_hold(desk, form):
    quad = px4_holding(desk, yaw=1.0)
    alt = quad.autopilot.origin.alt_m + 7
    assert reposition(quad, 4, -3, alt, flags=1, yaw=0.0, form=form) == ACCEPTED
    assert quad.autopilot.mode.name == "HOLD"
    quad.run(12)
    far = 2.0 if form == "long" else 0.2  # a float's degrees
    assert quad.where[:2] == pytest.approx((4, -3), abs=far)
    assert quad.where.down == pytest.approx(-7, abs=0.2)
    assert heads(quad, 0.0), "north"


def test_px4_pauses_and_changes_height_with_nan_for_what_stays(desk):
    quad = px4_holding(desk)
    quad.stream(quad.target(VELOCITY, vx=1.0), 0.5)
    assert quad.mode("OFFBOARD") == ACCEPTED
    quad.stream(quad.target(VELOCITY, vx=1.0), 3)
    assert quad.command(REPOSITION, -1, 0, 0, nan, nan, nan, nan) == DENIED, "it is not in HOLD"
    assert quad.command(REPOSITION, -1, 1, 0, nan, nan, nan, nan) == ACCEPTED
    k = quad.where
    quad.run(6)
    assert quad.autopilot.mode.name == "HOLD"
    assert quad.where[:3] == pytest.approx(k[:3], abs=1.5)
    alt = quad.autopilot.origin.alt_m + 8
    assert quad.command(REPOSITION, -1, 1, 0, nan, nan, nan, alt) == ACCEPTED
    quad.run(6)
    assert quad.where.down == pytest.approx(-8, abs=0.2)


# CONDITION_YAW


@pytest.mark.parametrize(
    ("start", "angle", "direction", "relative", "end"),
    [
        (0, 90, 0, 0, 90),
        (0, 90, -1, 0, 90),
        (0, 270, 1, 0, 270),
        (0, 270, 0, 0, 270),
        (90, 30, 1, 1, 120),
        (90, 30, 0, 1, 120),
        (90, 30, -1, 1, 60),
        (350, 20, 1, 1, 10),
        (10, 360, 0, 0, 0),
    ],
)
def test_condition_yaw_turns_to_there_the_way_it_is_told(
    flying, start, angle, direction, relative, end
):
    quad = flying(yaw=radians(start))
    assert quad.command(CONDITION_YAW, angle, 40, direction, relative) == ACCEPTED
    turned, last = 0.0, quad.yaw
    for _ in range(110):
        quad.run(0.1)
        turned += wrap_angle(quad.yaw - last)
        last = quad.yaw
    assert heads(quad, radians(end))
    if direction:
        expected = (end - start) % 360 if direction > 0 else -((start - end) % 360)
        assert turned == pytest.approx(radians(expected), abs=0.1)
    else:
        assert abs(turned) < pi + 0.1
    assert hypot(quad.where.north, quad.where.east) < 0.1


@pytest.mark.parametrize(("rate", "expected"), [(10, 10), (30, 30), (0, 60), (1e30, 60)])
def test_condition_yaw_has_its_rate(flying, rate, expected):
    quad = flying()
    quad.command(CONDITION_YAW, 180, rate, 1, 0)
    quad.run(1.5)
    assert quad.where.yaw_rate == pytest.approx(radians(expected), rel=0.15)


@pytest.mark.parametrize(
    ("params", "result"),
    [
        ((-1, 0, 0, 0), FAILED),
        ((361, 0, 0, 0), FAILED),
        ((90, 0, 0, 0.5), FAILED),
        ((90, 0, 0, nan), FAILED),
        ((nan, 0, 0, 0), DENIED),
        ((90, nan, 0, 0), DENIED),
        ((90, -5, 0, 0), DENIED),
        ((90, 0, 2, 0), DENIED),
        ((90, 0, inf, 0), DENIED),
    ],
)
def test_condition_yaw_refuses_nonsense(flying, params, result):
    quad = flying()
    assert quad.command(CONDITION_YAW, *params) == result
    quad.run(1)
    assert abs(quad.yaw) < 0.02


def test_condition_yaw_is_for_copters_that_fly_by_themselves(flying, rover):
    quad = flying()
    quad.mode("LOITER")
    assert quad.command(CONDITION_YAW, 90, 0, 0, 0) == FAILED
    assert rover.command(CONDITION_YAW, 90, 0, 0, 0) == mav.MAV_RESULT_UNSUPPORTED


def test_condition_yaw_lasts_until_the_next_target(flying):
    quad = flying()
    quad.command(CONDITION_YAW, 90, 0, 0, 0)
    quad.run(5)
    assert heads(quad, pi / 2)
    quad.send(quad.target(POSITION_YAW, x=1, z=-3, yaw=0.0))
    quad.run(5)
    assert heads(quad, 0.0)


# DO_CHANGE_SPEED


@pytest.mark.parametrize(("stack", "result"), [("ardupilot", FAILED), ("px4", ACCEPTED)])
def test_a_rover_in_hold_has_no_speed_to_change_on_ardupilot(desk, stack, result):
    rover = desk("rover", autopilot=stack)
    rover.mode("HOLD")
    assert rover.command(CHANGE_SPEED, 1, 0.3) == result


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("type_", [0, 1])
@pytest.mark.parametrize("sent_as", ["long", "int"])
def test_a_changed_speed_is_kept_until_the_mode_changes(flying, kind, type_, sent_as):
    vehicle = flying(kind)
    usual = vehicle.vehicle.robot.limits.speed
    assert vehicle.command(CHANGE_SPEED, type_, 0.4, -1, sent_as=sent_as) == ACCEPTED
    vehicle.send(vehicle.target(POSITION, x=30, z=-3))
    fastest = 0.0
    for _ in range(60):
        vehicle.run(0.1)
        fastest = max(fastest, vehicle.speed)
    assert fastest == pytest.approx(0.4, abs=0.08)
    vehicle.mode("LOITER")
    assert vehicle.vehicle.robot.limits.speed == usual


def test_a_speed_that_was_set_before_arming_counts(rover):
    rover.mode("GUIDED")
    assert rover.command(CHANGE_SPEED, 1, 0.3) == ACCEPTED
    rover.arm()
    rover.send(rover.target(POSITION, x=30))
    rover.run(5)
    assert rover.speed == pytest.approx(0.3, abs=0.05)


@pytest.mark.parametrize(("type_", "sign"), [(2, -1), (3, 1)])
def test_climb_and_descent_speeds_change(flying, type_, sign):
    quad = flying()
    quad.send(quad.target(POSITION, z=-10))
    quad.run(10)
    assert quad.command(CHANGE_SPEED, type_, 0.5) == ACCEPTED
    quad.send(quad.target(POSITION, z=-10 + sign * 5))
    quad.run(4)
    assert quad.where.v_down == pytest.approx(sign * 0.5, abs=0.1)


@pytest.mark.parametrize(
    ("kind", "params", "result"),
    [
        *product(KINDS, [(1, 0), (1, -1), (1, nan), (nan, 1), (1, inf), (9, 1)], [DENIED]),
        ("rover", (2, 1), DENIED),
        ("rover", (3, 1), DENIED),
    ],
)
def test_a_speed_that_cannot_be_is_denied(flying, kind, params, result):
    vehicle = flying(kind)
    assert vehicle.command(CHANGE_SPEED, *params) == result
    assert vehicle.command(CHANGE_SPEED, 1, 1e30) == ACCEPTED, "as fast as it can"
    vehicle.stream(vehicle.target(VELOCITY, vx=1.0), 1)


@pytest.mark.parametrize(("kind", "mode"), [("quadcopter", "STABILIZE"), ("rover", "MANUAL")])
def test_a_speed_does_nothing_in_a_mode_of_sticks_and_so_fails(desk, kind, mode):
    vehicle = desk(kind)
    vehicle.mode(mode)
    assert vehicle.command(CHANGE_SPEED, 1, 2.0) == FAILED
