"""Health, battery, radio and fence are told as they are, and clients find what they wait for."""

import pytest

from mavherd.transport.mavlink import mav

PREARM = mav.MAV_SYS_STATUS_PREARM_CHECK
BATTERY = mav.MAV_SYS_STATUS_SENSOR_BATTERY
FENCE = mav.MAV_SYS_STATUS_GEOFENCE
RADIO = mav.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
HEIGHT = mav.MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL
PLACE = mav.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL
RATES = mav.MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL


def present(m):
    return m.onboard_control_sensors_present


def enabled(m):
    return m.onboard_control_sensors_enabled


def healthy(m):
    return m.onboard_control_sensors_health


def test_health_is_what_mavsdk_waits_for(quad, ask):
    m = ask(quad, "SYS_STATUS")
    for bit in (1, 2, 4, 0x20):  # gyro, accelerometer, magnetometer, GPS
        assert present(m) & healthy(m) & bit
    assert enabled(m) & ~healthy(m) == 0  # or QGroundControl calls it unhealthy


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
@pytest.mark.parametrize("stack", ["ardupilot", "px4", "generic"])
def test_nothing_is_enabled_or_healthy_that_is_not_there(desk, ask, stack, kind):
    m = ask(desk(kind, autopilot=stack), "SYS_STATUS")
    assert (enabled(m) | healthy(m)) & ~present(m) == 0


def test_the_prearm_bit_falls_while_something_hinders_arming(quad, ask):
    assert enabled(ask(quad, "SYS_STATUS")) & healthy(ask(quad, "SYS_STATUS")) & PREARM
    quad.vehicle.settings.fence.enabled = True
    quad.vehicle.settings.fence.radius = 1.0  # less than its margin
    assert not healthy(ask(quad, "SYS_STATUS")) & PREARM
    assert enabled(ask(quad, "SYS_STATUS")) & PREARM
    quad.vehicle.settings.fence.enabled = False
    assert healthy(ask(quad, "SYS_STATUS")) & PREARM


def test_the_prearm_bit_is_up_in_modes_that_cannot_be_armed_in(quad, ask):
    """As on ArduPilot: who waits for it after landing by RTL must not wait for ever."""
    assert quad.command(mav.MAV_CMD_DO_SET_MODE, 1, 6) == 0
    assert healthy(ask(quad, "SYS_STATUS")) & PREARM


def test_the_prearm_bit_is_up_in_flight(quad, ask):
    quad.fly()
    quad.vehicle.settings.fence.enabled = True
    quad.vehicle.settings.fence.radius = 1.0
    assert healthy(ask(quad, "SYS_STATUS")) & PREARM


@pytest.mark.parametrize(
    ("mode", "used", "unused"),
    [(0, RATES, HEIGHT | PLACE), (2, RATES | HEIGHT, PLACE), (4, RATES | HEIGHT | PLACE, 0)],
)
def test_the_controllers_that_a_mode_uses_are_enabled(quad, ask, mode, used, unused):
    assert quad.command(mav.MAV_CMD_DO_SET_MODE, 1, mode) == 0
    m = ask(quad, "SYS_STATUS")
    assert present(m) & (used | unused) == used | unused
    assert enabled(m) & used == used
    assert not enabled(m) & unused


def test_a_rover_has_no_height_to_control(rover, ask):
    assert not present(ask(rover, "SYS_STATUS")) & HEIGHT


def test_the_fence_bit_follows_the_fence(quad, ask):
    assert not enabled(ask(quad, "SYS_STATUS")) & FENCE
    quad.vehicle.settings.fence.enabled = True
    m = ask(quad, "SYS_STATUS")
    assert present(m) & enabled(m) & healthy(m) & FENCE
    quad.fly(5.0)
    quad.vehicle.settings.fence.height = 2.0
    quad.run(0.3)
    m, status = ask(quad, "SYS_STATUS"), ask(quad, "FENCE_STATUS")
    assert not healthy(m) & FENCE
    assert (status.breach_status, status.breach_count) == (1, 1)
    assert status.breach_type == mav.FENCE_BREACH_MAXALT
    assert 0 <= quad.now - status.breach_time / 1000 < 0.4


def test_the_battery_is_told_in_both_messages(quad, ask):
    quad.fly()
    brief, full, battery = (
        ask(quad, "SYS_STATUS"),
        ask(quad, "BATTERY_STATUS"),
        quad.autopilot.battery,
    )
    assert brief.voltage_battery == full.voltages[0] == pytest.approx(battery.voltage * 1e3, abs=1)
    assert full.voltages[1:] == [65535] * 9
    assert (
        brief.current_battery == full.current_battery == pytest.approx(battery.current * 100, abs=1)
    )
    assert full.current_battery > 500  # a hovering copter draws more than 5 A
    assert full.current_consumed == pytest.approx(battery.consumed_mah, abs=1)
    assert brief.battery_remaining == full.battery_remaining
    assert 50 < full.battery_remaining <= 100
    assert full.temperature == 32767
    assert full.charge_state == mav.MAV_BATTERY_CHARGE_STATE_OK
    assert present(brief) & enabled(brief) & healthy(brief) & BATTERY


def test_without_a_battery_monitor_nothing_is_said_of_it(quad, ask):
    quad.vehicle.settings.battery.monitor = 0
    m = ask(quad, "SYS_STATUS")
    assert (m.voltage_battery, m.current_battery, m.battery_remaining) == (65535, -1, -1)
    assert not present(m) & BATTERY
    asked = quad.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_BATTERY_STATUS)
    assert asked == mav.MAV_RESULT_FAILED


def test_the_radio_shows_the_sticks(quad, ask):
    rest = ask(quad, "RC_CHANNELS")
    assert (rest.chan1_raw, rest.chan3_raw, rest.rssi) == (1500, 1000, 255)
    assert healthy(ask(quad, "SYS_STATUS")) & RADIO
    quad.send(mav.MAVLink_manual_control_message(1, 500, -500, 750, 0, 0))
    quad.run(0.05)
    m, first = ask(quad, "RC_CHANNELS"), ask(quad, "RC_CHANNELS_RAW")
    assert (m.chan1_raw, m.chan2_raw, m.chan3_raw, m.chan4_raw) == (1250, 1250, 1750, 1500)
    assert [getattr(first, f"chan{i}_raw") for i in range(1, 9)] == [
        getattr(m, f"chan{i}_raw") for i in range(1, 9)
    ]
    quad.run(5)
    assert not healthy(ask(quad, "SYS_STATUS")) & RADIO  # the pilot has gone


def test_landed_states_follow_a_flight(quad, ask):
    def state():
        return ask(quad, "EXTENDED_SYS_STATE").landed_state

    assert state() == mav.MAV_LANDED_STATE_ON_GROUND
    quad.fly()
    assert state() == mav.MAV_LANDED_STATE_IN_AIR
    quad.command(mav.MAV_CMD_NAV_LAND)
    quad.run(0.5)
    assert state() == mav.MAV_LANDED_STATE_LANDING


def test_the_current_mission_item_is_told(quad, ask):
    m = ask(quad, "MISSION_CURRENT")
    assert (m.seq, m.total) == (0, 65535)
    assert m.mission_state == mav.MISSION_STATE_NO_MISSION


def test_what_dronekit_calls_armable(quad, ask):
    flags = ask(quad, "EKF_STATUS_REPORT").flags
    assert flags & mav.EKF_PRED_POS_HORIZ_ABS
    assert flags & mav.EKF_POS_HORIZ_ABS
    assert not flags & mav.EKF_CONST_POS_MODE
    assert ask(quad, "ESTIMATOR_STATUS").flags == flags
    assert ask(quad, "GPS_RAW_INT").fix_type > 1
