"""What ground stations show beside a parameter: MAVLink's component metadata, as JSON.

The format is COMP_METADATA_TYPE_PARAMETER (mavlink.io, component metadata protocol).
"""

import json

from .parameter import INT8, INT16, INT32, REAL32, Parameter, shortest
from .store import Parameters

_TYPES = {INT8: "Int8", INT16: "Int16", INT32: "Int32", REAL32: "Float"}


def parameter_json(parameters: Parameters) -> bytes:
    """Return `parameter.json` for all parameters of a vehicle."""
    described = [_described(parameter, default) for _, parameter, _, default in parameters]
    return json.dumps({"version": 1, "parameters": described}, separators=(",", ":")).encode()


def _described(parameter: Parameter, default: float) -> dict[str, object]:
    number = int if parameter.is_integer else _float
    described: dict[str, object] = {
        "name": parameter.name,
        "type": _TYPES[parameter.type],
        "group": parameter.group,
        "category": "System" if parameter.read_only else "Standard",
        "shortDesc": parameter.text,
        "longDesc": f"{parameter.text}. {parameter.note}",
        "default": number(default),
        "min": number(parameter.low),
        "max": number(parameter.high),
    }
    if parameter.unit:
        described["units"] = parameter.unit
    if not parameter.is_integer:
        described["decimalPlaces"] = 7 if 0 < abs(default) < 0.001 else 3
    if parameter.bits:
        described["bitmask"] = [
            {"index": bit, "description": label} for bit, label in parameter.bits.items()
        ]
    elif parameter.values:
        described["values"] = [
            {"value": value, "description": label} for value, label in parameter.values.items()
        ]
    for key, holds in (
        ("rebootRequired", parameter.reboot),
        ("readOnly", parameter.read_only),
        ("volatile", parameter.live),
    ):
        if holds:
            described[key] = True
    return described


def _float(value: float) -> float:
    return float(shortest(value)) if abs(value) < 3e38 else value
