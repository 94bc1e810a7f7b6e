"""Arming is refused by name, granted when it should be, and taken back on the ground."""

import pytest

from mavherd.transport.mavlink import mav

ACCEPTED, REJECTED, DENIED, FAILED = 0, 1, 2, 4
ARM, SET_MODE, TAKEOFF, PREARM = 400, 176, 22, 401
FORCE = 21196
VELOCITY = 0xDC7
STABILIZE, AUTO, GUIDED, LOITER, RTL, LAND, BRAKE = 0, 3, 4, 5, 6, 9, 17
LOW_BATTERY = "Battery 1 low capacity failsafe"


def put(desk, **values):
    for name, value in values.items():
        desk.autopilot.parameters.set(name, value)


def spoil(desk):
    """Give the vehicle a battery that forbids arming."""
    put(desk, BATT_LOW_MAH=3000, HERD_BATT_CHARGE=0.5)
    desk.run(0.3)


def push(desk, seconds, **velocity):
    out = []
    for _ in range(round(seconds / 0.5)):
        desk.send(desk.target(VELOCITY, **velocity))
        out += desk.run(0.5)
    return out


# Refusals


@pytest.mark.parametrize(
    ("mode", "reason"),
    [(RTL, "RTL mode not armable"), (AUTO, "Mode requires mission")],
)
def test_modes_that_cannot_be_armed_say_so_as_arducopter_does(quad, texts, mode, reason):
    assert quad.command(SET_MODE, 1, mode) == ACCEPTED
    assert quad.command(ARM, 1) == FAILED
    assert f"Arm: {reason}" in texts(quad.run(0.1))
    assert not quad.autopilot.armed


def test_a_rover_in_rtl_says_so_as_ardurover_does(rover, texts):
    assert rover.command(SET_MODE, 1, 11) == ACCEPTED
    assert rover.command(ARM, 1) == FAILED
    assert "Arm: Mode not armable" in texts(rover.run(0.1))


@pytest.mark.parametrize("mode", [STABILIZE, GUIDED, LOITER, LAND, BRAKE])
def test_on_the_ground_every_other_mode_can_be_armed(quad, mode):
    assert quad.command(SET_MODE, 1, mode) == ACCEPTED
    assert quad.command(ARM, 1) == ACCEPTED


def test_the_refusal_is_critical_and_names_the_reason(quad):
    spoil(quad)
    assert quad.command(ARM, 1) == FAILED
    (text,) = (m for m in quad.run(0.1) if m.get_type() == "STATUSTEXT")
    assert (text.severity, text.text) == (mav.MAV_SEVERITY_CRITICAL, f"Arm: {LOW_BATTERY}")


def test_force_skips_the_checks(quad):
    spoil(quad)
    assert quad.command(ARM, 1, FORCE) == ACCEPTED
    assert quad.autopilot.armed


@pytest.mark.parametrize(
    ("mask", "result"), [(0, ACCEPTED), (1, FAILED), (256, FAILED), (64, ACCEPTED), (257, FAILED)]
)
def test_arming_check_says_what_is_checked(quad, mask, result):
    spoil(quad)
    put(quad, ARMING_CHECK=mask)
    assert quad.command(ARM, 1) == result


def test_a_raised_throttle_hinders_arming_in_stabilize_but_not_in_guided(quad, texts):
    quad.send(mav.MAVLink_manual_control_message(1, 0, 0, 600, 0, 0))
    quad.run(0.02)
    assert quad.command(ARM, 1) == FAILED
    assert "Arm: Throttle too high" in texts(quad.run(0.1))
    assert quad.command(SET_MODE, 1, GUIDED) == ACCEPTED
    assert quad.command(ARM, 1) == ACCEPTED


def test_prearm_texts_are_repeated_every_30_seconds_while_disarmed(quad, texts):
    quad.run(1)
    spoil(quad)
    assert texts(quad.run(89)) == [f"PreArm: {LOW_BATTERY}"] * 3
    assert quad.command(ARM, 1, FORCE) == ACCEPTED
    put(quad, DISARM_DELAY=0)
    assert not any(text.startswith("PreArm") for text in texts(quad.run(61)))


def test_a_healthy_vehicle_complains_of_nothing(quad, texts):
    assert texts(quad.run(65)) == []


def test_the_mode_is_no_prearm_complaint(quad, texts):
    quad.command(SET_MODE, 1, RTL)
    assert texts(quad.run(65)) == []
    assert quad.autopilot.arming.prearm_refusal() is None
    assert quad.autopilot.arming.refusal() == "RTL mode not armable"


def test_run_prearm_checks_tells_everything_at_once(quad, texts):
    assert quad.command(PREARM) == ACCEPTED
    assert texts(quad.run(0.1)) == []
    spoil(quad)
    put(quad, FENCE_ENABLE=1, FENCE_TYPE=4)
    assert quad.command(PREARM) == ACCEPTED
    assert texts(quad.run(0.1)) == [
        f"PreArm: {LOW_BATTERY}",
        "PreArm: Fences enabled, but none selected",
    ]


def test_run_prearm_checks_is_for_disarmed_vehicles(quad):
    assert quad.command(ARM, 1) == ACCEPTED
    assert quad.command(PREARM) == REJECTED


# Arming and disarming


@pytest.mark.parametrize(
    ("kind", "armed", "disarmed"),
    [
        ("quadcopter", "Arming motors", "Disarming motors"),
        ("rover", "Throttle armed", "Throttle disarmed"),
    ],
)
def test_what_is_said(desk, texts, kind, armed, disarmed):
    vehicle = desk(kind)
    assert vehicle.command(ARM, 1) == ACCEPTED
    assert armed in texts(vehicle.run(0.1))
    assert vehicle.command(ARM, 1) == ACCEPTED
    assert armed not in texts(vehicle.run(0.1))
    assert vehicle.command(ARM, 0) == ACCEPTED
    assert disarmed in texts(vehicle.run(0.1))


def test_in_the_air_only_force_disarms(quad):
    quad.fly(3)
    assert quad.command(ARM, 0) == FAILED
    assert quad.autopilot.armed
    assert quad.command(ARM, 0, FORCE) == ACCEPTED
    assert not quad.autopilot.armed


def test_in_the_air_only_force_arms_again(quad):
    quad.fly(20)
    assert quad.command(ARM, 0, FORCE) == ACCEPTED
    quad.run(0.2)
    assert quad.command(ARM, 1) == FAILED
    assert quad.command(ARM, 1, FORCE) == ACCEPTED
    quad.run(5)
    assert quad.autopilot.armed
    assert quad.autopilot.in_air


def test_without_a_takeoff_it_disarms_after_disarm_delay(quad, texts):
    assert quad.command(ARM, 1) == ACCEPTED
    quad.run(9.8)
    assert quad.autopilot.armed
    said = texts(quad.run(0.5))
    assert not quad.autopilot.armed
    assert "Disarming motors" in said


def test_disarm_delay_0_never_disarms(quad):
    put(quad, DISARM_DELAY=0)
    assert quad.command(ARM, 1) == ACCEPTED
    quad.run(60)
    assert quad.autopilot.armed


def test_a_rover_stays_armed(rover):
    assert rover.command(ARM, 1) == ACCEPTED
    rover.run(60)
    assert rover.autopilot.armed


@pytest.mark.parametrize("mode", [LAND, RTL])
def test_after_a_landing_it_disarms_soon(quad, mode):
    quad.fly(3)
    assert quad.command(SET_MODE, 1, mode) == ACCEPTED
    while quad.autopilot.in_air:
        quad.run(0.1)
        assert quad.now < 90
    quad.run(1)
    assert not quad.autopilot.armed


def test_a_landing_in_guided_disarms_after_disarm_delay(quad):
    quad.fly(3)
    while quad.autopilot.in_air:
        push(quad, 0.5, vz=0.7)
        assert quad.now < 30
    push(quad, 9, vz=0.7)
    assert quad.autopilot.armed
    push(quad, 2, vz=0.7)
    assert not quad.autopilot.armed


def test_arming_require_0_is_born_armed(desk):
    vehicle = desk("rover", params={"ARMING_REQUIRE": 0})
    vehicle.run(0.1)
    assert vehicle.autopilot.armed
    assert vehicle.command(ARM, 0) == ACCEPTED
    vehicle.run(1)
    assert not vehicle.autopilot.armed


def test_arming_and_disarming_are_in_a_heartbeat_at_once(quad):
    for value in (1, 0):
        assert quad.command(ARM, value) == ACCEPTED
        beats = [m for m in quad.run(0.01) if m.get_type() == "HEARTBEAT"]
        assert bool(beats[-1].base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED) is bool(value)


# PX4


def test_px4_denies_and_grants_in_its_own_words(desk, texts):
    quad = desk("quadcopter", autopilot="px4")
    assert quad.command(SET_MODE, 1, 6) == ACCEPTED  # OFFBOARD, and no setpoints
    assert quad.command(ARM, 1) == REJECTED
    said = "".join(texts(quad.run(0.1)))
    assert "Arming denied: Resolve system health failures first" in said
    assert quad.command(SET_MODE, 1, 4, 3) == ACCEPTED
    assert quad.command(ARM, 1) == ACCEPTED
    assert "Armed by external command" in texts(quad.run(0.1))
    said = texts(quad.run(11))
    assert "Disarmed by auto preflight disarming" in said
    assert not quad.autopilot.armed


def test_px4_disarms_by_landing_and_not_in_the_air(desk, texts):
    quad = desk("quadcopter", autopilot="px4")
    assert quad.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 488 + 3) == ACCEPTED
    assert quad.command(ARM, 1) == ACCEPTED
    quad.run(8)
    assert quad.autopilot.in_air
    assert quad.command(ARM, 0) == REJECTED
    assert "Disarming denied: not landed" in texts(quad.run(0.1))
    assert quad.command(SET_MODE, 1, 4, 6) == ACCEPTED
    said = texts(quad.run(20))
    assert "Disarmed by landing" in said
    assert not quad.autopilot.armed
