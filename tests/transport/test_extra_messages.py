"""Messages that the dialect lacks are on the wire what MAVLink's common.xml says."""

import struct

import pytest
from pymavlink.dialects.v20 import all as whole

from mavherd.transport import extra_messages as extra
from mavherd.transport.mavlink import Codec, mav

CLASSES = (
    extra.esc_status,
    extra.protocol_version,
    extra.component_metadata,
    extra.available_modes,
    extra.current_mode,
)


def decode(frame: bytes):
    """Read a frame with the dialect that has these messages."""
    return whole.MAVLink(None).decode(bytearray(frame))


@pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.msgname)
def test_the_checksum_seed_is_that_of_the_fields(kind):
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    text = f"{kind.msgname} ".encode()
    for name, length in zip(kind.ordered_fieldnames, kind.array_lengths, strict=True):
        text += f"{types[name]} {name} ".encode() + (bytes([length]) if length else b"")
    crc = mav.x25crc(text).crc
    assert kind.crc_extra == crc & 0xFF ^ crc >> 8


def test_other_dialects_read_them():
    mode, shown = Codec(7).frames(
        [extra.current_mode(3, 50593792, 4), extra.available_modes(9, 2, 5, 4 << 24, 1, b"RTL")]
    )
    m = decode(mode)
    assert (m.standard_mode, m.custom_mode, m.intended_custom_mode) == (3, 50593792, 4)
    m = decode(shown)
    assert (m.number_modes, m.mode_index, m.standard_mode) == (9, 2, 5)
    assert (m.custom_mode, m.properties, m.mode_name) == (4 << 24, 1, "RTL")


def test_arrays_are_laid_out_by_size_and_then_in_order():
    speeds, volts, amperes = [1, -2, 3, 4], [1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0]
    (frame,) = Codec(7).frames([extra.esc_status(9, 10**12, speeds, volts, amperes)])
    assert struct.unpack("<Q4i4f4fB", frame[10:-2]) == (10**12, *speeds, *volts, *amperes, 9)
    (frame,) = Codec(7).frames([extra.protocol_version(200, 100, 201, [1] * 8, [2] * 8)])
    assert struct.unpack("<3H8B8B", frame[10:-2]) == (200, 100, 201, *[1] * 8, *[2] * 8)


def test_they_count_and_print_like_any_other():
    codec = Codec(7)
    frames = codec.frames([extra.current_mode(1, 2, 3)] * 3)
    assert [frame[4] for frame in frames] == [0, 1, 2]
    m = extra.current_mode(1, 2, 3)
    assert (m.get_type(), m.get_msgId()) == ("CURRENT_MODE", 436)
    assert "custom_mode : 2" in str(m)


def test_a_field_too_few_is_a_mistake():
    with pytest.raises(TypeError, match="intended_custom_mode"):
        extra.current_mode(1, 2)
