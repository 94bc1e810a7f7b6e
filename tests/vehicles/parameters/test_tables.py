"""Every gain, constant and setting has one parameter, with a true default and a real type."""

from dataclasses import fields, is_dataclass, replace

import pytest

from mavherd.vehicles.config import AUTOPILOTS, KINDS, PROFILES
from mavherd.vehicles.flight.settings import STREAM_GROUPS, Settings
from mavherd.vehicles.parameters.parameter import (
    INT8,
    INT16,
    INT32,
    REAL32,
    Parameter,
    ParameterRefused,
    float32,
    shortest,
)
from mavherd.vehicles.parameters.profile import body_and_tuning
from mavherd.vehicles.parameters.settings_path import read, write
from mavherd.vehicles.parameters.tables import TABLES, table

EVERY = [(a, k, p) for a in AUTOPILOTS for k in KINDS for p in PROFILES]
ONE_EACH = [(a, k) for a in AUTOPILOTS for k in KINDS]


def by_name(autopilot, kind, profile="default"):
    return {p.name: p for p in table(autopilot, kind, profile)}


def test_there_is_a_table_for_every_personality_and_kind():
    assert set(TABLES) == set(ONE_EACH)


@pytest.mark.parametrize(("autopilot", "kind", "profile"), EVERY)
def test_every_gain_and_constant_has_exactly_one_parameter(autopilot, kind, profile):
    body, tuning = body_and_tuning(kind, profile)
    wanted = sorted(
        f"{part}.{field.name}"
        for part, holder in (("body", body), ("tuning", tuning))
        for field in fields(holder)
    )
    rows = table(autopilot, kind, profile)
    shown = [p.path or p.follows for p in rows if p.is_robots or p.follows == "tuning.printed_form"]
    if kind == "quadcopter":
        wanted.remove("tuning.printed_form")
        assert shown.count("tuning.printed_form") == 1
        shown.remove("tuning.printed_form")
    assert sorted(shown) == wanted


@pytest.mark.parametrize(("autopilot", "kind", "profile"), EVERY)
def test_defaults_of_gains_and_constants_are_those_of_the_profile(autopilot, kind, profile):
    parts = dict(zip(("body", "tuning"), body_and_tuning(kind, profile), strict=True))
    for p in table(autopilot, kind, profile):
        if p.is_robots:
            part, _, name = p.path.partition(".")
            assert p.default * p.scale == pytest.approx(getattr(parts[part], name), rel=2e-4), p


@pytest.mark.parametrize(("autopilot", "kind", "profile"), EVERY)
def test_names_are_unique_and_fit_the_wire(autopilot, kind, profile):
    names = [p.name for p in table(autopilot, kind, profile)]
    assert len(set(names)) == len(names)
    assert all(0 < len(name) <= 16 and name.isascii() and name.isupper() for name in names)


@pytest.mark.parametrize(("autopilot", "kind", "profile"), EVERY)
def test_every_default_can_be_stored_as_it_is(autopilot, kind, profile):
    for p in table(autopilot, kind, profile):
        assert p.stored(p.default) == float32(p.default), p.name
        assert p.low < p.high, p.name
        assert p.text, p.name
        assert p.group, p.name


@pytest.mark.parametrize(("autopilot", "kind"), ONE_EACH)
def test_every_setting_that_is_named_exists_and_has_one_parameter(autopilot, kind):
    settings = Settings()
    paths = [p.path for p in table(autopilot, kind, "default") if p.is_setting]
    assert len(set(paths)) == len(paths)
    for p in table(autopilot, kind, "default"):
        if p.is_setting:
            write(settings, p.path, p.to_ours(p.default))
            ours = read(settings, p.path)
            assert p.to_wire(ours) == float32(p.default), p.name


def test_every_setting_can_be_reached_by_a_parameter_of_some_vehicle():
    reached = {p.path for rows in TABLES.values() for p in rows}

    def leaves(holder, path):
        for field in fields(holder):
            value = getattr(holder, field.name)
            if is_dataclass(value):
                yield from leaves(value, f"{path}.{field.name}")
            elif field.name == "stream_rates":
                yield from (f"{path}.stream_rates.{n}.{g}" for n in range(4) for g in STREAM_GROUPS)
            else:
                yield f"{path}.{field.name}"

    unreached = set(leaves(Settings(), "settings")) - reached
    assert not unreached


@pytest.mark.parametrize(
    ("kind", "name", "type_", "default", "unit"),
    [  # ArduCopter and ArduRover 4.6
        ("quadcopter", "RTL_ALT", INT32, 1500, "cm"),
        ("quadcopter", "RTL_LOIT_TIME", INT32, 5000, "ms"),
        ("quadcopter", "LAND_SPEED", INT16, 50, "cm/s"),
        ("quadcopter", "WPNAV_RADIUS", REAL32, 200, "cm"),
        ("quadcopter", "ANGLE_MAX", INT16, 3000, "cdeg"),
        ("quadcopter", "DISARM_DELAY", INT8, 10, "s"),
        ("quadcopter", "FRAME_CLASS", INT8, 1, ""),
        ("quadcopter", "PILOT_SPEED_UP", INT16, 250, "cm/s"),
        ("quadcopter", "FS_OPTIONS", INT32, 16, ""),
        ("quadcopter", "GUID_TIMEOUT", REAL32, 3, "s"),
        ("rover", "CRUISE_SPEED", REAL32, 1, "m/s"),
        ("rover", "WP_RADIUS", REAL32, 2, "m"),
        ("rover", "FS_ACTION", INT8, 2, ""),
        ("rover", "FENCE_TYPE", INT8, 6, ""),
        *(
            (kind, *row)
            for kind in KINDS
            for row in (
                ("SYSID_THISMAV", INT16, 1, ""),
                ("SYSID_MYGCS", INT16, 255, ""),
                ("ARMING_CHECK", INT32, 1, ""),
                ("ARMING_REQUIRE", INT8, 1, ""),
                ("BATT_CAPACITY", INT32, 3300, "mAh"),
                ("BATT_LOW_VOLT", REAL32, 10.5, "V"),
                ("FENCE_RADIUS", REAL32, 300, "m"),
                ("FS_GCS_ENABLE", INT8, 0, ""),
                ("MIS_TOTAL", INT16, 0, ""),
                ("RC1_MIN", INT16, 1000, "PWM"),
                ("SR0_POSITION", INT16, 0, "Hz"),
                ("STAT_RUNTIME", INT32, 0, "s"),
            )
        ),
    ],
)
def test_ardupilots_own_types_units_and_defaults(kind, name, type_, default, unit):
    p = by_name("ardupilot", kind)[name]
    assert (p.type, p.default, p.unit) == (type_, default, unit)


def test_a_list_begins_as_ardupilots_does():
    for kind in KINDS:
        assert table("ardupilot", kind, "default")[0].name == "FORMAT_VERSION"


def test_px4_knows_two_types_and_lists_by_name():
    for kind in KINDS:
        rows = table("px4", kind, "default")
        assert {p.type for p in rows} == {INT32, REAL32}
        assert [p.name for p in rows] == sorted(p.name for p in rows)


@pytest.mark.parametrize(("autopilot", "kind"), ONE_EACH)
def test_what_changes_nothing_says_so(autopilot, kind):
    rows = table(autopilot, kind, "default")
    kept = [p for p in rows if not p.path and not p.read_only]
    assert kept
    assert all("does not use it" in p.note for p in kept)
    assert not any("does not use it" in p.note for p in rows if p.path or p.read_only)


INT = Parameter(name="I", type=INT8, default=0, low=-5, high=100, text="an integer")
REAL = Parameter(name="R", type=REAL32, default=0, low=0, high=0.1, text="a number", unit="m")


@pytest.mark.parametrize(
    ("given", "kept"),
    [(3.0, 3), (3.4, 3), (3.9, 3), (3.995, 4), (-5.4, -5), (-0.995, -1), (-0.9, 0), (100, 100)],
)
def test_integers_are_cut_off_as_ardupilot_does(given, kept):
    assert INT.stored(given) == kept


@pytest.mark.parametrize("value", [float("nan"), float("inf"), float("-inf")])
@pytest.mark.parametrize("parameter", [INT, REAL])
def test_what_is_no_number_is_refused(parameter, value):
    with pytest.raises(ParameterRefused, match="is not a number"):
        parameter.stored(value)


@pytest.mark.parametrize("value", [-6, 101, 1e30, -3e38])
def test_integers_keep_their_limits(value):
    with pytest.raises(ParameterRefused, match=r"I: .* is not within -5 to 100"):
        INT.stored(value)


def test_limits_of_the_type_hold_whatever_the_table_says():
    wide = replace(INT, low=-1e9, high=1e9)
    assert wide.stored(127) == 127
    for value in (128, -129):
        with pytest.raises(ParameterRefused, match="is not within -128 to 127"):
            wide.stored(value)


def test_a_limit_is_within_the_limits_as_single_and_as_double():
    assert REAL.stored(0.1) == REAL.stored(float32(0.1)) == float32(0.1)
    with pytest.raises(ParameterRefused, match=r"R: 0.101 is not within 0 to 0.1 m"):
        REAL.stored(0.101)


def test_unsupported_codes_and_bits_are_refused():
    rows = by_name("ardupilot", "quadcopter")
    assert rows["FENCE_ACTION"].stored(1) == 1
    with pytest.raises(ParameterRefused, match="FENCE_ACTION: 3 is not supported, only 0"):
        rows["FENCE_ACTION"].stored(3)  # SmartRTL
    assert rows["GUID_OPTIONS"].stored(8) == 8
    with pytest.raises(ParameterRefused, match="bits that are not supported"):
        rows["GUID_OPTIONS"].stored(4)


@pytest.mark.parametrize("value", [0.1, 1 / 3, 8.54858e-06, 1e-30, 123456.789, 3000.0, -7.0])
def test_the_shortest_text_reads_back_the_same(value):
    single = float32(value)
    assert float32(float(shortest(single))) == single
    assert len(shortest(float32(0.1))) == 3
