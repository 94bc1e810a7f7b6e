"""SET_ATTITUDE_TARGET means what ArduPilot, PX4 and the rover say it means (mavlink.md A3)."""

from contextlib import suppress
from functools import cache
from math import cos, inf, nan, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.flight.attitude_target import AttitudeTarget, parse_attitude
from mavherd.vehicles.flight.autopilot import Autopilot
from mavherd.vehicles.flight.position_target import IllegalTarget
from mavherd.vehicles.robot import AttitudeSetpoint
from mavherd.vehicles.vehicle import Vehicle

NO_RATES = 0x07
NO_THRUST = 0x40
NO_ATTITUDE = 0x80
THRUST_BODY = 0x20
LEVEL = (1.0, 0.0, 0.0, 0.0)


def quaternion(roll=0.0, pitch=0.0, yaw=0.0):
    cr, sr, cp, sp, cy, sy = (f(a / 2) for a in (roll, pitch, yaw) for f in (cos, sin))
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def message(mask, q=LEVEL, rates=(0.0, 0.0, 0.0), thrust=0.5):
    """Return the message as it comes out of a codec."""
    sent = mav.MAVLink_set_attitude_target_message(0, 1, 1, mask, list(q), *rates, thrust)
    (received,) = Codec(1).decode(Codec(255).encode([sent]))
    return received


@cache
def autopilot_of(kind, personality) -> Autopilot:
    return Vehicle(VehicleConfig(kind=kind, system_id=1, autopilot=personality)).autopilot


def parse(m, kind="quadcopter", personality="ardupilot", guided_options=0) -> AttitudeSetpoint:
    autopilot = autopilot_of(kind, personality)
    autopilot.settings.guided_options = guided_options
    target = parse_attitude(m, autopilot)
    assert isinstance(target, AttitudeTarget)
    assert target.type_mask == m.type_mask
    return target.setpoint


def near(setpoint):
    return tuple(v if v is None else pytest.approx(v, abs=1e-6) for v in setpoint)


@pytest.mark.parametrize("angles", [(0, 0, 0), (0.3, -0.2, 1.0), (-0.4, 0.5, -3.0), (0, 1.2, 2.0)])
def test_the_quaternion_gives_roll_pitch_and_yaw(angles):
    setpoint = parse(message(NO_RATES, quaternion(*angles)))
    assert setpoint == near(AttitudeSetpoint(*angles, climb_rate=0.0))


@pytest.mark.parametrize(
    ("thrust", "climb"), [(0.5, 0.0), (1.0, 2.5), (0.75, 1.25), (0.0, -1.5), (0.25, -0.75)]
)
def test_thrust_is_a_climb_rate_within_the_limits_by_default(thrust, climb):
    setpoint = parse(message(NO_RATES, thrust=thrust))
    assert setpoint.thrust is None
    assert setpoint.climb_rate == pytest.approx(climb)


def test_thrust_beyond_its_range_is_full():
    assert parse(message(NO_RATES, thrust=7.0)).climb_rate == pytest.approx(2.5)
    assert parse(message(NO_RATES, thrust=-7.0)).climb_rate == pytest.approx(-1.5)


@pytest.mark.parametrize(("personality", "options"), [("ardupilot", 8), ("px4", 0)])
def test_thrust_is_thrust_where_guid_options_or_px4_say_so(personality, options):
    setpoint = parse(message(NO_RATES, thrust=0.6), "quadcopter", personality, options)
    assert setpoint.climb_rate is None
    assert setpoint.thrust == pytest.approx(0.6)
    assert parse(message(NO_RATES, thrust=-1.0), "quadcopter", personality, options).thrust == 0.0


@pytest.mark.parametrize(
    ("bit", "reason"), [(NO_THRUST, "no thrust"), (THRUST_BODY, "thrust_body is not supported")]
)
def test_a_thrust_must_be_given(bit, reason):
    with pytest.raises(IllegalTarget, match=reason):
        parse(message(NO_RATES | bit))


@pytest.mark.parametrize("q", [(0, 0, 0, 0), (1, 0.1, 0, 0), (0.9, 0, 0, 0), (nan, 0, 0, 0)])
def test_the_quaternion_must_be_of_unit_length(q):
    with pytest.raises(IllegalTarget, match="unit length"):
        parse(message(NO_RATES, q))


def test_a_hair_off_unit_length_will_do():
    assert parse(message(NO_RATES, (1.0005, 0, 0, 0))).roll == 0.0


def test_an_ignored_quaternion_may_be_anything():
    setpoint = parse(message(NO_ATTITUDE, (nan,) * 4, rates=(0.1, 0.2, 0.3)))
    rates = AttitudeSetpoint(roll_rate=0.1, pitch_rate=0.2, yaw_rate=0.3, climb_rate=0.0)
    assert setpoint == near(rates)


@pytest.mark.parametrize("mask", [0x01, 0x02, 0x04, 0x05, 0x06])
def test_some_body_rates_without_the_others_are_refused(mask):
    with pytest.raises(IllegalTarget, match="all three or none"):
        parse(message(mask))


def test_a_yaw_rate_beside_an_attitude_turns_on_from_where_it_is():
    q = quaternion(0.1, 0.0, 2.0)
    for mask in (0x03, 0x00):
        setpoint = parse(message(mask, q, rates=(0.0, 0.0, 0.4)))
        assert setpoint.yaw is None
        assert setpoint.yaw_rate == pytest.approx(0.4)
        assert parse(message(mask, q)).yaw == pytest.approx(2.0)


@pytest.mark.parametrize("mask", [NO_ATTITUDE | NO_RATES, NO_ATTITUDE | 0x03])
def test_neither_attitude_nor_body_rates_is_refused(mask):
    with pytest.raises(IllegalTarget, match="sets no attitude"):
        parse(message(mask))


@pytest.mark.parametrize("value", [nan, inf, -inf, 1e30])
def test_absurd_numbers_are_refused(value):
    with pytest.raises(IllegalTarget, match="body_roll_rate"):
        parse(message(NO_ATTITUDE, rates=(value, 0.0, 0.0)))
    if abs(value) != 1e30:
        with pytest.raises(IllegalTarget, match="thrust"):
            parse(message(NO_RATES, thrust=value))


def test_a_rover_takes_the_heading_and_a_share_of_its_speed():
    m = message(NO_RATES, quaternion(yaw=-2.0), thrust=0.4)
    assert parse(m, "rover") == near(AttitudeSetpoint(yaw=-2.0, thrust=0.4))
    back = message(NO_RATES, thrust=-3.0)
    assert parse(back, "rover").thrust == -1.0


def test_a_rover_prefers_the_yaw_rate():
    m = message(0x03, quaternion(yaw=1.0), rates=(0.0, 0.0, -0.5), thrust=0.4)
    assert parse(m, "rover") == near(AttitudeSetpoint(yaw_rate=-0.5, thrust=0.4))


def test_a_rover_needs_one_of_them():
    with pytest.raises(IllegalTarget, match="no heading"):
        parse(message(NO_ATTITUDE | NO_RATES), "rover")


floats = st.floats(width=32)


@given(
    st.integers(0, 255),
    st.tuples(floats, floats, floats, floats),
    st.tuples(floats, floats, floats),
    floats,
    st.sampled_from(["quadcopter", "rover"]),
)
def test_any_message_is_a_target_or_refused(mask, q, rates, thrust, kind):
    with suppress(IllegalTarget):
        setpoint = parse(message(mask, q, rates, thrust), kind)
        assert all(v is None or abs(v) <= 100 for v in setpoint)
        assert setpoint.yaw is None or abs(setpoint.yaw) <= pi


# Flown


def attitude(desk, mask, q=LEVEL, rates=(0.0, 0.0, 0.0), thrust=0.5):
    system = desk.vehicle.config.system_id
    return mav.MAVLink_set_attitude_target_message(0, system, 1, mask, list(q), *rates, thrust)


def stream(desk, seconds, *args, **fields):
    for _ in range(round(seconds * 10)):
        desk.send(attitude(desk, *args, **fields))
        desk.run(0.1)
    return desk.where


def test_a_copter_leans_and_climbs_as_told_then_holds(quad):
    quad.fly(10)
    k = stream(quad, 2, NO_RATES, quaternion(roll=0.1), thrust=0.7)
    assert k.v_east > 0.8
    assert k.v_down == pytest.approx(-0.4 * 2.5, abs=0.05)
    quad.run(8)  # GUID_TIMEOUT, then a hold
    k = quad.where
    assert (k.v_north, k.v_east, k.v_down) == pytest.approx((0, 0, 0), abs=0.02)
    assert quad.autopilot.armed


def test_a_refused_attitude_target_means_hold_and_says_why(quad, texts):
    quad.fly(5)
    stream(quad, 1, NO_RATES, quaternion(pitch=-0.2))
    quad.send(attitude(quad, NO_RATES, (nan,) * 4))
    said = texts(quad.run(5))
    assert "Target refused: quaternion not of unit length" in said
    assert abs(quad.where.v_north) < 0.02


def test_attitude_targets_outside_guided_are_not_heeded(quad):
    quad.fly(5)
    quad.command(mav.MAV_CMD_DO_SET_MODE, 1, 17)  # BRAKE
    k = stream(quad, 2, NO_RATES, quaternion(pitch=-0.2), thrust=1.0)
    assert (k.v_north, k.v_down) == pytest.approx((0, 0), abs=0.02)


def test_a_rover_drives_as_told(rover):
    rover.fly()
    k = stream(rover, 4, NO_RATES, quaternion(yaw=0.5), thrust=0.5)
    assert (k.v_north, k.v_east) == pytest.approx((0.5 * cos(0.5), 0.5 * sin(0.5)), abs=0.02)
    k = stream(rover, 2, 0x03, rates=(0, 0, -0.4), thrust=0.0)
    assert k.yaw_rate == pytest.approx(-0.4, abs=0.02)
    rover.run(5)
    assert abs(rover.where.yaw_rate) < 0.01
