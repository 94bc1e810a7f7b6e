"""The battery tells a believable story: what is drawn adds up, sags the voltage, and empties it."""

from itertools import pairwise
from math import isclose

import pytest

from mavherd.transport.mavlink import mav
from mavherd.vehicles.flight.battery import FULL_CELL, Level

OK, LOW, CRITICAL = Level.OK, Level.LOW, Level.CRITICAL


def put(desk, **values):
    for name, value in values.items():
        desk.autopilot.parameters.set(name, value)


def test_a_full_battery_at_rest_shows_its_full_voltage_but_for_a_little_sag(quad):
    quad.run(0.2)
    battery = quad.autopilot.battery
    assert battery.cells == 3
    assert 0 < 3 * FULL_CELL - battery.voltage < 0.05
    assert 0 < battery.current < 1
    assert isclose(battery.remaining, 1, abs_tol=1e-3)


def test_hovering_draws_the_power_of_the_rotors_and_sags_the_voltage(quad):
    quad.run(0.2)
    battery, at_rest = quad.autopilot.battery, quad.autopilot.battery.voltage
    quad.fly(3)
    quad.run(5)
    p = quad.vehicle.robot._params
    speed = (p.weight / 4 / p.thrust_coefficient) ** 0.5
    shafts = 4 * p.torque_per_thrust * p.weight / 4 * speed
    assert isclose(quad.vehicle.robot.shaft_power(), shafts, rel_tol=0.02)
    drawn = battery.voltage * battery.current
    assert 1.1 * shafts < drawn < 1.5 * shafts  # motors are no better than 90 %
    assert at_rest - battery.voltage > 0.1


def test_what_is_consumed_is_the_integral_of_the_current(quad):
    quad.fly(3)
    quad.run(5)
    battery = quad.autopilot.battery
    before, current = battery.consumed_mah, battery.current
    quad.run(36)
    assert isclose(battery.consumed_mah - before, current * 36 / 3.6, rel_tol=0.05)
    assert isclose(battery.remaining, 1 - battery.consumed_mah / 3300, rel_tol=1e-9)


def test_a_rover_that_drives_draws_more_than_one_that_stands(rover):
    rover.fly()
    rover.run(1)
    standing = rover.autopilot.battery.current
    for _ in range(20):
        rover.send(rover.target(0xDC7, vx=1.0))
        rover.run(0.2)
    assert rover.autopilot.battery.current > 1.3 * standing > 0


def test_the_voltage_falls_with_the_charge_and_never_rises(quad):
    volts = []
    for percent in range(100, -1, -5):
        put(quad, HERD_BATT_CHARGE=percent / 100)
        quad.run(0.2)
        volts.append(quad.autopilot.battery.voltage)
    assert all(a > b for a, b in pairwise(volts))
    assert volts[-1] > 8  # an empty cell has not 0 V


def test_setting_the_charge_puts_in_such_a_battery_at_once(quad):
    put(quad, HERD_BATT_CHARGE=0.25)
    quad.run(0.2)
    battery = quad.autopilot.battery
    assert isclose(battery.remaining, 0.25, abs_tol=1e-3)
    assert isclose(battery.consumed_mah, 0.75 * 3300, rel_tol=1e-3)


def test_an_empty_battery_stays_at_zero_and_does_not_stop_the_rotors(quad):
    quad.fly(3)
    put(quad, HERD_BATT_CHARGE=0)
    quad.run(10)
    battery = quad.autopilot.battery
    assert battery.remaining == 0
    assert battery.consumed_mah > 3300
    assert quad.autopilot.in_air


@pytest.mark.parametrize("capacity", [0, 5])
def test_an_unknown_capacity_does_not_empty_the_battery_in_seconds(quad, capacity):
    put(quad, BATT_CAPACITY=capacity)
    quad.run(30)
    assert quad.autopilot.battery.remaining > 0.99


def test_two_flights_with_the_same_inputs_use_the_same_charge(desk):
    used = []
    for _ in range(2):
        vehicle = desk("quadcopter")
        vehicle.fly(3)
        used.append(vehicle.autopilot.battery.consumed_mah)
    assert used[0] == used[1] > 0


# Levels


def test_charge_below_the_limits_is_low_then_critical_while_armed(quad):
    put(quad, BATT_LOW_MAH=1000, BATT_CRT_MAH=500)
    quad.fly(3)
    battery = quad.autopilot.battery
    for charge, level in ((0.5, OK), (0.25, LOW), (0.1, CRITICAL)):
        put(quad, HERD_BATT_CHARGE=charge)
        quad.run(0.3)
        assert battery.level is level
        assert battery.charge_state == level
    put(quad, HERD_BATT_CHARGE=1)
    quad.run(0.3)
    assert battery.level is CRITICAL  # in flight it only gets worse
    assert quad.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 0, 21196) == 0
    quad.run(0.3)
    assert battery.level is OK


def test_low_voltage_counts_after_batt_low_timer_and_never_with_a_timer_of_0(quad):
    put(quad, BATT_LOW_VOLT=12.0, BATT_LOW_TIMER=0)
    quad.fly(3)
    battery = quad.autopilot.battery
    put(quad, HERD_BATT_CHARGE=0.3)
    quad.run(15)
    assert battery.voltage < 12
    assert battery.level is OK
    put(quad, BATT_LOW_TIMER=10, HERD_BATT_CHARGE=0.31)  # a fresh battery: the time begins anew
    quad.run(9.5)
    assert battery.level is OK
    quad.run(1)
    assert battery.level is LOW


def test_without_a_monitor_there_is_no_battery_to_judge(quad):
    put(quad, BATT_MONITOR=0, BATT_LOW_MAH=3000, HERD_BATT_CHARGE=0.1)
    quad.fly(3)
    battery = quad.autopilot.battery
    assert not battery.present
    assert battery.level is OK
    assert battery.charge_state == mav.MAV_BATTERY_CHARGE_STATE_UNDEFINED
    assert battery.refusal() is None


# Arming


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"BATT_LOW_VOLT": 13}, "low voltage failsafe"),
        ({"BATT_LOW_MAH": 3400}, "low capacity failsafe"),
        ({"BATT_CRT_VOLT": 13, "BATT_LOW_VOLT": 0}, "critical voltage failsafe"),
        ({"BATT_CRT_MAH": 3400}, "critical capacity failsafe"),
        ({"BATT_ARM_VOLT": 13}, "below minimum arming voltage"),
        ({"BATT_ARM_MAH": 3400}, "below minimum arming capacity"),
        ({"BATT_CRT_MAH": 200, "BATT_LOW_MAH": 100}, "capacity failsafe critical >= low"),
        ({"BATT_CRT_VOLT": 11, "BATT_LOW_VOLT": 10}, "voltage failsafe critical >= low"),
    ],
)
def test_the_reason_that_forbids_arming_is_worded_as_ardupilot_does(quad, texts, values, reason):
    put(quad, **values)
    quad.run(0.3)
    assert quad.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mav.MAV_RESULT_FAILED
    assert f"Arm: Battery 1 {reason}" in texts(quad.run(0.1))
