"""The metadata file keeps to MAVLink's schema and tells the truth about every parameter."""

import json

import pytest

from mavherd.vehicles.config import AUTOPILOTS, KINDS, VehicleConfig
from mavherd.vehicles.parameters.metadata import parameter_json
from mavherd.vehicles.parameters.store import Parameters

ALLOWED = {  # parameter.schema.json of mavlink/mavlink
    "name": str, "type": str, "shortDesc": str, "longDesc": str, "units": str,
    "default": (int, float), "decimalPlaces": int, "min": (int, float), "max": (int, float),
    "increment": (int, float), "rebootRequired": bool, "group": str, "category": str,
    "volatile": bool, "values": list, "bitmask": list, "readOnly": bool,
}  # fmt: skip
TYPES = {2: "Int8", 4: "Int16", 6: "Int32", 9: "Float"}


def described(parameters):
    data = parameter_json(parameters)
    content = json.loads(data)
    assert content.keys() == {"version", "parameters"}
    return {each["name"]: each for each in content["parameters"]}


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("kind", KINDS)
def test_every_parameter_is_described_as_the_schema_says(kind, autopilot):
    p = Parameters(VehicleConfig(kind=kind, system_id=3, autopilot=autopilot))
    found = described(p)
    assert list(found) == [entry.parameter.name for entry in p]
    for _, parameter, _, default in p:
        each = found[parameter.name]
        assert each.keys() <= ALLOWED.keys()
        assert all(isinstance(value, ALLOWED[key]) for key, value in each.items())
        assert each["type"] == TYPES[parameter.type]
        assert each["default"] == pytest.approx(default)
        assert each["min"] <= each["default"] <= each["max"]
        assert each.get("readOnly", False) == parameter.read_only


def test_labels_and_bits_are_told():
    found = described(Parameters(VehicleConfig(kind="quadcopter", system_id=3)))
    assert {"value": 1, "description": "RTL or Land"} in found["FENCE_ACTION"]["values"]
    assert {"index": 1, "description": "Circle"} in found["FENCE_TYPE"]["bitmask"]
    assert found["HERD_MASS"]["rebootRequired"] is True
    assert found["MIS_TOTAL"]["volatile"] is True
    assert found["RTL_ALT"]["units"] == "cm"
    assert "does not use it" in found["RC1_MIN"]["longDesc"]
