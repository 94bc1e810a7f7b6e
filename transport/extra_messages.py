"""Messages of MAVLink's common set that the installed dialect lacks: for sending only.

Field names, types and numbers are those of `common.xml` at mavlink.io. Each class is built as
the dialect builds its own, so that `Codec` packs it like any other message.
"""

import struct
from collections.abc import Callable

from .dialect import form_of, mav
from .message import Message

_CODES = {
    "char": "s",
    "float": "f",
    "uint8_t": "B",
    "int16_t": "h",
    "uint16_t": "H",
    "int32_t": "i",
    "uint32_t": "I",
    "uint64_t": "Q",
}
Field = tuple[str, str, int]
"""Type, name, and the length of an array (0: no array)."""


def _define(message_id: int, crc_extra: int, fields: tuple[Field, ...]) -> Callable[..., Message]:
    """Return the class of a message; it takes its fields in the order given here."""
    name = NAMES[message_id]
    wire = sorted(fields, key=lambda field: -struct.calcsize(_CODES[field[0]]))  # stable
    tables = {
        "__doc__": f"{name}, to be sent.",
        "id": message_id,
        "msgname": name,
        "fieldnames": [field for _, field, _ in fields],
        "ordered_fieldnames": [field for _, field, _ in wire],
        "fieldtypes": [kind for kind, _, _ in fields],
        "array_lengths": [length for _, _, length in wire],
        "crc_extra": crc_extra,
        "unpacker": struct.Struct(
            "<" + "".join(f"{length or ''}{_CODES[kind]}" for kind, _, length in wire)
        ),
    }
    kind = type(f"MAVLink_{name.lower()}_message", (mav.MAVLink_message,), tables)
    make: Callable[..., Message] = form_of(kind).kind
    return make


ESC_STATUS_ID = 291
PROTOCOL_VERSION_ID = 300
COMPONENT_METADATA_ID = 397
AVAILABLE_MODES_ID = 435
CURRENT_MODE_ID = 436

NAMES = {
    ESC_STATUS_ID: "ESC_STATUS",
    PROTOCOL_VERSION_ID: "PROTOCOL_VERSION",
    COMPONENT_METADATA_ID: "COMPONENT_METADATA",
    AVAILABLE_MODES_ID: "AVAILABLE_MODES",
    CURRENT_MODE_ID: "CURRENT_MODE",
}

esc_status = _define(
    ESC_STATUS_ID,
    10,
    (
        ("uint8_t", "index", 0),
        ("uint64_t", "time_usec", 0),
        ("int32_t", "rpm", 4),
        ("float", "voltage", 4),
        ("float", "current", 4),
    ),
)
protocol_version = _define(
    PROTOCOL_VERSION_ID,
    217,
    (
        ("uint16_t", "version", 0),
        ("uint16_t", "min_version", 0),
        ("uint16_t", "max_version", 0),
        ("uint8_t", "spec_version_hash", 8),
        ("uint8_t", "library_version_hash", 8),
    ),
)
component_metadata = _define(
    COMPONENT_METADATA_ID,
    182,
    (("uint32_t", "time_boot_ms", 0), ("uint32_t", "file_crc", 0), ("char", "uri", 100)),
)
available_modes = _define(
    AVAILABLE_MODES_ID,
    134,
    (
        ("uint8_t", "number_modes", 0),
        ("uint8_t", "mode_index", 0),
        ("uint8_t", "standard_mode", 0),
        ("uint32_t", "custom_mode", 0),
        ("uint32_t", "properties", 0),
        ("char", "mode_name", 35),
    ),
)
current_mode = _define(
    CURRENT_MODE_ID,
    193,
    (
        ("uint8_t", "standard_mode", 0),
        ("uint32_t", "custom_mode", 0),
        ("uint32_t", "intended_custom_mode", 0),
    ),
)
