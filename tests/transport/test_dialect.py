"""Messages and frames are byte for byte and field for field what pymavlink makes of them."""

import copy
import pickle
import struct
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as pymavlink

from mavherd.transport.mavlink import Codec, mav

KINDS = sorted(pymavlink.mavlink_map.values(), key=lambda kind: kind.id)
INTEGERS = {
    f"{sign}int{bits}_t": (0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    for sign in ("", "u")
    for bits in (8, 16, 32, 64)
}
INF, NAN = float("inf"), float("nan")


def ours(kind):
    return getattr(mav, kind.__name__)


def tables(kind) -> list[tuple[str, str, int]]:
    """Return name, type and length of each field, in the order of the constructor."""
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    arrays = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    return [(name, types[name], arrays[name]) for name in kind.fieldnames]


def fields(kind, number, text) -> list:
    """Return a value for each field: `number(type)` makes a number, `text(length)` bytes."""
    return [
        text(array) if type_ == "char" else [number(type_)] * array if array else number(type_)
        for _, type_, array in tables(kind)
    ]


def edges(kind, end: int, real: float, text: bytes) -> list:
    """Return the least (`end` 0) or greatest (1) integers with these numbers and texts."""
    return fields(
        kind,
        lambda type_: INTEGERS[type_][end] if type_ in INTEGERS else real,
        lambda length: (text * length)[:length],
    )


EDGES = (
    (0, 0.0, b"\0"),
    (0, -0.0, b""),
    (1, INF, b"\xff"),
    (1, -INF, b"a"),
    (1, NAN, b"\0a"),
    (0, 3.4028234e38, b"a\0"),
)


def a_number(type_: str) -> st.SearchStrategy:
    low_high = INTEGERS.get(type_)
    return st.integers(*low_high) if low_high else st.floats(width=64 if type_ == "double" else 32)


def a_field(type_: str, array: int) -> st.SearchStrategy:
    if type_ == "char":
        return st.binary(max_size=array)
    number = a_number(type_)
    return st.lists(number, min_size=array, max_size=array) if array else number


def with_values(kind) -> st.SearchStrategy:
    values = st.tuples(*(a_field(type_, array) for _, type_, array in tables(kind)))
    return st.tuples(st.just(kind), values)


MESSAGES = st.sampled_from([k for k in KINDS if max(k.array_lengths) < 60]).flatmap(with_values)


def as_told(m) -> tuple:
    """Return all that a message says of itself; NaN equals NaN here."""
    said = {name: getattr(m, name) for name in m.get_fieldnames()}
    raw = {name: value for name, value in vars(m).items() if name.endswith("_raw")}
    sender = m.get_srcSystem(), m.get_srcComponent(), m.get_seq()
    return repr((m.get_type(), m.get_msgId(), sender, said, raw, m.get_signed())), str(m)


def by_pymavlink(message, *, sequence=0, version=2) -> bytes:
    end = pymavlink.MAVLink(None, srcSystem=7, srcComponent=3)
    end.seq = sequence
    return bytes(message.pack(end, force_mavlink1=version == 1))


def same_on_the_wire(kind, values) -> bytes:
    """Check every way to pack a message; return the frame."""
    expected = by_pymavlink(kind(*values))
    for message in (ours(kind)(*values), kind(*values)):
        assert Codec(7, 3).encode([message]) == expected, kind.msgname
    assert by_pymavlink(ours(kind)(*values)) == expected
    return expected


def same_when_read(frame: bytes) -> None:
    (message,) = Codec(1).decode(frame)
    expected = pymavlink.MAVLink(None).decode(bytearray(frame))
    assert as_told(message) == as_told(expected)
    assert by_pymavlink(message, sequence=9) == by_pymavlink(expected, sequence=9)
    assert message.to_dict().keys() == expected.to_dict().keys()


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.msgname)
def test_every_message_at_its_edges(kind):
    for edge in EDGES:
        values = edges(kind, *edge)
        same_when_read(same_on_the_wire(kind, values))
        assert str(ours(kind)(*values)) == str(kind(*values))


@settings(max_examples=400)
@given(MESSAGES)
def test_any_message_with_any_fields(message):
    same_when_read(same_on_the_wire(*message))


@given(MESSAGES, st.integers(0, 255))
def test_payloads_of_any_length_are_read_as_pymavlink_reads_them(message, size):
    kind, values = message
    payload = (kind(*values).pack(pymavlink.MAVLink(None, 7, 3))[10:-2] * 40)[:size]
    body = bytes((len(payload), 0, 0, 5, 7, 3)) + kind.id.to_bytes(3, "little") + payload
    checksum = pymavlink.x25crc(body + bytes((kind.crc_extra,))).crc
    same_when_read(b"\xfd" + body + checksum.to_bytes(2, "little"))


@given(MESSAGES.filter(lambda message: message[0].id < 256))
def test_mavlink_1_is_read_as_pymavlink_reads_it(message):
    kind, values = message
    same_when_read(by_pymavlink(kind(*values), version=1))


@given(MESSAGES.filter(lambda message: message[0].id < 256))
def test_mavlink_1_without_extensions_is_packed_as_pymavlink_packs_it(message):
    kind, values = message
    codec = Codec(7, 3)
    codec.version = 1
    frame, whole = codec.encode([ours(kind)(*values)]), by_pymavlink(kind(*values), version=1)
    assert frame[6:-2] == whole[6:-2][: frame[1]]
    if frame[1] == whole[1]:
        assert frame == whole
    same_when_read(frame)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.msgname)
def test_what_no_field_holds_is_refused_as_by_pymavlink(kind):
    good = fields(kind, lambda type_: 1, lambda n: b"a")
    for i, (_, type_, array) in enumerate(tables(kind)):
        wrong = [INTEGERS[type_][1] + 1, INTEGERS[type_][0] - 1, 0.5] if type_ in INTEGERS else []
        if type_ == "float":
            wrong = [1e39]
        for value in (*wrong, None):
            values = [*good[:i], [value] * array if array else value, *good[i + 1 :]]
            raised = []
            for make, pack in ((kind, by_pymavlink), (ours(kind), lambda m: Codec(7).encode([m]))):
                with pytest.raises((struct.error, OverflowError, AttributeError)) as error:
                    pack(make(*values))
                raised.append(error.type)
            assert raised[0] is raised[1]


def test_a_message_that_cannot_be_packed_takes_no_number():
    codec = Codec(7)
    with pytest.raises(struct.error):
        codec.encode([ours(KINDS[0])(*[None] * len(KINDS[0].fieldnames))])
    assert codec.encode([mav.MAVLink_heartbeat_message(2, 3, 1, 4, 3, 3)])[4] == 0


def test_short_arrays_are_refused_and_long_ones_cut():
    kind = mav.MAVLink_actuator_control_target_message
    with pytest.raises(struct.error):
        Codec(7).encode([kind(0, 0, [0.0] * 7)])
    assert Codec(7).encode([kind(0, 0, [1.0] * 9)]) == Codec(7).encode([kind(0, 0, [1.0] * 8)])


def test_arguments_have_their_names_and_extensions_their_defaults():
    given_ = mav.MAVLink_command_ack_message(400, 0, target_system=9)
    for kind in (
        ours(pymavlink.MAVLink_command_ack_message),
        pymavlink.MAVLink_command_ack_message,
    ):
        assert as_told(given_) == as_told(kind(400, 0, 0, 0, 9, 0))
    with pytest.raises(TypeError, match="result"):
        mav.MAVLink_command_ack_message(400)


def test_fields_can_be_changed_before_sending():
    message = mav.MAVLink_attitude_message(0, 1, 2, 3, 4, 5, 6)
    message.roll = 9.0
    assert Codec(1).decode(Codec(7).encode([message]))[0].roll == 9.0


def test_messages_are_of_one_class_whoever_made_them():
    sent = mav.MAVLink_heartbeat_message(2, 3, 1, 4, 3, 3)
    (heard,) = Codec(1).decode(Codec(7).encode([sent]))
    assert type(heard) is type(sent) is mav.MAVLink_heartbeat_message
    assert isinstance(heard, pymavlink.MAVLink_heartbeat_message)
    assert heard == Codec(1).decode(Codec(7).encode([sent]))[0] != sent
    for copied in (copy.deepcopy(heard), pickle.loads(pickle.dumps(heard))):
        assert as_told(copied) == as_told(heard)


INTERRUPTED = """
import contextlib
from pymavlink.dialects.v20 import ardupilotmega
from mavherd.transport import form

source = form._source
press = "import os, signal; os.kill(os.getpid(), signal.SIGINT)\\n"
form._source = lambda kind: press + source(kind)
try:
    form.make_form(ardupilotmega.MAVLink_heartbeat_message, object)
except KeyboardInterrupt:
    print("caught")
"""


def test_ctrl_c_while_a_class_is_made_is_like_any_other():
    done = subprocess.run([sys.executable, "-c", INTERRUPTED], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "caught\n", "")


def test_the_dialect_is_pymavlinks():
    assert mav.MAV_CMD_NAV_TAKEOFF is pymavlink.MAV_CMD_NAV_TAKEOFF
    assert mav.enums is pymavlink.enums
    with pytest.raises(AttributeError, match="MAV_CMD_DANCE"):
        _ = mav.MAV_CMD_DANCE
