"""Every loss is told and met once, in the words of the flight stack, and the mode then stays."""

import pytest

from mavherd.transport.mavlink import Codec, mav

ACCEPTED, FAILED = 0, 4
ARM, SET_MODE = 400, 176
VELOCITY = 0xDC7
GUIDED, AUTO, RTL, LAND, BRAKE, STABILIZE, LOITER = 4, 3, 6, 9, 17, 0, 5
ROVER_MANUAL, ROVER_HOLD, ROVER_GUIDED, ROVER_RTL = 0, 4, 15, 11
PX4_HOLD, PX4_RTL, PX4_OFFBOARD = 0x3040000, 0x5040000, 0x60000


def put(desk, **values):
    for name, value in values.items():
        desk.autopilot.parameters.set(name, value)


def mode(desk):
    return desk.autopilot.modes.number(desk.autopilot.mode)


def station():
    return mav.MAVLink_heartbeat_message(mav.MAV_TYPE_GCS, 8, 0, 0, 0, 3)


def beat(desk, seconds, codec=None):
    """Send a heartbeat of the ground station once a second."""
    out = []
    for _ in range(round(seconds)):
        data = (codec or desk.codec).encode([station()])
        desk.vehicle.handle(data, desk.link)
        out += desk.run(1)
    return out


def sticks(desk, **axes):
    names = {"x": 0, "y": 0, "z": 500, "r": 0} | axes
    return mav.MAVLink_manual_control_message(1, buttons=0, **names)


# The ground station


@pytest.mark.parametrize(("value", "leads_to"), [(0, GUIDED), (1, RTL), (5, LAND), (7, BRAKE)])
def test_losing_the_ground_station_does_what_fs_gcs_enable_says(quad, texts, value, leads_to):
    put(quad, FS_GCS_ENABLE=value)
    quad.fly(5)
    beat(quad, 2)
    said = texts(quad.run(3.5))
    assert "GCS Failsafe" not in said
    assert mode(quad) == GUIDED
    said = texts(quad.run(2))
    assert ("GCS Failsafe" in said) is (value != 0)
    assert mode(quad) == leads_to
    assert quad.autopilot.failsafes.active is (value != 0)


def test_the_failsafe_is_told_once_and_the_mode_does_not_come_back(quad, texts):
    put(quad, FS_GCS_ENABLE=7)
    quad.fly(3)
    beat(quad, 1)
    said = texts(quad.run(10))
    assert said.count("GCS Failsafe") <= 1
    assert mode(quad) == BRAKE
    said = texts(beat(quad, 3))
    assert said.count("GCS Failsafe Cleared") == 1
    assert mode(quad) == BRAKE
    assert not quad.autopilot.failsafes.active


def test_whoever_changes_the_mode_afterwards_is_obeyed(quad):
    put(quad, FS_GCS_ENABLE=1)
    quad.fly(5)
    beat(quad, 1)
    quad.run(6)
    assert mode(quad) == RTL
    assert quad.command(SET_MODE, 1, GUIDED) == ACCEPTED
    quad.run(5)
    assert mode(quad) == GUIDED


def test_a_station_that_was_never_heard_is_not_lost(quad, texts):
    put(quad, FS_GCS_ENABLE=1)
    quad.fly(3)
    assert not any("GCS" in text for text in texts(quad.run(20)))
    assert mode(quad) == GUIDED


def test_only_the_station_of_sysid_mygcs_counts(desk, texts):
    quad = desk("quadcopter")
    put(quad, FS_GCS_ENABLE=1)
    quad.fly(3)
    beat(quad, 1)
    other = Codec(254, 190)
    assert "GCS Failsafe" in texts(beat(quad, 7, other))
    quad = desk("quadcopter")
    put(quad, FS_GCS_ENABLE=1)
    quad.fly(3)
    beat(quad, 1, Codec(254, 190))
    assert "GCS Failsafe" not in texts(quad.run(10))


def test_another_sysid_mygcs_has_not_been_heard_yet(quad, texts):
    put(quad, FS_GCS_ENABLE=1)
    quad.fly(3)
    beat(quad, 1)
    put(quad, SYSID_MYGCS=77)
    assert "GCS Failsafe" not in texts(quad.run(10))


def test_the_time_out_is_fs_gcs_timeout(quad):
    put(quad, FS_GCS_ENABLE=1, FS_GCS_TIMEOUT=12)
    quad.fly(3)
    beat(quad, 1)
    quad.run(10)
    assert mode(quad) == GUIDED
    quad.run(2)
    assert mode(quad) == RTL


def test_disarmed_nothing_happens_but_arming_is_refused(quad, texts):
    put(quad, FS_GCS_ENABLE=1)
    beat(quad, 1)
    said = texts(quad.run(10))
    assert "GCS Failsafe" not in said
    assert mode(quad) == STABILIZE
    assert quad.command(ARM, 1) == FAILED
    assert "Arm: GCS failsafe on" in texts(quad.run(0.1))
    beat(quad, 1)
    assert quad.command(ARM, 1) == ACCEPTED


def test_on_the_ground_a_copter_disarms(quad, texts):
    put(quad, FS_GCS_ENABLE=1, DISARM_DELAY=0)
    beat(quad, 1)
    assert quad.command(ARM, 1) == ACCEPTED
    said = texts(quad.run(8))
    assert "GCS Failsafe - Disarming" in said
    assert not quad.autopilot.armed
    assert not quad.autopilot.failsafes.active


@pytest.mark.parametrize(
    ("options", "in_mode", "text"),
    [(16, LOITER, "Continuing Pilot Control"), (8, LAND, "Continuing Landing")],
)
def test_fs_options_let_it_go_on(quad, texts, options, in_mode, text):
    put(quad, FS_GCS_ENABLE=1, FS_OPTIONS=options)
    quad.fly(12)
    beat(quad, 1)
    assert quad.command(SET_MODE, 1, in_mode) == ACCEPTED
    said = texts(quad.run(7))
    assert f"GCS Failsafe - {text}" in said
    assert mode(quad) == in_mode


def test_a_rover_holds_and_says_so(rover, texts):
    put(rover, FS_GCS_ENABLE=1)
    rover.fly()
    beat(rover, 1)
    said = texts(rover.run(7))
    assert "GCS Failsafe" in said
    assert mode(rover) == ROVER_HOLD
    assert "GCS Failsafe Cleared" in texts(beat(rover, 2))
    assert mode(rover) == ROVER_HOLD


def test_a_rover_in_hold_is_left_alone_unless_fs_options_says_otherwise(desk, texts):
    for options, is_told in ((0, False), (1, True)):
        rover = desk("rover")
        put(rover, FS_GCS_ENABLE=1, FS_OPTIONS=options)
        rover.fly()
        beat(rover, 1)
        rover.command(SET_MODE, 1, ROVER_HOLD)
        assert ("GCS Failsafe" in texts(rover.run(8))) is is_told


# Sticks


def test_losing_the_sticks_is_a_radio_failsafe_where_it_is_wanted(quad, texts):
    put(quad, FS_THR_ENABLE=1)
    quad.fly(5)
    assert quad.command(SET_MODE, 1, LOITER) == ACCEPTED
    for _ in range(10):
        quad.send(sticks(quad))
        quad.run(0.2)
    assert mode(quad) == LOITER
    assert "Radio Failsafe" in texts(quad.run(4))
    assert mode(quad) == RTL
    quad.send(sticks(quad))
    assert "Radio Failsafe Cleared" in texts(quad.run(0.3))
    assert mode(quad) == RTL


def test_sticks_that_were_never_heard_or_not_wanted_are_not_lost(desk, texts):
    quad = desk("quadcopter")
    put(quad, FS_THR_ENABLE=1)
    quad.fly(3)
    assert "Radio Failsafe" not in texts(quad.run(10))
    quad = desk("quadcopter")
    quad.fly(3)
    quad.send(sticks(quad))
    assert "Radio Failsafe" not in texts(quad.run(10))
    assert mode(quad) == GUIDED


# The battery


def test_a_low_battery_returns_and_a_critical_one_lands(quad, texts):
    put(quad, BATT_LOW_MAH=1500, BATT_CRT_MAH=500, BATT_FS_LOW_ACT=2, BATT_FS_CRT_ACT=1)
    quad.fly(12)
    put(quad, HERD_BATT_CHARGE=0.4)
    said = texts(quad.run(0.5))
    low = next(text for text in said if text.startswith("Battery 1 is low "))
    volts, used = low.removeprefix("Battery 1 is low ").split("V used ")
    assert 9 < float(volts) < 12
    assert used.endswith(" mAh")
    assert abs(float(used.removesuffix(" mAh")) - 0.6 * 3300) < 20
    assert "Battery Failsafe" in said
    assert mode(quad) == RTL
    quad.run(2)
    put(quad, HERD_BATT_CHARGE=0.1)
    said = texts(quad.run(0.5))
    assert any(text.startswith("Battery 1 is critical ") for text in said)
    assert mode(quad) == LAND


def test_without_an_action_a_low_battery_is_told_once_and_nothing_happens(quad, texts):
    put(quad, BATT_LOW_MAH=1500)
    quad.fly(3)
    put(quad, HERD_BATT_CHARGE=0.4)
    said = texts(quad.run(30))
    assert sum(text.startswith("Battery 1 is low ") for text in said) == 1
    assert mode(quad) == GUIDED


def test_a_landing_for_the_battery_is_not_undone_by_another_loss(quad, texts):
    put(quad, BATT_LOW_MAH=1500, BATT_FS_LOW_ACT=1, FS_GCS_ENABLE=1, FS_OPTIONS=0)
    quad.fly(15)
    beat(quad, 1)
    put(quad, HERD_BATT_CHARGE=0.3)
    said = texts(quad.run(7))
    assert "GCS Failsafe - Continuing Landing" in said
    assert mode(quad) == LAND


def test_a_rover_holds_on_a_low_battery(rover, texts):
    put(rover, BATT_LOW_MAH=1500, BATT_FS_LOW_ACT=2)
    rover.fly()
    put(rover, HERD_BATT_CHARGE=0.3)
    said = texts(rover.run(0.5))
    assert any(text.startswith("Battery 1 is low ") for text in said)
    assert mode(rover) == ROVER_HOLD


# PX4


def offboard(desk, height=5.0, **config):
    """Fly a PX4 in OFFBOARD."""
    quad = desk("quadcopter", autopilot="px4", **config)
    climb = quad.target(0xDF8, z=-height)
    for _ in range(15):
        quad.send(climb)
        quad.run(0.1)
    assert quad.command(SET_MODE, 1, 6) == ACCEPTED
    assert quad.command(ARM, 1) == ACCEPTED
    for _ in range(60):
        quad.send(climb)
        quad.run(0.1)
    assert quad.autopilot.in_air
    return quad


def test_px4_returns_when_the_setpoints_stop(desk, texts):
    quad = offboard(desk)
    quad.run(0.8)
    assert mode(quad) == PX4_OFFBOARD
    said = quad.run(1)
    assert "Failsafe activated" in texts(said)
    assert [m.severity for m in said if m.get_type() == "STATUSTEXT" and "Failsafe" in m.text] == [
        mav.MAV_SEVERITY_CRITICAL
    ]
    assert mode(quad) == PX4_RTL


@pytest.mark.parametrize(("action", "leads_to"), [(4, 0x6040000), (5, PX4_HOLD)])
def test_com_obl_rc_act_says_what_px4_does_then(desk, action, leads_to):
    quad = offboard(desk)
    put(quad, COM_OBL_RC_ACT=action, COM_OF_LOSS_T=2)
    quad.run(1.8)
    assert mode(quad) == PX4_OFFBOARD
    quad.run(1)
    assert mode(quad) == leads_to


def test_px4_only_talks_about_a_lost_station_by_default(desk, texts):
    quad = desk("quadcopter", autopilot="px4")
    beat(quad, 1)
    assert "Connection to ground station lost" not in texts(quad.run(8.5))
    assert "Connection to ground station lost" in texts(quad.run(2))
    assert "GCS connection regained" in texts(beat(quad, 1))
    assert not quad.autopilot.failsafes.active


def test_px4_holds_for_five_seconds_before_it_returns_for_a_lost_station(desk, texts):
    quad = offboard(desk)
    put(quad, NAV_DLL_ACT=2, COM_OBL_RC_ACT=5)
    beat(quad, 1)
    assert mode(quad) == PX4_HOLD  # the setpoints have stopped
    said = texts(quad.run(10.5))
    assert "Connection to ground station lost" in said
    assert "Failsafe activated: entering Hold for 5 seconds" in said
    assert mode(quad) == PX4_HOLD
    quad.run(5)
    assert mode(quad) == PX4_RTL


def test_px4_stays_when_the_station_is_back_in_time(desk):
    quad = offboard(desk)
    put(quad, NAV_DLL_ACT=2, COM_OBL_RC_ACT=5)
    beat(quad, 1)
    quad.run(11)
    beat(quad, 8)
    assert mode(quad) == PX4_HOLD


def test_any_station_will_do_for_px4(desk, texts):
    quad = desk("quadcopter", autopilot="px4")
    beat(quad, 1)
    said = texts(beat(quad, 14, Codec(42, 190)))
    assert "Connection to ground station lost" not in said


def test_px4_warns_of_its_battery_in_its_own_words(desk, texts):
    quad = offboard(desk)
    charge = quad.autopilot.settings.battery
    charge.charge = 0.12
    said = texts(quad.run(0.5))
    assert "Low battery level, return advised" in said
    charge.charge = 0.05
    assert "Critical battery level, land now" in texts(quad.run(0.5))
