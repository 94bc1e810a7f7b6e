"""COMPONENT_METADATA is on the wire what common.xml says."""

from struct import unpack

from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.protocol.component_metadata import component_metadata


def test_the_frame_is_that_of_common_xml():
    (frame,) = Codec(7).frames([component_metadata(1234, "mftp:///general.json", 0xCAFEBABE)])
    assert int.from_bytes(frame[7:10], "little") == 397
    boot_ms, crc = unpack("<II", frame[10:18])
    assert (boot_ms, crc) == (1234, 0xCAFEBABE)
    assert frame[18:-2] == b"mftp:///general.json"
    fields = b"uint32_t time_boot_ms uint32_t file_crc char uri d"  # d: 100 elements
    seed = mav.x25crc(b"COMPONENT_METADATA " + fields).crc
    extra = seed & 0xFF ^ seed >> 8
    assert int.from_bytes(frame[-2:], "little") == mav.x25crc(frame[1:-2] + bytes([extra])).crc


def test_a_long_uri_is_cut_and_ends_with_a_zero():
    (frame,) = Codec(7).frames([component_metadata(2**40, "u" * 300, 1)])
    assert len(frame) == 12 + 4 + 4 + 99


def test_it_numbers_like_any_other_message_and_mavlink_1_does_without_it():
    codec = Codec(7)
    heartbeat = mav.MAVLink_heartbeat_message(2, 3, 1, 4, 3, 3)
    frames = codec.frames([heartbeat, component_metadata(1, "u", 2), heartbeat])
    assert [frame[4] for frame in frames] == [0, 1, 2]
    codec.decode(heartbeat.pack(mav.MAVLink(None, 255, 190), force_mavlink1=True))
    assert len(codec.frames([component_metadata(1, "u", 2)])) == 0
