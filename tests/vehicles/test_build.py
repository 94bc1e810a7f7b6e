"""A configuration becomes a robot; every parameter has a name, a default and honest bounds."""

import json

import pytest

from mavherd.vehicles.build import PHYSICS_DT, make_robot, parameter_names
from mavherd.vehicles.config import Disturbance, VehicleConfig
from mavherd.vehicles.robot import Setpoint, Vec3

KINDS = ("quadcopter", "rover")


def config(kind, **params):
    return VehicleConfig(kind=kind, system_id=3, params=params)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("profile", ["default", "paper"])
def test_every_parameter_can_be_set_to_its_own_default(kind, profile):
    defaults = parameter_names(kind, profile)
    robot = make_robot(VehicleConfig(kind=kind, system_id=1, profile=profile, params=defaults))
    plain = make_robot(VehicleConfig(kind=kind, system_id=1, profile=profile))
    for r in (robot, plain):
        r.motors_on = True
        for _ in range(200):
            r.control(Setpoint(position=Vec3(1.0, 0.5, -2.0), yaw=0.2))
            r.advance()
    assert robot.kinematics() == plain.kinematics()


@pytest.mark.parametrize("kind", KINDS)
def test_every_parameter_is_a_plain_finite_number(kind):
    names = parameter_names(kind)
    assert json.loads(json.dumps(names, allow_nan=False)) == names
    assert all(type(value) is float for value in names.values())


def test_profiles_differ_in_gains_not_in_physics():
    default, paper = parameter_names("quadcopter"), parameter_names("quadcopter", "paper")
    assert default.keys() == paper.keys()
    assert default["mass"] == paper["mass"]
    assert (paper["roll_p"], paper["roll_d"]) == (3.0, 2.0)  # Table 2
    assert parameter_names("rover", "paper")["position_p"] == 15.0


def test_the_paper_profile_controls_at_500_hz_and_the_default_at_250_hz():
    for profile, rate in (("default", 250), ("paper", 500)):
        robot = make_robot(VehicleConfig(kind="quadcopter", system_id=1, profile=profile))
        assert round(1 / (robot.dt * robot.control_every)) == rate


def test_a_parameter_does_what_it_says():
    slow = make_robot(config("quadcopter", v_max=0.5))
    slow.motors_on = True
    fastest = 0.0
    for _ in range(2000):
        slow.control(Setpoint(position=Vec3(9.0, 0.0, -3.0)))
        slow.advance()
        fastest = max(fastest, slow.kinematics().v_north)
    assert 0.45 < fastest < 0.55


def test_an_unknown_name_is_refused_with_a_hint():
    with pytest.raises(
        ValueError, match=r"unknown quadcopter parameter 'mas'.*did you mean 'mass'"
    ):
        make_robot(config("quadcopter", mas=1.0))
    with pytest.raises(ValueError, match="known: mass, inertia"):
        make_robot(config("rover", qqq=1.0))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf"), "2", True, None])
def test_no_parameter_takes_a_value_that_is_no_quantity(kind, value):
    for name in parameter_names(kind):
        with pytest.raises(ValueError, match=name):
            make_robot(config(kind, **{name: value}))


def test_whole_numbers_are_numbers():
    assert make_robot(config("rover", mass=9)).dt == PHYSICS_DT


def test_constants_too_small_for_the_time_step_are_refused():
    for kind, name in (("rover", "mass"), ("quadcopter", "inertia_x"), ("quadcopter", "inertia_y")):
        with pytest.raises(ValueError, match=name):
            make_robot(config(kind, **{name: 1e-7}))


def test_the_disturbance_belongs_to_seed_and_system_id():
    def drift(seed, system_id):
        robot = make_robot(
            VehicleConfig(
                kind="rover", system_id=system_id, seed=seed, disturbance=Disturbance(form="held")
            )
        )
        robot.motors_on = True
        for _ in range(100):
            robot.control(Setpoint())
            robot.advance()
        return robot.kinematics()

    assert drift(1, 1) == drift(1, 1)
    assert len({drift(1, 1), drift(1, 2), drift(2, 1)}) == 3


@pytest.mark.parametrize(
    ("kind", "name", "value"),
    [
        ("rover", "wheel_radius", 1e-200),
        ("rover", "half_track", 1e200),
        ("rover", "position_p", 1e308),
        ("quadcopter", "mass", 1e-6),
        ("quadcopter", "rotor_inertia", 1.0),
        ("quadcopter", "motor_lag", 1e-320),
    ],
)
def test_values_far_from_any_real_vehicle_are_refused(kind, name, value):
    with pytest.raises(ValueError, match=f"{name} = .* is not within"):
        make_robot(VehicleConfig(kind=kind, system_id=1, params={name: value}))
