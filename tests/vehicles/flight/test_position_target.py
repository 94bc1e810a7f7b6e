"""Every SET_POSITION_TARGET is a setpoint with the parts it names, or a reason to hold."""

from math import cos, inf, isclose, nan, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.transport.frames import Origin
from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.flight.position_target import Here, IllegalTarget, PositionTarget, parse
from mavherd.vehicles.robot import Setpoint, Vec3

ORIGIN = Origin()
HERE = Here(position=Vec3(10.0, -20.0, -5.0), yaw=0.7, home_down=-1.0, origin=ORIGIN)

POSITION, VELOCITY, ACCELERATION = (1, 2, 4), (8, 16, 32), (64, 128, 256)
FORCE, YAW, YAW_RATE = 512, 1024, 2048
EVERYTHING_IGNORED = 0xDFF

LOCAL, OFFSET, BODY, BODY_OFFSET = 1, 7, 8, 9
LOCAL_FRAMES = (LOCAL, OFFSET, BODY, BODY_OFFSET)
AMSL, ABOVE_HOME = (0, 5), (3, 6, 10, 11)
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


def given_parts(mask: int, kind: str) -> set[str]:
    """What a `type_mask` gives, said bit by bit: any ignore bit of a triple ignores it whole."""
    triples = {"position": POSITION, "velocity": VELOCITY, "acceleration": ACCELERATION}
    parts = {name for name, bits in triples.items() if not any(mask & bit for bit in bits)}
    if kind == "rover":
        parts.discard("acceleration")
    return parts | {n for n, bit in (("yaw", YAW), ("yaw_rate", YAW_RATE)) if not mask & bit}


def parts_of(setpoint: Setpoint) -> set[str]:
    return {name for name, value in setpoint._asdict().items() if value is not None}


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
@pytest.mark.parametrize(
    ("make", "frame"),
    [(local, f) for f in LOCAL_FRAMES] + [(world, f) for f in AMSL + ABOVE_HOME],
)
def test_every_type_mask_sets_the_parts_it_names_or_holds(make, frame, kind):
    fields = SAMPLE if make is local else {f: SAMPLE[f] for f in FIELDS[3:]}
    for mask in range(4096):
        message = make(mask, frame, **fields)
        expected = set() if mask & FORCE else given_parts(mask, kind)
        if expected:
            target = parse(message, kind, HERE)
            assert parts_of(target.setpoint) == expected, hex(mask)
            assert target.type_mask == mask
        else:
            with pytest.raises(IllegalTarget):
                parse(message, kind, HERE)


@pytest.mark.parametrize("make", [local, world])
def test_every_other_frame_is_refused_whatever_the_mask(make):
    known = LOCAL_FRAMES if make is local else AMSL + ABOVE_HOME
    for frame in set(range(256)) - set(known):
        for mask in range(0, 4096, 37):
            with pytest.raises(IllegalTarget, match=r"frame|force"):
                parse(make(mask, frame), "quadcopter", HERE)


# Values


def test_the_local_frame_is_taken_as_it_is():
    s = parse(local(0, **SAMPLE), "quadcopter", HERE).setpoint
    assert s[:3] == (Vec3(1, 2, 3), Vec3(0.4, 0.5, 0.6), Vec3(0.07, 0.08, 0.09))
    assert s[3:] == pytest.approx((0.3, -0.2))


def test_an_offset_counts_from_here_along_the_compass():
    s = parse(local(0, OFFSET, **SAMPLE), "quadcopter", HERE).setpoint
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
        parse(world(0xDF8, 0, lat, lon), "quadcopter", HERE)
    assert parse(world(0xDC7, 0, lat, lon, vx=1.0), "quadcopter", HERE).setpoint.velocity


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
                parse(message, kind, HERE)
        else:
            clean = parse(local(mask, LOCAL, **SAMPLE), kind, HERE)
            assert parse(message, kind, HERE).setpoint == clean.setpoint


@pytest.mark.parametrize("name", FIELDS)
def test_each_field_is_checked(name):
    for frame in LOCAL_FRAMES:
        with pytest.raises(IllegalTarget):
            parse(local(0, frame, **{**SAMPLE, name: nan}), "quadcopter", HERE)
    if name not in "xyz":
        with pytest.raises(IllegalTarget):
            parse(world(0, **{name: inf}), "quadcopter", HERE)


def test_altitude_is_checked():
    for frame in AMSL + ABOVE_HOME:
        for alt in (nan, inf, -3e38):
            with pytest.raises(IllegalTarget):
                parse(world(0, frame, alt=alt), "quadcopter", HERE)


def test_speeds_beyond_1000_are_refused():
    assert parse(local(0xDC7, vx=999.0), "quadcopter", HERE)
    with pytest.raises(IllegalTarget, match="velocity"):
        parse(local(0xDC7, vx=1001.0), "quadcopter", HERE)


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


@given(st.one_of(ANY_LOCAL, ANY_WORLD), st.sampled_from(["quadcopter", "rover"]))
def test_whatever_the_wire_can_carry_is_a_finite_setpoint_or_a_reason(message, kind):
    (message,) = Codec(1).decode(Codec(255).encode([message]))
    try:
        target = parse(message, kind, HERE)
    except IllegalTarget:
        return
    for part in target.at(0.3):
        for value in part if isinstance(part, Vec3) else (part,):
            assert value is None or abs(value) < 1e8


# A rover's turn rate, and time-outs


def test_a_rover_with_speed_and_turn_rate_goes_where_it_looks_now():
    target = parse(local(0x5C7, BODY, vx=0.5, yaw_rate=0.2), "rover", HERE)
    for yaw in (0.0, 1.0, -2.0):
        v = target.at(yaw).velocity
        assert v == pytest.approx((0.5 * cos(yaw), 0.5 * sin(yaw), 0.0))


def test_a_rover_reverses_on_a_negative_body_speed():
    target = parse(local(0x5C7, BODY, vx=-0.5, yaw_rate=0.2), "rover", HERE)
    assert target.at(0.0).velocity == pytest.approx((-0.5, 0.0, 0.0))


def test_only_a_rover_without_position_drives_by_its_own_heading():
    both = {"vx": 0.5, "yaw_rate": 0.2}
    assert parse(local(0x5C7, BODY, **both), "quadcopter", HERE).forward_speed is None
    assert parse(local(0x5C0, LOCAL, **both), "rover", HERE).forward_speed is None
    assert parse(local(0xDC7, LOCAL, vx=0.5), "rover", HERE).forward_speed is None


def test_what_outlives_the_time_out_is_position_and_yaw():
    kept = parse(local(0, **{**SAMPLE, "yaw": 0.0}), "quadcopter", HERE).expired()
    assert kept == PositionTarget(Setpoint(position=Vec3(1, 2, 3), yaw=0.0), 0x9F8)
    assert parse(local(0xDC7, vx=1.0), "quadcopter", HERE).expired() is None
    assert parse(local(0x9FF, yaw=1.0), "quadcopter", HERE).expired() is None
