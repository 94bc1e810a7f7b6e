"""Every SET_POSITION_TARGET is a setpoint with the parts it names, or a reason not to follow it.

The rules are each flight stack's own (mavlink.md A3, B2.4).
"""

from itertools import product
from math import cos, hypot, inf, isclose, nan, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.transport.frames import Origin, wrap_angle, yaw_of
from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.flight import position_target
from mavherd.vehicles.flight.position_target import (
    Here,
    IllegalTarget,
    PositionTarget,
    rules_of,
    to_place,
)
from mavherd.vehicles.robot import Setpoint, Vec3

ORIGIN = Origin()
HERE = Here(position=Vec3(10.0, -20.0, -5.0), yaw=0.7, home_down=-1.0, origin=ORIGIN)

POSITION, VELOCITY, ACCELERATION = (1, 2, 4), (8, 16, 32), (64, 128, 256)
FORCE, YAW, YAW_RATE = 512, 1024, 2048
EVERYTHING_IGNORED = 0xDFF
KINDS = ("quadcopter", "rover")
STACKS = ("ardupilot", "px4", "generic")
EVERY_VEHICLE = tuple(product(STACKS, KINDS))

LOCAL, OFFSET, BODY, BODY_OFFSET = 1, 7, 8, 9
LOCAL_FRAMES = (LOCAL, OFFSET, BODY, BODY_OFFSET)
AMSL, ABOVE_HOME = (0, 5), (3, 6, 10, 11)
FRAMES_OF = {
    "ardupilot": (LOCAL_FRAMES, AMSL + ABOVE_HOME),
    "px4": ((LOCAL, BODY), (0, 5, 3, 6)),
    "generic": (LOCAL_FRAMES, AMSL + ABOVE_HOME),
}
FIELDS = ("x", "y", "z", "vx", "vy", "vz", "afx", "afy", "afz", "yaw", "yaw_rate")
SAMPLE = dict(zip(FIELDS, (1.0, 2.0, 3.0, 0.4, 0.5, 0.6, 0.07, 0.08, 0.09, 0.3, -0.2), strict=True))


def local(mask, frame=LOCAL, **fields):
    values = {**dict.fromkeys(FIELDS, 0.0), **fields}
    return mav.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, frame, mask, *(values[f] for f in FIELDS)
    )


def world(mask, frame=0, lat=47.3977, lon=8.5456, alt=500.0, **fields):
    values = {**dict.fromkeys(FIELDS[3:], 0.0), **fields}
    return mav.MAVLink_set_position_target_global_int_message(
        0, 1, 1, frame, mask, round(lat * 1e7), round(lon * 1e7), alt,
        *(values[f] for f in FIELDS[3:]),
    )  # fmt: skip


def parse(message, kind, here=HERE, stack="generic"):
    return position_target.parse(message, rules_of(stack, kind), here)


TRIPLES = {"position": POSITION, "velocity": VELOCITY, "acceleration": ACCELERATION}


def named_parts(mask: int) -> set[str]:
    """What a `type_mask` gives, said bit by bit: any ignore bit of a triple ignores it whole."""
    parts = {name for name, bits in TRIPLES.items() if not any(mask & bit for bit in bits)}
    return parts | {n for n, bit in (("yaw", YAW), ("yaw_rate", YAW_RATE)) if not mask & bit}


def given_parts(mask: int, kind: str, stack: str = "generic") -> set[str]:
    """What a vehicle follows of a message with this `type_mask`; nothing: it refuses it."""
    parts = named_parts(mask)
    motion, turn = parts & set(TRIPLES), parts - set(TRIPLES)
    pushed = bool(mask & FORCE) and "acceleration" in parts
    match stack, kind:
        case "ardupilot", "quadcopter":
            with_velocity = "velocity" in motion
            legal = with_velocity or motion in ({"position"}, {"acceleration"})
            return parts if legal and not pushed else set()
        case "ardupilot", "rover":
            if "acceleration" in motion:
                return set()
            one_at_most = len(turn) <= 1 and len(parts) >= 1
            return parts if "position" in motion or one_at_most else set()
        case "px4", _:
            follows = parts if kind == "quadcopter" else parts - {"acceleration"}
            return follows if follows & set(TRIPLES) and not pushed else set()
    return set() if pushed else parts if kind == "quadcopter" else parts - {"acceleration"}


def parts_of(setpoint: Setpoint) -> set[str]:
    return {name for name, value in setpoint._asdict().items() if value is not None}


def mask_of(parts: set[str]) -> int:
    bits = {n: sum(b) for n, b in TRIPLES.items()} | {"yaw": YAW, "yaw_rate": YAW_RATE}
    return sum(b for name, b in bits.items() if name not in parts)


@pytest.mark.parametrize(("stack", "kind"), EVERY_VEHICLE)
def test_every_type_mask_sets_the_parts_it_names_or_is_refused(stack, kind):
    for make, frames in zip((local, world), FRAMES_OF[stack], strict=True):
        fields = SAMPLE if make is local else {f: SAMPLE[f] for f in FIELDS[3:]}
        for frame, mask in product(frames, range(4096)):
            message = make(mask, frame, **fields)
            expected = given_parts(mask, kind, stack)
            if expected:
                target = parse(message, kind, stack=stack)
                assert parts_of(target.setpoint) == expected, hex(mask)
                assert target.type_mask == mask_of(expected), "it says what is followed"
            else:
                with pytest.raises(IllegalTarget):
                    parse(message, kind, stack=stack)


@pytest.mark.parametrize("stack", STACKS)
@pytest.mark.parametrize("make", [local, world])
def test_every_other_frame_is_refused_whatever_the_mask(make, stack):
    known = FRAMES_OF[stack][make is world]
    for frame in set(range(256)) - set(known):
        for mask in range(0, 4096, 37):
            with pytest.raises(IllegalTarget, match="frame"):
                parse(make(mask, frame), "quadcopter", stack=stack)


# What becomes of those that are refused


def refusal(message, kind, stack):
    with pytest.raises(IllegalTarget) as caught:
        parse(message, kind, stack=stack)
    return caught.value


WRONG = {"frame": local(0xDF8, 2), "mask": local(0xFFF)}


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize(("stack", "kind"), EVERY_VEHICLE)
def test_a_target_that_says_nothing_stops_a_copter_and_leaves_ardurover_and_px4_alone(
    wrong, stack, kind
):
    drops = stack == "px4" or (stack, kind) == ("ardupilot", "rover")
    assert refusal(WRONG[wrong], kind, stack).drops is drops


@pytest.mark.parametrize("kind", KINDS)
def test_ardupilot_says_nothing_about_a_target_with_nothing_in_it(kind):
    assert refusal(local(0xFFF), kind, "ardupilot").text == ""


@pytest.mark.parametrize("kind", KINDS)
def test_px4_names_the_message_that_it_does_not_take(kind):
    nothing, frame = (refusal(WRONG[w], kind, "px4") for w in ("mask", "frame"))
    assert nothing.text == "SET_POSITION_TARGET_LOCAL_NED invalid"
    assert frame.text == "SET_POSITION_TARGET_LOCAL_NED coordinate frame 2 unsupported"
    assert nothing.severity == frame.severity == mav.MAV_SEVERITY_CRITICAL
    terrain = refusal(world(0xDF8, 10), kind, "px4")
    assert terrain.text == "SET_POSITION_TARGET_GLOBAL_INT coordinate frame 10 unsupported"


@pytest.mark.parametrize("make", [local, world])
@pytest.mark.parametrize("mask", [0xC3F, 0xC00, 0xC07, 0xE3F, 0x000])
def test_ardurover_ignores_whatever_has_an_acceleration_and_says_so(mask, make):
    told = refusal(make(mask), "rover", "ardupilot")
    name = make(mask).get_type()
    assert (told.text, told.drops) == (f"Ignoring {name}; set ACC_IGNORE in mask", True)
    assert told.severity == mav.MAV_SEVERITY_INFO


@pytest.mark.parametrize(("stack", "kind"), EVERY_VEHICLE)
@pytest.mark.parametrize("bad", [nan, inf, 1e30])
def test_an_absurd_value_stops_every_vehicle_and_is_named(stack, kind, bad):
    told = refusal(local(0xDC7, vx=bad), kind, stack)
    assert not told.drops
    assert told.text.startswith("Target refused: velocity")


@pytest.mark.parametrize("stack", STACKS)
def test_a_force_bit_without_an_acceleration_means_nothing(stack):
    target = parse(local(FORCE | 0xDF8, x=1.0), "quadcopter", stack=stack)
    assert target.setpoint == Setpoint(position=Vec3(1, 0, 0))


# Values


def test_the_local_frame_is_taken_as_it_is():
    s = parse(local(0, **SAMPLE), "quadcopter").setpoint
    assert s[:3] == (Vec3(1, 2, 3), Vec3(0.4, 0.5, 0.6), Vec3(0.07, 0.08, 0.09))
    assert s[3:] == pytest.approx((0.3, -0.2))


def test_an_offset_counts_from_here_along_the_compass():
    s = parse(local(0, OFFSET, **SAMPLE), "quadcopter").setpoint
    assert s.position == Vec3(11.0, -18.0, -2.0)
    assert s.velocity == Vec3(0.4, 0.5, 0.6)
    assert s.yaw == pytest.approx(0.3)


@given(st.floats(-pi, pi), st.sampled_from([BODY, BODY_OFFSET]))
def test_body_frames_turn_with_the_vehicle(yaw, frame):
    here = Here(HERE.position, yaw, HERE.home_down, ORIGIN)
    s = parse(local(0, frame, x=2.0, vx=1.0, vy=0.5, afx=0.1, z=-1.0), "quadcopter", here).setpoint
    assert isclose(s.position.north, 10 + 2 * cos(yaw), abs_tol=1e-9)
    assert isclose(s.position.east, -20 + 2 * sin(yaw), abs_tol=1e-9)
    assert s.position.down == -6.0
    assert isclose(s.velocity.north, cos(yaw) - 0.5 * sin(yaw), abs_tol=1e-9)
    assert isclose(s.velocity.east, sin(yaw) + 0.5 * cos(yaw), abs_tol=1e-9)
    assert isclose(s.acceleration.north, 0.1 * cos(yaw), abs_tol=1e-9)


@given(st.floats(-pi, pi), st.floats(-10, 10))
def test_yaw_is_relative_in_body_frames_only_and_always_wrapped(yaw, wanted):
    here = Here(HERE.position, yaw, HERE.home_down, ORIGIN)
    for frame in LOCAL_FRAMES:
        mask = EVERYTHING_IGNORED & ~YAW
        got = parse(local(mask, frame, yaw=wanted), "quadcopter", here).setpoint.yaw
        expected = wanted + (yaw if frame in (BODY, BODY_OFFSET) else 0.0)
        assert -pi <= got < pi
        assert isclose(cos(got), cos(expected), abs_tol=1e-9)
        assert isclose(sin(got), sin(expected), abs_tol=1e-9)


def test_forward_in_the_body_frame_of_a_vehicle_that_looks_east_is_east():
    here = Here(Vec3(), pi / 2, 0.0, ORIGIN)
    v = parse(local(0xDC7, BODY, vx=1.0), "quadcopter", here).setpoint.velocity
    assert isclose(v.east, 1.0)
    assert isclose(v.north, 0.0, abs_tol=1e-9)


@given(st.floats(-3000, 3000), st.floats(-3000, 3000), st.floats(-50, 400), st.floats(-180, 180))
def test_global_and_local_targets_agree(north, east, up, lon):
    origin = Origin(47.0, lon, 400.0)
    here = Here(Vec3(5, 6, -7), 1.0, -30.0, origin)  # home is 30 m above the origin
    lat_deg, lon_deg = origin.to_geodetic(north, east)
    for frames, altitude in ((AMSL, 400.0 + up), (ABOVE_HOME, up - 30.0)):
        for frame in frames:
            p = parse(world(0xDF8, frame, lat_deg, lon_deg, altitude), "rover", here)
            assert p.setpoint.position == pytest.approx((north, east, -up), abs=0.02)


@pytest.mark.parametrize(
    ("lat", "lon"), [(91, 8), (-91, 8), (47, 181), (47, -181), (0, 0), (-47, 8), (47, -100)]
)
def test_no_such_place_or_the_other_side_of_the_earth_is_refused(lat, lon):
    with pytest.raises(IllegalTarget, match=r"place|out of range"):
        parse(world(0xDF8, 0, lat, lon), "quadcopter")
    assert parse(world(0xDC7, 0, lat, lon, vx=1.0), "quadcopter").setpoint.velocity


# Fields that no one should have sent


def used_by(mask: int, kind: str) -> set[str]:
    parts = given_parts(mask, kind)
    of = {"position": "x y z", "velocity": "vx vy vz", "acceleration": "afx afy afz"}
    return {f for part in parts for f in of.get(part, part).split()}


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
@pytest.mark.parametrize("bad", [nan, inf, -inf, 3e38, -3e38])
def test_absurd_values_are_refused_where_used_and_harmless_where_not(bad, kind):
    for mask in range(4096):
        if mask & FORCE or not used_by(mask, kind):
            continue
        name = FIELDS[mask % len(FIELDS)]
        message = local(mask, LOCAL, **{**SAMPLE, name: bad})
        if name in used_by(mask, kind):
            with pytest.raises(IllegalTarget, match="out of range"):
                parse(message, kind)
        else:
            clean = parse(local(mask, LOCAL, **SAMPLE), kind)
            assert parse(message, kind).setpoint == clean.setpoint


@pytest.mark.parametrize("name", FIELDS)
def test_each_field_is_checked(name):
    for frame in LOCAL_FRAMES:
        with pytest.raises(IllegalTarget):
            parse(local(0, frame, **{**SAMPLE, name: nan}), "quadcopter")
    if name not in "xyz":
        with pytest.raises(IllegalTarget):
            parse(world(0, **{name: inf}), "quadcopter")


def test_altitude_is_checked():
    for frame in AMSL + ABOVE_HOME:
        for alt in (nan, inf, -3e38):
            with pytest.raises(IllegalTarget):
                parse(world(0, frame, alt=alt), "quadcopter")


def test_speeds_beyond_1000_are_refused():
    assert parse(local(0xDC7, vx=999.0), "quadcopter")
    with pytest.raises(IllegalTarget, match="velocity"):
        parse(local(0xDC7, vx=1001.0), "quadcopter")


ANY_FLOAT = st.floats(width=32)
ANY_LOCAL = st.builds(
    mav.MAVLink_set_position_target_local_ned_message,
    st.integers(0, 2**32 - 1),
    st.just(1),
    st.just(1),
    st.sampled_from([*LOCAL_FRAMES, 0, 2, 255]),
    st.integers(0, 0xFFFF),
    *(ANY_FLOAT for _ in FIELDS),
)
ANY_WORLD = st.builds(
    mav.MAVLink_set_position_target_global_int_message,
    st.integers(0, 2**32 - 1),
    st.just(1),
    st.just(1),
    st.sampled_from([*AMSL, *ABOVE_HOME, 1, 255]),
    st.integers(0, 0xFFFF),
    st.integers(-(2**31), 2**31 - 1),
    st.integers(-(2**31), 2**31 - 1),
    *(ANY_FLOAT for _ in FIELDS[2:]),
)


@given(st.one_of(ANY_LOCAL, ANY_WORLD), st.sampled_from(EVERY_VEHICLE))
def test_whatever_the_wire_can_carry_is_a_finite_setpoint_or_a_reason(message, vehicle):
    (message,) = Codec(1).decode(Codec(255).encode([message]))
    stack, kind = vehicle
    try:
        target = parse(message, kind, stack=stack)
    except IllegalTarget:
        return
    for part in target.at(0.3):
        for value in part if isinstance(part, Vec3) else (part,):
            assert value is None or abs(value) < 1e8


# A rover's turn rate, and time-outs


def test_a_rover_with_speed_and_turn_rate_goes_where_it_looks_now():
    target = parse(local(0x5C7, BODY, vx=0.5, yaw_rate=0.2), "rover")
    for yaw in (0.0, 1.0, -2.0):
        v = target.at(yaw).velocity
        assert v == pytest.approx((0.5 * cos(yaw), 0.5 * sin(yaw), 0.0))


@pytest.mark.parametrize("stack", STACKS)
@pytest.mark.parametrize(("mask", "turn"), [(0x5C7, {"yaw_rate": 0.2}), (0x9C7, {"yaw": 2.0})])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_rover_that_turns_takes_the_speed_along_its_nose_and_reverses_on_a_negative_vx(
    stack, mask, turn, sign
):
    for frame in FRAMES_OF[stack][0]:
        target = parse(local(mask, frame, vx=sign * 0.3, vy=0.4, **turn), "rover", stack=stack)
        for yaw in (0.0, 1.0, -2.0):
            expected = (sign * 0.5 * cos(yaw), sign * 0.5 * sin(yaw), 0.0)
            assert target.at(yaw).velocity == pytest.approx(expected)
    target = parse(world(mask, vx=sign * 0.5, **turn), "rover", stack=stack)
    assert target.at(0.0).velocity == pytest.approx((sign * 0.5, 0.0, 0.0))


@pytest.mark.parametrize("stack", STACKS)
def test_a_velocity_alone_is_a_course_fixed_when_it_came(stack):
    target = parse(local(0xDC7, BODY, vx=-0.6, vy=0.8), "rover", stack=stack)
    for yaw in (0.0, 1.0, -2.0):
        v = target.at(yaw).velocity
        assert hypot(v.north, v.east) == pytest.approx(1.0)
        assert v.north == pytest.approx(-0.6 * cos(HERE.yaw) - 0.8 * sin(HERE.yaw))


def test_only_a_rover_without_position_drives_by_its_own_heading():
    both = {"vx": 0.5, "yaw_rate": 0.2}
    assert parse(local(0x5C7, BODY, **both), "quadcopter").forward_speed is None
    assert parse(local(0x5C0, LOCAL, **both), "rover").forward_speed is None
    assert parse(local(0xDC7, LOCAL, vx=0.5), "rover").forward_speed is None


def test_what_outlives_the_time_out_is_position_and_yaw():
    kept = parse(local(0, **{**SAMPLE, "yaw": 0.0}), "quadcopter").expired()
    assert kept == PositionTarget(Setpoint(position=Vec3(1, 2, 3), yaw=0.0), 0x9F8)
    assert parse(local(0xDC7, vx=1.0), "quadcopter").expired() is None
    assert parse(local(0x9FF, yaw=1.0), "quadcopter").expired() is None


def test_a_place_alone_does_not_change_when_it_expires():
    for yaw in (None, 0.0, 1.0):
        place = to_place(Vec3(1, 2, -3), yaw)
        assert place.type_mask == (0xDF8 if yaw is None else 0x9F8)
        assert place.expired() == place


# NAV_SET_YAW_SPEED


def test_a_rover_takes_a_heading_and_a_speed_as_a_command(rover):
    rover.fly()
    assert rover.command(mav.MAV_CMD_NAV_SET_YAW_SPEED, 90, 0.8) == 0
    rover.run(2.9)
    assert yaw_of(rover.where[6:10]) == pytest.approx(pi / 2, abs=0.05)
    assert rover.where.v_east == pytest.approx(0.8, abs=0.05)
    assert rover.command(mav.MAV_CMD_NAV_SET_YAW_SPEED, 90, -0.5, 1) == 0
    rover.run(2.9)
    assert abs(wrap_angle(yaw_of(rover.where[6:10]) - pi)) < 0.05, "relative to its heading"
    assert rover.where.v_north == pytest.approx(0.5, abs=0.05), "backwards"
    rover.run(3)
    assert abs(rover.where.v_north) < 0.01, "expired"


def test_a_heading_and_speed_need_guided_and_a_rover(rover, quad):
    assert rover.command(mav.MAV_CMD_NAV_SET_YAW_SPEED, 90, 0.8) == 4
    assert quad.command(mav.MAV_CMD_NAV_SET_YAW_SPEED, 90, 0.8) == 3
