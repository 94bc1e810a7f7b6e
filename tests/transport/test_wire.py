"""What goes onto the bus comes off it unchanged, and nothing else does."""

import struct
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.transport.wire import (
    NAME_BYTES,
    SCHEMA,
    Phase,
    Snapshot,
    Target,
    VehicleState,
    WireError,
    pack_snapshot,
    pack_state,
    pack_target,
    pack_team,
    unpack_snapshot,
    unpack_state,
    unpack_target,
    unpack_team,
)

NAMES = st.text("abcXYZ019-_", min_size=1, max_size=NAME_BYTES)
REAL = st.floats(allow_nan=False, allow_infinity=False)
THREE = st.tuples(REAL, REAL, REAL)
STATES = st.builds(
    VehicleState,
    NAMES,
    st.integers(1, 255),
    st.integers(0, 2**32 - 1),
    REAL,
    THREE,
    THREE,
    st.tuples(REAL, REAL, REAL, REAL),
    st.integers(0, 2**32 - 1),
    st.booleans(),
    st.sampled_from(Phase),
)
TARGETS = st.builds(Target, NAMES, REAL, THREE, THREE, THREE, THREE)
STATE = VehicleState("quad1", 3, 7, 1.25, (1, 2, 3), (4, 5, 6), (1, 0, 0, 0), 4, True, Phase.ACTIVE)
TARGET = Target("quad1", 1.25, (1, 2, 3), (4, 5, 6), (7, 8, 9), (10, 11, 12))


@given(STATES)
def test_a_state_survives_the_trip(state):
    assert unpack_state(pack_state(state)) == state


@given(TARGETS)
def test_a_target_survives_the_trip(target):
    assert unpack_target(pack_target(target)) == target


@given(st.lists(STATES, max_size=5), st.integers(0, 2**32 - 1))
def test_a_team_survives_the_trip(states, tick):
    assert unpack_team(pack_team(tick, states)) == (tick, states)


@given(st.lists(STATES, max_size=4), st.lists(TARGETS, max_size=4), st.integers(0, 2**32 - 1), REAL)
def test_a_snapshot_survives_the_trip(states, targets, tick, now):
    packed = pack_snapshot(tick, now, states, targets)
    assert unpack_snapshot(packed) == Snapshot(tick, now, states, targets)


def test_every_state_has_the_same_size():
    longest = STATE._replace(name="n" * NAME_BYTES, sequence=2**32 - 1)
    assert len(pack_state(longest)) == len(pack_state(STATE))


@pytest.mark.parametrize("unpack", [unpack_state, unpack_target, unpack_team, unpack_snapshot])
@given(data=st.binary(max_size=300))
def test_random_bytes_are_a_wire_error_or_a_value(unpack, data):
    with suppress(WireError):  # and nothing else
        unpack(data)


@pytest.mark.parametrize(
    ("unpack", "good"),
    [
        (unpack_state, pack_state(STATE)),
        (unpack_target, pack_target(TARGET)),
        (unpack_team, pack_team(1, [STATE] * 2)),
        (unpack_snapshot, pack_snapshot(1, 0.05, [STATE] * 2, [TARGET])),
    ],
    ids=["state", "target", "team", "snapshot"],
)
def test_wrong_sizes_and_schemas_are_refused(unpack, good):
    unpack(good)
    for wrong in (b"", good[:-1], good + b"\0"):
        with pytest.raises(WireError, match="bytes"):
            unpack(wrong)
    with pytest.raises(WireError, match=f"schema {SCHEMA + 1}"):
        unpack(struct.pack("<H", SCHEMA + 1) + good[2:])


def test_a_phase_or_a_name_that_cannot_be_is_refused():
    good = pack_state(STATE)
    at = good.index(b"quad1")
    with pytest.raises(WireError, match="99"):
        unpack_state(good[: at + NAME_BYTES] + b"\x63" + good[at + NAME_BYTES + 1 :])
    with pytest.raises(WireError, match="state"):
        unpack_state(good[:at] + b"\xff" + good[at + 1 :])
    target = pack_target(TARGET)
    with pytest.raises(WireError, match="target"):
        unpack_target(target.replace(b"quad1", b"\xffuad1"))


def test_one_bad_state_spoils_the_team():
    bad = b"\x09" + pack_state(STATE)[1:]
    with pytest.raises(WireError):
        unpack_team(pack_team(1, [STATE, STATE])[: -len(bad)] + bad)


@pytest.mark.parametrize("after", [pack_state(STATE) + pack_target(TARGET), pack_target(TARGET)])
def test_one_bad_part_spoils_the_snapshot(after):
    good = pack_snapshot(1, 0.05, [STATE], [TARGET])
    at = good.index(after)
    with pytest.raises(WireError, match="schema 9"):
        unpack_snapshot(good[:at] + b"\x09" + good[at + 1 :])
