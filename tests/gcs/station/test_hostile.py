"""Whatever a vehicle says, its station lives on, and no nonsense becomes a place."""

from math import inf, isfinite, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.gcs.station import Station
from mavherd.transport.frames import Origin
from mavherd.transport.mavlink import Codec, mav

floats = st.floats(width=32) | st.sampled_from([nan, inf, -inf, 3e38])
int32 = st.integers(-(2**31), 2**31 - 1)
uint32, uint16, uint8 = (st.integers(0, 2**bits - 1) for bits in (32, 16, 8))
messages = st.one_of(
    st.builds(mav.MAVLink_heartbeat_message, uint8, uint8, uint8, uint32, uint8, uint8),
    st.builds(mav.MAVLink_local_position_ned_message, uint32, *[floats] * 6),
    st.builds(mav.MAVLink_attitude_message, uint32, *[floats] * 6),
    st.builds(
        mav.MAVLink_global_position_int_message,
        *(uint32, int32, int32, int32, int32),
        *[st.integers(-32768, 32767)] * 3,
        uint16,
    ),
    st.builds(mav.MAVLink_gps_global_origin_message, int32, int32, int32),
    st.builds(mav.MAVLink_command_ack_message, uint16, uint8),
    st.builds(mav.MAVLink_statustext_message, uint8, st.binary(max_size=50), uint16, uint8),
    st.builds(
        mav.MAVLink_param_value_message, st.binary(max_size=16), floats, *[uint8, uint16, uint16]
    ),
    st.builds(mav.MAVLink_mission_request_int_message, uint8, uint8, uint16, uint8),
    st.builds(mav.MAVLink_mission_ack_message, uint8, uint8, uint8, uint8),
    st.builds(mav.MAVLink_mission_current_message, uint16),
    st.builds(mav.MAVLink_extended_sys_state_message, uint8, uint8),
)


@given(st.lists(messages, max_size=30), st.sampled_from(["quadcopter", "rover"]))
def test_no_message_does_harm(said, kind):
    station = Station("q", 5, 20, kind=kind, stack=None, origin=Origin())
    station.receive(Codec(5).encode([mav.MAVLink_heartbeat_message(2, 3, 1, 0, 3, 3)]), 0.0)
    station.parameters.read("", 0.0)
    station.missions.upload((), 0.0)
    for tick, message in enumerate(said):
        station.receive(Codec(5).encode([message]), tick * 0.1)
        Codec(5).decode(station.transmit(tick * 0.1))
    assert isinstance(station.problem, str)
    assert isinstance(station.waits_for, str)
    assert all(map(isfinite, (*station.status.position, *station.status.quaternion)))


@pytest.mark.parametrize("axis", range(6))
def test_a_position_that_is_none_is_not_taken(make_pair, axis):
    pair = make_pair(external=True)
    pair.until(lambda: pair.status.position_at > 0)
    before, at = pair.status.position, pair.status.position_at
    values = [0.0] * 6
    values[axis] = nan
    pair.now += 1.0
    pair.hear(mav.MAVLink_local_position_ned_message(10**6, *values))
    assert (pair.status.position, pair.status.position_at) == (before, at)
    assert pair.station.waits_for == ""


def test_a_text_gives_a_terminal_no_orders():
    station = Station("q", 5, 20)
    text = b"\x1b[2J\x1b]0;owned\x07 PreArm:\tno\r\n"
    station.receive(Codec(5).encode([mav.MAVLink_statustext_message(2, text)]), 0.0)
    assert station.new_texts() == [(0.0, 2, "[2J ]0;owned  PreArm: no")]
