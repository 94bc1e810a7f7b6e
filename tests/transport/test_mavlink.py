"""The codec finds every good frame in any bytes, in any slices, and never raises."""

import itertools
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as pymavlink

from mavherd.transport.mavlink import Codec, datagrams, mav


def text(words: bytes) -> mav.MAVLink_statustext_message:
    return mav.MAVLink_statustext_message(6, words)


def heartbeat() -> mav.MAVLink_heartbeat_message:
    return mav.MAVLink_heartbeat_message(2, 3, 1, 4, 3, 3)


def arm(system: int) -> mav.MAVLink_command_long_message:
    return mav.MAVLink_command_long_message(system, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)


def names(messages) -> list[str]:
    return [m.get_type() for m in messages]


def signed(message) -> bytes:
    sender = mav.MAVLink(None, srcSystem=9, srcComponent=1)
    sender.signing.secret_key, sender.signing.sign_outgoing = b"k" * 32, True
    return bytes(message.pack(sender))


def version_1(message) -> bytes:
    sender = mav.MAVLink(None, srcSystem=9, srcComponent=1)
    return bytes(message.pack(sender, force_mavlink1=True))


def unknown_message(payload: bytes = b"12345") -> bytes:
    """A frame of a dialect that we do not speak: id 60000, whatever its checksum."""
    return bytes([0xFD, len(payload), 0, 0, 7, 9, 1, 0x60, 0xEA, 0]) + payload + b"\xab\xcd"


def with_bad_checksum(frame: bytes) -> bytes:
    return frame[:-1] + bytes([frame[-1] ^ 0x55])


def with_flag(frame: bytes, flag: int) -> bytes:
    """A HEARTBEAT with this incompatibility flag and the checksum that belongs to it."""
    body = bytes([frame[1], frame[2] | flag]) + frame[3:-2]
    crc = mav.x25crc([*body, mav.MAVLink_heartbeat_message.crc_extra]).crc
    return frame[:1] + body + crc.to_bytes(2, "little")


GOOD = Codec(7).encode([heartbeat(), arm(3), text(b"hello"), heartbeat()])
GOOD_NAMES = ["HEARTBEAT", "COMMAND_LONG", "STATUSTEXT", "HEARTBEAT"]
FRAME = Codec(7).encode([text(b"a good one")])


@given(st.lists(st.integers(0, len(GOOD)), max_size=20))
def test_any_slicing_of_a_stream_gives_the_same_messages(cuts):
    codec = Codec(1)
    ends = [0, *sorted(cuts), len(GOOD)]
    slices = [GOOD[a:b] for a, b in itertools.pairwise(ends)]
    got = [pair for part in slices for pair in codec.decode_frames(part)]
    assert names(m for m, _ in got) == GOOD_NAMES
    assert b"".join(frame for _, frame in got) == GOOD
    assert codec.bad_bytes == codec.lost == 0


def test_one_byte_at_a_time_gives_the_same_messages():
    codec = Codec(1)
    got = [m for i in range(len(GOOD)) for m in codec.decode(GOOD[i : i + 1])]
    assert names(got) == GOOD_NAMES
    assert got[1].target_system == 3
    assert (got[2].text, got[2].get_srcSystem(), got[2].get_srcComponent()) == ("hello", 7, 1)


def test_frames_are_numbered_in_order_and_wrap_at_256():
    sequences = [m.get_seq() for m in Codec(1).decode(Codec(7).encode([heartbeat()] * 300))]
    assert sequences == [i % 256 for i in range(300)]


@given(st.binary(max_size=400), st.binary(max_size=400))
def test_random_bytes_never_raise_and_never_hide_a_good_frame(before, after):
    codec = Codec(1)
    got = codec.decode(before + FRAME + after + bytes(300))
    assert "a good one" in [m.text for m in got if m.get_type() == "STATUSTEXT"]
    assert names(codec.decode(bytes(300) + FRAME))[-1] == "STATUSTEXT"


# Bytes that look like the beginning of frames: the worst garbage there is.
HEADERS = st.builds(
    lambda marker, length, flags, rest: bytes([marker, length, flags]) + rest,
    st.sampled_from([0xFD, 0xFE]),
    st.integers(0, 255),
    st.sampled_from([0, 1, 2, 255]),
    st.binary(max_size=12),
)


@given(st.lists(HEADERS, max_size=30).map(b"".join), st.booleans())
def test_false_frame_headers_never_hide_a_good_frame(garbage, stream):
    got = Codec(1).decode(garbage + FRAME + bytes(300), stream=stream)
    assert "a good one" in [m.text for m in got if m.get_type() == "STATUSTEXT"]


@given(st.binary(max_size=600), st.lists(st.integers(0, 600), max_size=8))
def test_random_streams_in_random_slices_never_raise_and_never_grow(data, cuts):
    codec = Codec(1)
    ends = [0, *sorted(cuts), len(data)]
    for a, b in itertools.pairwise(ends):
        codec.decode(data[a:b])
        assert len(codec._buffer) < 280  # the longest frame there is


@pytest.mark.parametrize(
    "junk",
    [b"\xfd", b"\xfe", b"\xfd\xff\x00", b"GET / HTTP/1.1\r\n\r\n", bytes(range(256)), GOOD[:20]],
    ids=["v2 marker", "v1 marker", "v2 header", "http", "all bytes", "half a frame"],
)
def test_garbage_before_between_and_after_frames_is_skipped_and_counted(junk):
    codec = Codec(1)
    first, second = Codec(7).frames([text(b"one"), text(b"two")])
    got = codec.decode(junk + first + junk + second + junk, stream=False)
    assert [m.text for m in got if m.get_type() == "STATUSTEXT"] == ["one", "two"]
    assert codec.bad_bytes + sum(len(f) for _, f in Codec(1).decode_frames(junk)) >= 3


def test_a_truncated_frame_in_a_datagram_is_dropped_and_does_not_swallow_the_next():
    codec = Codec(1)
    assert codec.decode(FRAME[:-1], stream=False) == []
    assert names(codec.decode(FRAME, stream=False)) == ["STATUSTEXT"]
    assert codec.bad_bytes == len(FRAME) - 1


def test_a_truncated_frame_on_a_stream_waits_for_its_rest():
    codec = Codec(1)
    assert codec.decode(FRAME[:-1]) == []
    assert names(codec.decode(FRAME[-1:])) == ["STATUSTEXT"]
    assert codec.bad_bytes == 0


def test_a_wrong_checksum_drops_that_frame_only():
    codec = Codec(1)
    first, second = Codec(7).frames([text(b"one"), text(b"two")])
    got = codec.decode(with_bad_checksum(first) + second, stream=False)
    assert [m.text for m in got] == ["two"]
    assert codec.bad_bytes == len(first)


def test_every_flipped_bit_of_a_frame_is_noticed():
    heard = Codec(1).decode(FRAME)[0]
    for at in range(len(FRAME) * 8):
        broken = bytearray(FRAME)
        broken[at // 8] ^= 1 << at % 8
        got = Codec(1).decode(bytes(broken), stream=False)
        assert got == [] or at // 8 == 2, f"bit {at} passed: {got} for {heard}"


def test_unknown_message_ids_are_skipped():
    codec = Codec(1)
    assert names(codec.decode(unknown_message() + FRAME + unknown_message())) == ["STATUSTEXT"]


def test_a_frame_inside_an_unknown_message_is_found():
    assert names(Codec(1).decode(unknown_message(FRAME))) == ["STATUSTEXT"]


def test_mavlink_1_frames_are_understood():
    (m,) = Codec(1).decode(version_1(arm(4)))
    assert (m.get_type(), m.target_system, m.get_srcSystem()) == ("COMMAND_LONG", 4, 9)


def test_mixed_versions_share_a_stream():
    codec = Codec(1)
    stream = version_1(heartbeat()) + FRAME + signed(heartbeat()) + version_1(text(b"x"))
    got = [m for i in range(len(stream)) for m in codec.decode(stream[i : i + 1])]
    assert names(got) == ["HEARTBEAT", "STATUSTEXT", "HEARTBEAT", "STATUSTEXT"]
    assert codec.bad_bytes == 0


def test_a_signed_frame_on_an_unsigned_link_is_read_and_does_no_harm():
    codec = Codec(1)
    got = codec.decode(FRAME + signed(arm(4)) + FRAME)
    assert names(got) == ["STATUSTEXT", "COMMAND_LONG", "STATUSTEXT"]
    assert codec.bad_bytes == 0
    assert codec.encode([heartbeat()])[2] == 0, "we must not begin to sign"


@pytest.mark.parametrize("flag", [0x02, 0x04, 0x80, 0xFE])
def test_unknown_incompatibility_flags_drop_the_frame(flag):
    (frame,) = Codec(7).frames([heartbeat()])
    assert names(Codec(1).decode(with_flag(frame, 0))) == ["HEARTBEAT"]
    got = Codec(1).decode(with_flag(frame, flag) + FRAME)
    assert names(got) == ["STATUSTEXT"]


def test_unknown_compatibility_flags_are_none_of_our_business():
    (frame,) = Codec(7).frames([heartbeat()])
    body = frame[1:3] + b"\xff" + frame[4:-2]
    crc = mav.x25crc([*body, mav.MAVLink_heartbeat_message.crc_extra]).crc
    codec = Codec(1)
    assert names(codec.decode(frame[:1] + body + crc.to_bytes(2, "little"))) == ["HEARTBEAT"]
    assert codec.bad_bytes == 0


def test_longer_payloads_of_a_newer_dialect_are_read():
    sender = mav.MAVLink(None, srcSystem=9, srcComponent=1)
    frame = bytearray(heartbeat().pack(sender))
    longer = bytes([0xFD, frame[1] + 4]) + bytes(frame[2:-2]) + b"\1\2\3\4"
    crc = mav.x25crc([*longer[1:], mav.MAVLink_heartbeat_message.crc_extra]).crc
    (m,) = Codec(1).decode(longer + crc.to_bytes(2, "little"))
    assert (m.get_type(), m.custom_mode) == ("HEARTBEAT", 4)


def test_lost_frames_are_counted_per_sender():
    codec = Codec(1)
    one, two = Codec(7).frames([heartbeat()] * 10), Codec(8).frames([heartbeat()] * 10)
    for a, b in zip(one[:3] + one[5:], two, strict=False):
        codec.decode(a + b)
    assert codec.lost == 2


def test_a_sequence_that_wraps_loses_nothing():
    codec = Codec(1)
    codec.decode(Codec(7).encode([heartbeat()] * 600))
    assert codec.lost == 0
    frames = Codec(7).frames([heartbeat()] * 260)
    codec = Codec(1)
    codec.decode(frames[254] + frames[257])  # 254, then 1
    assert codec.lost == 2


def test_a_frame_that_comes_twice_is_no_loss():
    codec = Codec(1)
    frames = Codec(7).frames([heartbeat()] * 3)
    codec.decode(frames[0] + frames[0] + frames[1] + frames[1] + frames[2])
    assert codec.lost == 0


def test_a_flood_of_invented_senders_does_not_grow_the_codec():
    codec = Codec(1)
    for system in range(256):
        for component in range(0, 256, 50):
            codec.decode(Codec(system, component).encode([heartbeat()]))
    assert len(codec._expected) <= 256


# MAVLink 1


def a_v1_peer() -> Codec:
    """A codec that has heard MAVLink 1 and nothing else."""
    codec = Codec(7)
    codec.decode(version_1(heartbeat()))
    return codec


def test_a_link_begins_in_mavlink_2():
    assert Codec(7).encode([heartbeat()])[0] == 0xFD


def test_who_speaks_mavlink_1_is_answered_in_mavlink_1():
    codec = a_v1_peer()
    answer = codec.encode([arm(3), heartbeat(), text(b"hello")])
    assert answer[0] == 0xFE
    heard = Codec(1).decode(answer)
    assert names(heard) == ["COMMAND_LONG", "HEARTBEAT", "STATUSTEXT"]
    assert (heard[0].target_system, heard[0].command, heard[0].param1) == (3, 400, 1)
    assert (heard[2].text, heard[2].get_srcSystem(), heard[2].get_srcComponent()) == ("hello", 7, 1)
    strict = mav.MAVLink(None)
    assert {len(f) for f in codec.frames([heartbeat()])} == {8 + 9}
    assert strict.decode(bytearray(codec.encode([heartbeat()]))).custom_mode == 4


def test_one_frame_of_mavlink_2_is_enough_to_be_answered_in_it_for_good():
    codec = a_v1_peer()
    codec.decode(FRAME)
    assert codec.encode([heartbeat()])[0] == 0xFD
    codec.decode(version_1(heartbeat()))
    assert codec.encode([heartbeat()])[0] == 0xFD


def test_a_broken_frame_decides_nothing():
    codec = Codec(7)
    codec.decode(with_bad_checksum(version_1(heartbeat())), stream=False)
    assert codec.version == 2


def test_mavlink_1_leaves_out_what_it_cannot_carry_and_loses_no_number():
    codec = a_v1_peer()
    beyond = mav.MAVLink_obstacle_distance_message(0, 0, [0] * 72, 1, 0, 9)
    assert beyond.get_msgId() > 255
    receiver = Codec(1)
    assert len(receiver.decode(codec.encode([heartbeat(), beyond, heartbeat()]))) == 2
    assert receiver.lost == 0


def test_mavlink_1_has_no_extension_fields_and_no_missing_zeros():
    ack = mav.MAVLink_command_ack_message(400, 0, 50, 9, 255, 190)
    (frame,) = a_v1_peer().frames([ack])
    assert frame[1] == 3, "command and result"
    (m,) = Codec(1).decode(frame)
    assert (m.command, m.result, m.progress, m.target_system) == (400, 0, 0, 0)


def definitions(name: str, read: set[str]) -> dict[int, list[str]]:
    """Read the names of the fields before `<extensions/>` of every message, by its id."""
    if name in read:
        return {}
    read.add(name)
    root = ElementTree.parse(Path(pymavlink.__file__).with_name(name)).getroot()
    out = {}
    for included in root.iter("include"):
        out |= definitions(included.text, read)
    for message in root.iter("message"):
        tags = [child.tag for child in message]
        end = tags.index("extensions") if "extensions" in tags else len(tags)
        fields = [child.get("name") for child in message[:end] if child.tag == "field"]
        out[int(message.get("id"))] = fields
    return out


def test_every_message_of_mavlink_1_has_the_length_that_its_definition_says():
    base = definitions("ardupilotmega.xml", set())
    sizes = {"char": 1, "float": 4, "double": 8}
    codec, checked = a_v1_peer(), 0
    for number, kind in mav.mavlink_map.items():
        if number > 255:
            continue
        types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
        arrays = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
        length = sum(
            (sizes.get(types[f]) or int(types[f].strip("uint_")) // 8) * (arrays[f] or 1)
            for f in base[number]
        )
        zeros = [
            b"" if types[f] == "char" else [0] * arrays[f] if arrays[f] else 0
            for f in kind.fieldnames
        ]
        (frame,) = codec.frames([kind(*zeros)])
        assert len(frame) == length + 8, kind.msgname
        assert names(Codec(1).decode(frame)) == [kind.msgname]
        checked += 1
    assert checked > 150


# Datagrams


@given(st.lists(st.sampled_from([heartbeat(), arm(3), text(b"x" * 50)]), max_size=120))
def test_datagrams_are_short_and_tear_no_frame(messages):
    frames = Codec(7).frames(messages)
    parts = list(datagrams(b"".join(frames)))
    assert b"".join(parts) == b"".join(frames)
    assert all(len(part) <= 1200 for part in parts)
    receiver = Codec(1)
    got = [m for part in parts for m in receiver.decode(part, stream=False)]
    assert names(got) == names(messages)
    assert len(parts) <= 1 + sum(map(len, frames)) // 900, "as few as fit"


def test_frames_of_all_kinds_share_datagrams():
    data = (signed(arm(1)) + version_1(text(b"y" * 50)) + FRAME) * 40
    parts = list(datagrams(data))
    assert b"".join(parts) == data
    receiver = Codec(1)
    assert sum(len(receiver.decode(part, stream=False)) for part in parts) == 120
    assert receiver.bad_bytes == 0


def test_what_is_no_frame_goes_as_it_is():
    for junk in (b"x" * 3000, FRAME * 60 + b"x" * 3000):
        assert b"".join(datagrams(junk)) == junk
