"""A parameter that is set counts at once, or is refused in one sentence and nothing changes."""

import math
from dataclasses import replace

import pytest

from mavherd.vehicles.build import make_robot, parameter_values
from mavherd.vehicles.config import AUTOPILOTS, KINDS, VehicleConfig
from mavherd.vehicles.flight.settings import Action, Settings
from mavherd.vehicles.parameters.parameter import ParameterRefused
from mavherd.vehicles.parameters.profile import numbers
from mavherd.vehicles.parameters.store import Parameters
from mavherd.vehicles.robot import Setpoint, Vec3


def make(kind="quadcopter", settings=None, **config):
    return Parameters(VehicleConfig(kind=kind, system_id=7, **config), settings)


def flown(kind="quadcopter", **config):
    """Return parameters and the robot that they tune."""
    configuration = VehicleConfig(kind=kind, system_id=7, **config)
    parameters = Parameters(configuration)
    robot = built(configuration, parameters)
    parameters.bind(robot)
    return parameters, robot


def built(configuration, parameters):
    return make_robot(replace(configuration, params=parameters.robot_overrides))


def snapshot(p):
    return {entry.parameter.name: entry.value for entry in p}


def test_iteration_index_and_name_agree():
    p = make()
    assert len(list(p)) == len(p) == len(snapshot(p))
    for place, entry in enumerate(p):
        assert entry.place == place
        assert p.at(place) == p.entry(entry.parameter.name) == entry
        assert p[entry.parameter.name] == entry.value
    with pytest.raises(IndexError):
        p.at(-1)
    with pytest.raises(IndexError):
        p.at(len(p))


def test_the_system_id_is_shown():
    assert make()["SYSID_THISMAV"] == 7
    assert make(autopilot="px4")["MAV_SYS_ID"] == 7


def test_settings_follow_at_once_in_si_units():
    p = make()
    p.set("RTL_ALT", 2500)
    p.set("RTL_LOIT_TIME", 1500)
    p.set("FENCE_ENABLE", 1)
    p.set("FENCE_ACTION", 2)
    p.set("FENCE_RADIUS", 30)
    p.set("PILOT_Y_RATE", 90)
    p.set("BATT_FS_LOW_ACT", 2)
    p.set("SR1_EXTRA1", 4)
    s = p.settings
    assert (s.rtl_height, s.rtl_loiter_time) == (25.0, 1.5)
    assert s.fence.enabled is True
    assert (s.fence.action, s.fence.radius) == (Action.LAND, 30.0)
    assert s.pilot_yaw_rate == pytest.approx(math.pi / 2)
    assert s.battery.low_action is Action.RTL
    assert s.stream_rates[1]["EXTRA1"] == 4
    assert s.stream_rates[0]["EXTRA1"] == 0


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("kind", KINDS)
def test_settings_keep_their_types(kind, autopilot):
    p = make(kind, autopilot=autopilot)
    fresh = Settings()
    for entry in p:
        if entry.parameter.is_setting and not entry.parameter.codes:
            p.set(entry.parameter.name, entry.parameter.high)
            p.set(entry.parameter.name, entry.default)
    for name in ("gcs_system_id", "arming_checks", "failsafe_options", "mission_restart"):
        assert type(getattr(p.settings, name)) is type(getattr(fresh, name)), name
    assert type(p.settings.fence.types) is int
    assert type(p.settings.gcs_failsafe) is bool


def test_what_the_caller_has_configured_is_the_default():
    p = make(settings=Settings(guided_timeout=1.5, gcs_action=Action.LAND))
    assert p.settings.guided_timeout == 1.5
    assert p.entry("GUID_TIMEOUT")[2:] == (1.5, 1.5)
    assert p["FS_GCS_ENABLE"] == 5


def test_personalities_begin_differently():
    assert make().settings.fence.enabled is False
    px4 = make(autopilot="px4").settings
    assert (px4.fence.enabled, px4.fence.radius, px4.fence.action) == (True, 0.0, Action.HOLD)
    assert px4.landed_disarm_delay == 2.0
    rover = make("rover").settings
    assert (rover.gcs_failsafe, rover.gcs_action) == (False, Action.HOLD)


def test_gains_reach_the_robot_at_once():
    p, robot = flown()
    robot.motors_on = True
    p.set("WPNAV_SPEED", 60)
    fastest = 0.0
    for _ in range(2000):
        robot.control(Setpoint(position=Vec3(9.0, 0.0, -3.0)))
        robot.advance()
        robot.advance()
        fastest = max(fastest, robot.kinematics().v_north)
    assert 0.5 < fastest < 0.66  # the usual 1.5 m/s is far


def test_a_gain_set_back_is_exactly_the_usual_one():
    p, _ = flown()
    p.set("ANGLE_MAX", 2000)
    assert p.robot_overrides == {"tilt_limit": pytest.approx(math.radians(20))}
    p.set("ANGLE_MAX", 3000)
    assert p.robot_overrides == {}


def test_constants_count_from_the_next_boot_on():
    p, robot = flown()
    before = robot.kinematics()
    assert p.set("HERD_MASS", 1.5).parameter.reboot
    assert p.robot_overrides == {"mass": 1.5}
    assert robot.kinematics() == before


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("kind", KINDS)
def test_every_gain_can_be_changed_a_little(kind, autopilot):
    p, _ = flown(kind, autopilot=autopilot)
    for name in numbers(kind, "default"):
        (entry,) = (e for e in p if e.parameter.path.partition(".")[2] == name)
        value = entry.value * 1.1 or 1 / entry.parameter.scale  # 1 in SI units
        set_to = p.set(entry.parameter.name, value).value
        assert set_to == pytest.approx(
            value, abs=0.5 if entry.parameter.is_integer else value * 1e-6
        )
        assert p.robot_overrides[name] == pytest.approx(set_to * entry.parameter.scale)
    assert len(p.robot_overrides) == len(numbers(kind, "default"))


def refusal(p, name, value):
    before, ours = snapshot(p), p.robot_overrides
    with pytest.raises(ParameterRefused) as refused:
        p.set(name, value)
    assert snapshot(p) == before
    assert p.robot_overrides == ours
    assert name in str(refused.value)
    return str(refused.value)


@pytest.mark.parametrize(
    ("kind", "name", "value", "why"),
    [
        ("quadcopter", "HERD_MASS", 30, "the rotors lift at most"),
        ("quadcopter", "HERD_INERTIA_X", 5e-5, "too small for steps"),
        ("quadcopter", "HERD_ATT_P", 0, "must be positive"),
        ("quadcopter", "HERD_ATT_P", 1e9, "is not within"),
        ("quadcopter", "WPNAV_SPEED", 1, "is not within"),
        ("quadcopter", "WPNAV_ACCEL", 1, "accel_max must be 0 or"),
        ("quadcopter", "ANGLE_MAX", 8000, "is not within 100 to 6800 cdeg"),
        ("quadcopter", "RTL_ALT", float("nan"), "is not a number"),
        ("quadcopter", "RTL_ALT", -1, "is not within"),
        ("quadcopter", "FRAME_CLASS", 2, "read-only"),
        ("quadcopter", "MIS_TOTAL", 2, "read-only"),
        ("rover", "HERD_WHEEL_P", 30, "too small for steps"),
        ("rover", "HERD_MASS", 0.09, "too small for steps"),
        ("rover", "WP_SPEED", 0.0, "is not within"),
    ],
)
def test_a_refusal_says_why_and_changes_nothing(kind, name, value, why):
    p, _ = flown(kind)
    assert why in refusal(p, name, value)


def test_gains_must_suit_the_constants_of_the_next_boot_too():
    p, _ = flown("rover")
    p.set("HERD_MASS", 2.0)
    p.set("HERD_WHEEL_RAD", 0.05)
    assert "too small" in refusal(p, "HERD_WHEEL_P", 2)


def test_an_unknown_name_is_refused_with_a_hint():
    with pytest.raises(ParameterRefused, match=r"unknown parameter RTL_ATL \(did you mean RTL_ALT"):
        make().set("RTL_ATL", 1)


def test_live_values_are_no_users_change():
    p = make()
    changes = []
    p.on_change = lambda: changes.append(1)
    shown = {"MIS_TOTAL": 5}
    p.follow("MIS_TOTAL", lambda: shown["MIS_TOTAL"])
    p.follow("NO_SUCH_NAME", lambda: 1)
    p.follow("STAT_RUNTIME", lambda: 1e20)
    assert (p["MIS_TOTAL"], p["STAT_RUNTIME"]) == (5, 2**31 - 1)
    shown["MIS_TOTAL"] = 6
    assert p["MIS_TOTAL"] == p.entry("MIS_TOTAL").value == 6
    assert not changes
    assert p.touched() == {}


def test_a_change_is_announced_and_an_equal_value_is_none():
    p = make()
    changes = []
    p.on_change = lambda: changes.append(1)
    p.set("RTL_ALT", 1500)
    p.set("RTL_ALT", 1500.3)
    assert (changes, p.touched()) == ([], {})
    p.set("RTL_ALT", 1600)
    assert (changes, p.touched()) == ([1], {"RTL_ALT": 1600})


def test_overrides_come_under_their_names_or_ours():
    p = make(params={"RTL_ALT": 2000, "mass": 1.3, "WPNAV_SPEED": 250, "roll_p": 100.0})
    assert p.settings.rtl_height == 20
    assert (p["RTL_ALT"], p["WPNAV_SPEED"], p["HERD_ATT_P"]) == (2000, 250, 100)
    assert p["HERD_MASS"] == pytest.approx(1.3)
    assert p.robot_overrides == {"mass": 1.3, "v_max": 2.5, "roll_p": 100.0}  # 1.3 as a double
    assert p.touched() == {}
    assert p.entry("RTL_ALT").default == 1500


def test_of_two_names_for_one_thing_the_later_counts():
    for params, fastest in (
        ({"WPNAV_SPEED": 200, "v_max": 3.0}, 3.0),
        ({"v_max": 3.0, "WPNAV_SPEED": 200}, 2.0),
    ):
        p = make(params=params)
        assert p.robot_overrides == {"v_max": fastest}
        assert p["WPNAV_SPEED"] == fastest * 100


@pytest.mark.parametrize(
    ("params", "why"),
    [
        ({"RTL_ATL": 1}, r"unknown quadcopter parameter 'RTL_ATL' \(did you mean 'RTL_ALT'"),
        ({"RTL_ALT": -1}, "RTL_ALT: -1 is not within"),
        ({"FRAME_CLASS": 2}, "unknown quadcopter parameter 'FRAME_CLASS'"),
        ({"WPNAV_SPEED": math.inf}, "WPNAV_SPEED: inf is not a number"),
        ({"mass": 50}, "the rotors lift"),
    ],
)
def test_overrides_that_cannot_be(params, why):
    with pytest.raises(ValueError, match=why):
        make(params=params)
    config = VehicleConfig(kind="quadcopter", system_id=1, params=params)
    with pytest.raises(ValueError, match=why):
        make_robot(config)


def test_values_of_overrides_are_known_before_anything_is_built():
    values = parameter_values("quadcopter", "default", {"WPNAV_SPEED": 300, "mass": 1.1})
    assert (values["v_max"], values["mass"], values["v_up_max"]) == (3.0, 1.1, 2.5)


def test_defaults_build_the_same_robot_as_no_parameters_at_all():
    for kind in KINDS:
        config = VehicleConfig(kind=kind, system_id=1)
        plain, tuned = make_robot(config), built(config, Parameters(config))
        for robot in (plain, tuned):
            robot.motors_on = True
            for _ in range(200):
                robot.control(Setpoint(position=Vec3(1.0, 0.5, -2.0), yaw=0.2))
                robot.advance()
        assert plain.kinematics() == tuned.kinematics()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("factor", [0.011, 99.0])
def test_no_gain_that_is_taken_breaks_the_flight(kind, factor):
    for name in numbers(kind, "ardupilot"):
        p, robot = flown(kind, profile="ardupilot")
        robot.motors_on = True
        (entry,) = (e for e in p if e.parameter.robot_name == name)
        try:
            p.set(entry.parameter.name, entry.value * factor)
        except ParameterRefused:
            continue
        for step in range(500):
            robot.control(Setpoint(position=Vec3(9.0, step % 7 - 3.0, -3.0), yaw=step % 5 - 2.0))
            robot.advance()
            robot.advance()
        assert all(map(math.isfinite, robot.kinematics())), name
