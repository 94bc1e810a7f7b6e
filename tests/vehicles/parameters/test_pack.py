"""`param.pck` is what ArduPilot's packed form says: read here by the format's own description."""

import struct

import pytest

from mavherd.vehicles.config import KINDS, VehicleConfig
from mavherd.vehicles.parameters.pack import pack
from mavherd.vehicles.parameters.store import Parameters

FORMS = {1: "b", 2: "h", 3: "i", 4: "f"}
MAVLINK_TYPES = {1: 2, 2: 4, 3: 6, 4: 9}


def make(kind="quadcopter", **params):
    return Parameters(VehicleConfig(kind=kind, system_id=9, params=params))


def unpack(data):
    """Return magic, number in all, and name -> (type, value, default)."""
    magic, count, total = struct.unpack_from("<HHH", data)
    at, last, found = 6, "", {}
    while at < len(data):
        code, flags = data[at] & 15, data[at] >> 4
        assert code, "padding that nobody asked for"
        shared, others = data[at + 1] & 15, (data[at + 1] >> 4) + 1
        name = last[:shared] + data[at + 2 : at + 2 + others].decode()
        at += 2 + others
        form = "<" + FORMS[code] * (2 if flags & 1 else 1)
        values = struct.unpack_from(form, data, at)
        at += struct.calcsize(form)
        found[name] = (MAVLINK_TYPES[code], values[0], values[-1])
        last = name
    assert len(found) == count
    return magic, total, found


@pytest.mark.parametrize("kind", KINDS)
def test_every_parameter_is_in_the_pack(kind):
    p = make(kind)
    magic, total, found = unpack(pack(p))
    assert (magic, total) == (0x671B, len(p))
    assert list(found) == [entry.parameter.name for entry in p]
    for _, parameter, value, _ in p:
        assert found[parameter.name] == (parameter.type, value, value)


def test_defaults_are_there_where_they_differ():
    p = make()
    p.set("RTL_ALT", 2000)
    p.set("WPNAV_SPEED", 200)
    magic, _, found = unpack(pack(p, with_defaults=True))
    assert magic == 0x671C
    assert found["RTL_ALT"] == (6, 2000, 1500)
    assert found["WPNAV_SPEED"] == (9, 200, 150)
    assert found["SYSID_THISMAV"] == (4, 9, 9)
    assert {n for n, (_, value, usual) in found.items() if value != usual} == {
        "RTL_ALT",
        "WPNAV_SPEED",
    }


def test_a_part_of_the_list_stands_alone():
    p = make()
    names = [entry.parameter.name for entry in p]
    for start, count in ((0, 10), (5, 7), (len(p) - 3, 50), (10, 0)):
        _, total, found = unpack(pack(p, start=start, count=count))
        assert total == len(p)
        assert list(found) == names[start : start + count if count else None]
    assert unpack(pack(p, start=100_000)) == (0x671B, len(p), {})


def test_names_share_their_beginnings():
    assert len(pack(make())) < 12 * len(make())
