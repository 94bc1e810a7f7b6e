"""Parameters are listed, read and set as pymavlink's users do it, on both personalities."""

import math
import struct

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

REAL32 = mav.MAV_PARAM_TYPE_REAL32
INTEGERS = {
    mav.MAV_PARAM_TYPE_INT8: (-128, 127),
    mav.MAV_PARAM_TYPE_INT16: (-(2**15), 2**15 - 1),
    mav.MAV_PARAM_TYPE_INT32: (-(2**31), 2**31 - 1),
}


@pytest.fixture(scope="module")
def copter(start):
    return start("quadcopter", speed=3)


@pytest.fixture(scope="module")
def px4(start):
    return start("quadcopter", "--autopilot", "px4", speed=3)


@pytest.fixture
def station(copter, connect):
    return connect(copter)


def read(station, name="", index=-1):
    station.send(mav.MAVLink_param_request_read_message(1, 1, name.encode(), index))
    return station.wait("PARAM_VALUE", where=lambda m: m.param_id == name or not name)


def write(station, name, value, kind=REAL32):
    station.send(mav.MAVLink_param_set_message(1, 1, name.encode(), value, kind))


def listed(station, component=1):
    """Return the PARAM_VALUEs of a complete list, by index."""
    station.forget()
    station.send(mav.MAVLink_param_request_list_message(1, component))
    found = {}
    while True:
        m = station.wait("PARAM_VALUE")
        if m.param_index != 65_535:
            found[m.param_index] = m
        if len(found) == m.param_count and set(found) == set(range(m.param_count)):
            return [found[i] for i in sorted(found)]


@pytest.mark.parametrize("component", [0, 1])
@pytest.mark.parametrize("how", ["tcp", "udp"])
def test_the_list_is_complete_and_its_count_constant(copter, connect, how, component):
    values = listed(connect(copter, how), component)
    assert {m.param_count for m in values} == {len(values)}
    names = [m.param_id for m in values]
    assert len(set(names)) == len(names) >= 150
    assert names[0] == "FORMAT_VERSION"
    assert all(0 < len(name) <= 16 and name.isascii() for name in names)
    for m in values:
        assert math.isfinite(m.param_value), m.param_id
        if m.param_type != REAL32:
            low, high = INTEGERS[m.param_type]
            assert m.param_value == int(m.param_value), m.param_id
            assert low <= m.param_value <= high, m.param_id


def test_clients_find_what_they_show(station):
    names = {m.param_id for m in listed(station)}
    assert names >= {
        "SYSID_THISMAV",
        "SYSID_MYGCS",
        "FRAME_CLASS",
        "ARMING_CHECK",
        "RTL_ALT",
        "WPNAV_SPEED",
        "GUID_TIMEOUT",
        "BATT_CAPACITY",
        "FS_THR_ENABLE",
        "FS_GCS_ENABLE",
        "FENCE_ENABLE",
        "DISARM_DELAY",
        "SR0_EXTRA1",
    }


def test_a_parameter_is_read_by_name_and_by_index(station):
    by_name = read(station, "RTL_ALT")
    assert by_name.param_value == 1500
    station.forget()
    station.send(mav.MAVLink_param_request_read_message(1, 1, b"", by_name.param_index))
    by_index = station.wait("PARAM_VALUE")
    assert (by_index.param_id, by_index.param_value) == ("RTL_ALT", 1500)


@pytest.mark.parametrize(("name", "index"), [("NO_SUCH", -1), ("", 30_000), ("rtl_alt", -1)])
def test_an_unknown_parameter_is_met_with_silence(station, name, index):
    station.send(mav.MAVLink_param_request_read_message(1, 1, name.encode(), index))
    assert not [m for m in station.until_answered() if m.get_type() == "PARAM_VALUE"]


def test_a_set_parameter_is_told_to_every_station_with_its_real_type(copter, connect):
    setter, watcher = connect(copter, "tcp"), connect(copter, "udp", system=254)
    watcher.until_answered()  # from then on it is known to the vehicle
    kind = read(setter, "RTL_ALT").param_type
    assert kind != REAL32
    for value in (1234, 1500):
        write(setter, "RTL_ALT", value)  # as a float, as DroneKit does
        for station in (setter, watcher):
            echo = station.wait("PARAM_VALUE", where=lambda m: m.param_id == "RTL_ALT")
            assert (echo.param_value, echo.param_type) == (value, kind)
    assert read(setter, "RTL_ALT").param_value == 1500


def test_a_float_keeps_its_fraction_and_an_integer_is_rounded(station):
    write(station, "FENCE_RADIUS", 123.25)
    assert read(station, "FENCE_RADIUS").param_value == 123.25
    write(station, "RTL_ALT", 1300.4)
    assert read(station, "RTL_ALT").param_value == 1300
    write(station, "RTL_ALT", 1500)


@pytest.mark.parametrize("value", [math.nan, math.inf, -1e30, 1e30])
def test_an_absurd_value_changes_nothing(station, value):
    before = read(station, "WPNAV_SPEED").param_value
    write(station, "WPNAV_SPEED", value)
    assert read(station, "WPNAV_SPEED").param_value == before


def test_a_refused_value_is_answered_with_the_old_one_and_the_reason(station):
    before = read(station, "WPNAV_SPEED").param_value
    write(station, "WPNAV_SPEED", 1e9)
    said = {}
    while len(said) < 2:
        m = station.wait("PARAM_VALUE", "STATUSTEXT")
        said[m.get_type()] = m
    assert said["PARAM_VALUE"].param_value == before
    assert "WPNAV_SPEED" in said["STATUSTEXT"].text


def test_what_is_set_is_flown(station):
    write(station, "FS_GCS_ENABLE", 0)
    write(station, "DISARM_DELAY", 1)
    assert station.ask(mav.MAV_CMD_DO_SET_MODE, 1, 4) == 0
    assert station.ask(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 0
    armed = station.wait("SYSTEM_TIME").time_boot_ms
    station.wait("HEARTBEAT", where=lambda m: not m.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)
    assert station.wait("SYSTEM_TIME").time_boot_ms - armed < 4000
    write(station, "DISARM_DELAY", 10)


def test_px4_sends_the_bits_of_an_integer_and_a_hash_first(px4, connect):
    station = connect(px4)
    station.send(mav.MAVLink_param_request_list_message(1, 1))
    assert station.wait("PARAM_VALUE").param_id == "_HASH_CHECK"
    values = {m.param_id: m for m in listed(station)}
    assert len(values) >= 30
    timeout = values["COM_DL_LOSS_T"]
    assert timeout.param_type == mav.MAV_PARAM_TYPE_INT32
    assert struct.unpack("<i", struct.pack("<f", timeout.param_value)) == (10,)
    bits = struct.unpack("<f", struct.pack("<i", 25))[0]
    write(station, "COM_DL_LOSS_T", bits, mav.MAV_PARAM_TYPE_INT32)
    set_to = "COM_DL_LOSS_T", bits  # as it was, it also comes in the rest of the first list
    station.wait("PARAM_VALUE", where=lambda m: (m.param_id, m.param_value) == set_to)
