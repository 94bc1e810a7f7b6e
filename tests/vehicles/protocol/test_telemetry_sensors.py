"""Sensors feel what the physics does to them."""

from math import atan2, cos, degrees, hypot, pi, sin, sqrt

import pytest

from mavherd.transport.mavlink import mav
from mavherd.vehicles.config import Disturbance
from mavherd.vehicles.earth import magnetic_field
from mavherd.vehicles.physics import GRAVITY
from mavherd.vehicles.protocol.telemetry.view import to_body
from mavherd.vehicles.quadcopter import QuadcopterParams
from mavherd.vehicles.robot import Kinematics


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_a_vehicle_that_stands_feels_the_ground_push_it_up(desk, ask, kind, yaw):
    vehicle = desk(kind, yaw=yaw)
    vehicle.run(0.1)
    m = ask(vehicle, "RAW_IMU")
    assert (m.xacc, m.yacc, m.zacc) == (0, 0, -1000)
    assert (m.xgyro, m.ygyro, m.zgyro) == (0, 0, 0)


def test_a_hovering_copter_feels_its_rotors_carry_it(quad, ask):
    quad.fly()
    quad.run(3)
    m = ask(quad, "HIGHRES_IMU")
    assert (m.xacc, m.yacc) == (0.0, 0.0)
    assert m.zacc == pytest.approx(-GRAVITY, abs=0.05)


def test_what_the_imu_feels_explains_the_motion(desk):
    """The velocity's rate, less gravity, turned into body axes, is the specific force."""
    vehicle = desk(disturbance=Disturbance(form="constant", amplitude=0.4), seed=3)
    vehicle.fly()
    vehicle.send(vehicle.target(0xDF8, x=10.0, y=5.0, z=-4.0))
    robot = vehicle.vehicle.robot
    for _ in range(60):
        vehicle.run(0.01)
        before, felt = robot.kinematics(), robot.specific_force()
        robot.advance()
        after, felt_after = robot.kinematics(), robot.specific_force()
        rate = [(b - a) / robot.dt for a, b in zip(before[3:6], after[3:6], strict=True)]
        expected = to_body(before, rate[0], rate[1], rate[2] - GRAVITY)
        between = [(a + b) / 2 for a, b in zip(felt, felt_after, strict=True)]
        assert between == pytest.approx(expected, abs=0.03)
    assert hypot(felt[0], felt[1]) > 0.01  # the disturbance is felt


def test_a_rover_feels_its_acceleration_and_its_turn(rover):
    rover.fly()
    robot = rover.vehicle.robot
    rover.send(rover.target(0x5C7, frame=8, vx=0.8, yaw_rate=0.7))
    for _ in range(60):
        rover.run(0.01)
        before, felt = robot.state, robot.specific_force()
        robot.advance()
        along = (robot.state.speed - before.speed) / robot.dt
        assert felt[0] == pytest.approx(along, abs=0.05)
        assert felt[1] == pytest.approx(before.speed * before.yaw_rate)
        assert felt[2] == -GRAVITY
    assert felt[1] > 0.1  # it turns right: pushed to the right


def test_the_compass_points_where_the_field_does(desk, ask):
    field = magnetic_field(47.3977, 8.5456)
    north = degrees(atan2(field.east, field.north))
    for yaw in (0.0, 1.0, -2.5):
        m = ask(desk("rover", yaw=yaw), "RAW_IMU")
        shown = degrees(atan2(-m.ymag, m.xmag)) + north
        assert (shown - degrees(yaw) + 180) % 360 - 180 == pytest.approx(0, abs=0.5)
        assert m.zmag == pytest.approx(field.down * 1000, abs=1)


def test_all_imus_agree_in_their_own_units(moving, ask):
    vehicle = moving()
    raw, first, second, fine = (
        ask(vehicle, name) for name in ("RAW_IMU", "SCALED_IMU", "SCALED_IMU2", "HIGHRES_IMU")
    )
    for name in ("xacc", "yacc", "zacc"):
        milli_g = getattr(fine, name) / GRAVITY * 1000
        assert getattr(raw, name) == getattr(first, name) == getattr(second, name)
        assert getattr(raw, name) == pytest.approx(milli_g, abs=0.6)
    for name in ("xgyro", "ygyro", "zgyro", "xmag", "ymag", "zmag"):
        assert getattr(raw, name) == getattr(first, name) == getattr(second, name)
        assert getattr(raw, name) == pytest.approx(getattr(fine, name) * 1000, abs=0.6)
    k = vehicle.where
    assert (fine.xgyro, fine.ygyro, fine.zgyro) == pytest.approx(k[10:13], abs=1e-6)


def test_the_barometer_tells_the_height(quad, ask):
    ground = ask(quad, "SCALED_PRESSURE").press_abs
    quad.fly(10.0)
    m = ask(quad, "SCALED_PRESSURE")
    assert ground - m.press_abs == pytest.approx(1.15, abs=0.05)  # hPa over 10 m
    fine = ask(quad, "HIGHRES_IMU")
    assert fine.abs_pressure == m.press_abs
    assert fine.pressure_alt == pytest.approx(488.0 - quad.where.down, abs=0.01)
    assert m.temperature == pytest.approx(fine.temperature * 100, abs=1)


def test_the_simulators_truth_is_the_truth(moving, ask):
    vehicle = moving()
    truth, shown = ask(vehicle, "SIMSTATE"), ask(vehicle, "ATTITUDE")
    assert (truth.roll, truth.pitch, truth.yaw) == (shown.roll, shown.pitch, shown.yaw)
    world, hil = ask(vehicle, "GLOBAL_POSITION_INT"), ask(vehicle, "HIL_STATE_QUATERNION")
    second = ask(vehicle, "AHRS2")
    for m in (truth, second):
        assert (m.lat, m.lng) == (world.lat, world.lon)
    assert (hil.lat, hil.lon, hil.alt) == (world.lat, world.lon, world.alt)
    assert (hil.vx, hil.vy, hil.vz) == (world.vx, world.vy, world.vz)
    assert hil.attitude_quaternion == pytest.approx(vehicle.where[6:10], abs=1e-6)
    assert hil.true_airspeed == pytest.approx(
        sqrt(world.vx**2 + world.vy**2 + world.vz**2), abs=1.5
    )


def test_to_body_is_the_inverse_of_the_attitude():
    half = pi / 8
    k = Kinematics(0, 0, 0, 0, 0, 0, cos(half), 0.0, 0.0, sin(half), 0, 0, 0)  # 45 degrees right
    assert to_body(k, 1.0, 1.0, 2.0) == pytest.approx((sqrt(2), 0.0, 2.0))


# Motors


def outputs(m):
    return [getattr(m, f"servo{i}_raw") for i in range(1, 9)]


def test_rotors_at_rest_get_1000_us_and_wheels_1500(quad, rover, ask):
    quad.run(0.1)
    rover.run(0.1)
    assert outputs(ask(quad, "SERVO_OUTPUT_RAW")) == [1000] * 4 + [0] * 4
    assert outputs(ask(rover, "SERVO_OUTPUT_RAW")) == [1500, 0, 1500, 0, 0, 0, 0, 0]


def test_hover_is_half_the_thrust(quad, ask):
    quad.fly()
    quad.run(3)
    p = QuadcopterParams()
    share = sqrt(p.weight / 4 / p.max_rotor_thrust)  # of full speed
    for pulse in outputs(ask(quad, "SERVO_OUTPUT_RAW"))[:4]:
        assert pulse == pytest.approx(1000 + 1000 * share, abs=15)
    thrust = ask(quad, "ACTUATOR_CONTROL_TARGET").controls[3]
    assert thrust == pytest.approx(share * share, abs=0.02)
    rpm = ask(quad, "ESC_TELEMETRY_1_TO_4").rpm
    assert rpm == pytest.approx([share * p.max_rotor_speed * 60 / (2 * pi)] * 4, rel=0.02)


def test_motors_are_numbered_as_arducopters_plus_frame(quad, ask):
    """1 right, 2 left, 3 front, 4 rear: forward raises 4 over 3, to the right 2 over 1."""
    quad.fly()
    quad.run(2)
    for target, low, high in (({"vx": 1.5}, 3, 4), ({"vy": 1.5}, 1, 2)):
        quad.send(quad.target(0xDC7, **target))
        quad.run(0.04)
        pulses = outputs(ask(quad, "SERVO_OUTPUT_RAW"))
        assert pulses[high - 1] > pulses[low - 1] + 5
        quad.send(quad.target(0xDC7))
        quad.run(4)


def test_the_right_wheel_slows_in_a_right_turn(rover, ask):
    rover.fly()
    rover.send(rover.target(0x5C7, frame=8, vx=0.5, yaw_rate=0.5))
    rover.run(1)
    left, _, right, *_ = outputs(ask(rover, "SERVO_OUTPUT_RAW"))
    assert left > right > 1500
    _, _, yaw, forward, *_ = ask(rover, "ACTUATOR_CONTROL_TARGET").controls
    assert yaw == pytest.approx((left - right) / 1000, abs=0.002)
    assert forward == pytest.approx((left + right - 3000) / 1000, abs=0.002)
    status = ask(rover, "ACTUATOR_OUTPUT_STATUS")
    assert status.active == 0b101
    assert status.actuator[:4] == [left, 0, right, 0]


def test_speed_controllers_share_the_batterys_current(quad, ask):
    quad.fly()
    m, battery = ask(quad, "ESC_TELEMETRY_1_TO_4"), ask(quad, "BATTERY_STATUS")
    assert sum(m.current) == pytest.approx(battery.current_battery, abs=4)
    assert m.voltage == pytest.approx([battery.voltages[0] / 10] * 4, abs=1)
    common = quad.vehicle.telemetry.make(291)
    assert common.rpm == pytest.approx(m.rpm, abs=1)
    assert sum(common.current) == pytest.approx(quad.autopilot.battery.current)


def test_wheels_turn_as_fast_as_they_roll(rover, ask):
    rover.fly()
    rover.send(rover.target(0x5C7, frame=8, vx=-0.5))
    rover.run(2)
    speed = abs(rover.vehicle.robot.state.speed)
    rpm = ask(rover, "ESC_TELEMETRY_1_TO_4").rpm
    assert rpm[0] == pytest.approx(speed / 0.0975 * 60 / (2 * pi), abs=1)
    assert rpm[1] == rpm[3] == 0
    assert rover.vehicle.telemetry.make(291).rpm[0] < 0  # ESC_STATUS knows backwards


def test_the_air_is_still(quad, ask):
    assert ask(quad, "WIND").speed == 0
    assert ask(quad, "VIBRATION").vibration_x == 0
    assert mav.MAVLINK_MSG_ID_DISTANCE_SENSOR not in quad.vehicle.telemetry.ids  # it has none
