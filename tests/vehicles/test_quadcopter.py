"""The quadcopter moves as eq. 7-14 say, and as any free rigid body with spinning rotors must."""

from math import cos, exp, hypot, isclose, log2, pi, sin, sqrt

import pytest

from mavherd.vehicles.physics import GRAVITY
from mavherd.vehicles.quadcopter import (
    QuadcopterParams,
    QuadcopterPhysics,
    QuadcopterState,
    thrust,
)

P = QuadcopterParams()
AIRLESS = QuadcopterParams(  # rotors that spin without thrust or drag; three unequal inertias
    inertia_x=4e-3, inertia_y=6e-3, rotor_inertia=1e-4, thrust_coefficient=1e-15,
    max_rotor_speed=1e9,
)  # fmt: skip
OFF = (0.0, 0.0, 0.0, 0.0)
HOVER = sqrt(P.weight / 4 / P.thrust_coefficient)


def fly(state, commands, seconds, p=P, dt=0.002, force=None):
    physics = QuadcopterPhysics(p, dt)
    for _ in range(round(seconds / dt)):
        state = physics.step(state, commands, force)
    return QuadcopterState(*state)


def to_ned(s, vector):
    """Return a body vector in NED, by the rotation matrix."""
    w, x, y, z = s.qw, s.qx, s.qy, s.qz
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return [sum(a * b for a, b in zip(row, vector, strict=True)) for row in rows]


def angular_momentum(s, p):
    spin = p.rotor_inertia * (s.w1 - s.w2 + s.w3 - s.w4)
    body = (
        p.inertia_x * s.roll_rate,
        p.inertia_y * s.pitch_rate,
        p.inertia_z * s.yaw_rate + spin,
    )
    return to_ned(s, body)


def rotation_energy(s, p):
    return (
        p.inertia_x * s.roll_rate**2 + p.inertia_y * s.pitch_rate**2 + p.inertia_z * s.yaw_rate**2
    ) / 2


def test_free_fall_is_g():
    start = QuadcopterState(v_north=3.0, v_down=-2.0, qw=cos(0.4), qx=sin(0.4), roll_rate=2.0)
    end = fly(start, OFF, 2.0)
    assert isclose(end.v_down, -2.0 + 2 * GRAVITY)
    assert isclose(end.down, -2.0 * 2 + GRAVITY * 2**2 / 2)
    assert isclose(end.north, 3.0 * 2)
    assert end.v_north == 3.0


def test_hover_speed_carries_the_weight():
    speeds = (HOVER, HOVER, HOVER, HOVER)
    end = fly(QuadcopterState(0, 0, -5, *[0.0] * 3, 1.0, *[0.0] * 6, *speeds), speeds, 2.0)
    assert isclose(thrust(end, P), P.weight)
    assert abs(end.down + 5) < 1e-9
    assert isclose(4 * P.max_rotor_thrust / P.weight, 2.04, abs_tol=0.01)


@pytest.mark.parametrize("rotors", [OFF, (600.0, 0.0, 600.0, 0.0)])
def test_torque_free_spin_keeps_energy_and_angular_momentum(rotors):
    start = QuadcopterState(*[0.0] * 6, 1.0, *[0.0] * 3, 4.0, 0.5, -3.0, *rotors)
    end = fly(start, rotors, 5.0, AIRLESS)
    assert abs(end.pitch_rate - start.pitch_rate) > 0.1  # it does tumble
    assert isclose(rotation_energy(end, AIRLESS), rotation_energy(start, AIRLESS), rel_tol=1e-6)
    before, after = angular_momentum(start, AIRLESS), angular_momentum(end, AIRLESS)
    assert after == pytest.approx(before, rel=1e-5, abs=1e-7)


def test_spinning_rotors_up_turns_the_body_the_other_way_and_keeps_momentum():
    end = fly(QuadcopterState(roll_rate=1.0), (500.0, 0.0, 500.0, 0.0), 1.0, AIRLESS)
    assert end.yaw_rate < -1.0  # rotors 1 and 3 spin clockwise from above, the body does not
    start = angular_momentum(QuadcopterState(roll_rate=1.0), AIRLESS)
    assert angular_momentum(end, AIRLESS) == pytest.approx(start, rel=1e-5, abs=1e-7)


def test_balanced_rotors_have_no_gyroscopic_torque():
    start = QuadcopterState(roll_rate=2.0, pitch_rate=1.0)
    spinning = (500.0, 500.0, 500.0, 500.0)
    still = fly(start, OFF, 1.0, AIRLESS)
    end = fly(start._replace(w1=500.0, w2=500.0, w3=500.0, w4=500.0), spinning, 1.0, AIRLESS)
    assert end[6:13] == pytest.approx(still[6:13], abs=1e-9)


@pytest.mark.parametrize(
    ("faster", "axis", "sign"),
    [
        ((1,), "pitch_rate", +1),
        ((3,), "pitch_rate", -1),
        ((4,), "roll_rate", +1),
        ((2,), "roll_rate", -1),
        ((2, 4), "yaw_rate", +1),
        ((1, 3), "yaw_rate", -1),
    ],
)
def test_each_rotor_turns_the_body_as_a_plus_frame(faster, axis, sign):
    commands = tuple(HOVER + (20 if i in faster else 0) for i in range(1, 5))
    hovering = QuadcopterState()._replace(w1=HOVER, w2=HOVER, w3=HOVER, w4=HOVER)
    assert getattr(fly(hovering, commands, 0.1), axis) * sign > 0.05


def test_motors_follow_their_command_with_the_given_lag():
    p = QuadcopterParams(motor_lag=0.05)
    commands = (800.0, 100.0, 0.0, 400.0)
    for end in (
        fly(QuadcopterState(w3=300.0), commands, 0.05, p)[13:],
        fly(QuadcopterState(w3=300.0), commands, 0.05, p, dt=0.01)[13:],
    ):
        left = exp(-1)
        assert end == pytest.approx(
            (800 * (1 - left), 100 * (1 - left), 300 * left, 400 * (1 - left))
        )


def test_rotors_alone_spin_as_in_flight():
    start, commands = QuadcopterState(w1=100.0), (400.0, 300.0, 200.0, 100.0)
    physics = QuadcopterPhysics(P, 0.002)
    assert physics.spin(start, commands) == physics.step(start, commands, None)[13:]


def loop(seconds, dt):
    """Fly a rolling, pitching, yawing manoeuvre: nothing in it is zero or symmetric."""
    start = QuadcopterState(
        0, 0, -9, 1.0, -0.5, 0.2, 1.0, 0, 0, 0, 3.0, -2.0, 1.0, 500.0, 600.0, 550.0, 580.0
    )
    return fly(start, (590.0, 570.0, 560.0, 600.0), seconds, dt=dt)


def distance(a, b):
    return hypot(*(x - y for x, y in zip(a[:13], b[:13], strict=True)))


def test_halving_the_step_shrinks_the_error_sixteenfold():
    exact = loop(0.64, 0.0005)
    coarse, fine = (distance(loop(0.64, dt), exact) for dt in (0.02, 0.01))
    assert 3.6 < log2(coarse / fine) < 4.6


def test_the_step_in_use_agrees_with_2_khz():
    assert distance(loop(1.0, 0.002), loop(1.0, 0.0005)) < 1e-6


def test_attitude_stays_a_unit_quaternion():
    s = loop(20.0, 0.01)
    assert isclose(s.qw**2 + s.qx**2 + s.qy**2 + s.qz**2, 1.0, abs_tol=1e-12)


def test_mirrored_commands_fly_the_mirrored_path():
    start = QuadcopterState(roll_rate=0.7, pitch_rate=0.3, yaw_rate=-0.4, w1=HOVER, w3=HOVER)
    start = start._replace(w2=HOVER, w4=HOVER)
    mirrored = start._replace(roll_rate=-0.7, yaw_rate=0.4)
    # the mirror image of a clockwise rotor turns counter-clockwise: without rotor torques only
    p = QuadcopterParams(torque_per_thrust=1e-12, rotor_inertia=0.0)
    a = fly(start, (590.0, 560.0, 585.0, 600.0), 0.8, p)
    b = fly(mirrored, (590.0, 600.0, 585.0, 560.0), 0.8, p)
    even = ("north", "down", "v_north", "v_down", "qw", "qy", "pitch_rate")
    odd = ("east", "v_east", "qx", "qz", "roll_rate", "yaw_rate")
    assert all(isclose(getattr(a, n), getattr(b, n), abs_tol=1e-9) for n in even)
    assert all(isclose(getattr(a, n), -getattr(b, n), abs_tol=1e-9) for n in odd)


def test_the_path_does_not_depend_on_the_heading():
    commands = (590.0, 560.0, 585.0, 600.0)
    north = fly(QuadcopterState(), commands, 1.0)
    yaw = 2.0
    turned = fly(QuadcopterState(qw=cos(yaw / 2), qz=sin(yaw / 2)), commands, 1.0)
    assert isclose(turned.north, north.north * cos(yaw) - north.east * sin(yaw), abs_tol=1e-9)
    assert isclose(turned.east, north.north * sin(yaw) + north.east * cos(yaw), abs_tol=1e-9)
    assert isclose(turned.down, north.down)
    assert turned[10:13] == pytest.approx(north[10:13], abs=1e-9)


def test_a_body_force_pushes_along_the_body_axes():
    for axis in range(3):
        force = tuple(0.6 if i == axis else 0.0 for i in range(3))
        start = QuadcopterState(qw=cos(0.5), qx=0.2, qy=sin(0.5), qz=-0.3)
        norm = sqrt(sum(q * q for q in start[6:10]))
        start = start._replace(**{n: getattr(start, n) / norm for n in ("qw", "qx", "qy", "qz")})
        end = fly(start, OFF, 1.0, force=force)
        push = [f / P.mass for f in to_ned(start, force)]
        assert end[3:6] == pytest.approx((push[0], push[1], push[2] + GRAVITY), abs=1e-9)


@pytest.mark.parametrize(
    ("name", "value"),
    [("mass", 0.0), ("mass", -1.0), ("inertia_z", float("nan")), ("motor_lag", float("inf"))],
)
def test_impossible_constants_are_refused_by_name(name, value):
    with pytest.raises(ValueError, match=name):
        QuadcopterParams(**{name: value})


def test_a_quadcopter_that_cannot_lift_itself_is_refused_with_the_cure():
    with pytest.raises(ValueError, match="lower mass or raise max_rotor_speed"):
        QuadcopterParams(mass=3.0)


def test_a_full_turn_of_roll_comes_back():
    end = fly(QuadcopterState(roll_rate=2 * pi), OFF, 1.0)
    assert abs(end.qw) > 1 - 1e-6
