"""Each link gets the rates its peer asked for, and nobody else's."""

from itertools import pairwise

import pytest

from mavherd.transport.mavlink import mav
from mavherd.vehicles.config import SLICE_US
from mavherd.vehicles.flight.settings import STREAM_GROUPS
from mavherd.vehicles.protocol.rates import DATA_STREAMS, DEFAULT_RATES_HZ, GROUPS, RateService
from mavherd.vehicles.protocol.streams import Streams
from mavherd.vehicles.protocol.telemetry import MESSAGES

HEARTBEAT = mav.MAVLINK_MSG_ID_HEARTBEAT
ATTITUDE = mav.MAVLINK_MSG_ID_ATTITUDE
QUATERNION = mav.MAVLINK_MSG_ID_ATTITUDE_QUATERNION
EKF = mav.MAVLINK_MSG_ID_EKF_STATUS_REPORT
ESTIMATOR = mav.MAVLINK_MSG_ID_ESTIMATOR_STATUS
UNASKED_HZ = {**DEFAULT_RATES_HZ, EKF: 1}
GROUP_OF = {message_id: name for name, ids in GROUPS.items() for message_id in ids}


@pytest.fixture
def streams_of(desk):
    """Make the streams of one link to a vehicle."""

    def make(spoken=True, channel=0, **config):
        return Streams(desk(**config).vehicle.telemetry, channel, spoken=spoken)

    return make


@pytest.fixture
def streams(streams_of):
    return streams_of()


def sent(streams: Streams, seconds: float, start_us: int = 0) -> dict[int, list[int]]:
    """Let time pass; return when (us) each message was due."""
    times: dict[int, list[int]] = {message_id: [] for message_id in MESSAGES}
    for now in range(start_us, start_us + round(seconds * 1e6), SLICE_US):
        for message_id in streams.due(now):
            times[message_id].append(now)
    return times


def request(stream_id: int, rate: int, start: int = 1):
    return mav.MAVLink_request_data_stream_message(1, 1, stream_id, rate, start)


def test_a_link_that_has_spoken_gets_the_default_rates_and_nothing_else(streams):
    times = sent(streams, 20)
    for message_id in MESSAGES:
        assert abs(len(times[message_id]) - 20 * UNASKED_HZ.get(message_id, 0)) <= 1, message_id
    assert not times[QUATERNION]


def test_the_defaults_are_those_of_the_specification():
    by_name = {mav.mavlink_map[i].msgname: hz for i, hz in UNASKED_HZ.items()}
    for hz, names in {
        1: ("HEARTBEAT", "SYS_STATUS", "EXTENDED_SYS_STATE", "EKF_STATUS_REPORT"),
        10: ("ATTITUDE", "LOCAL_POSITION_NED"),
        4: ("GLOBAL_POSITION_INT", "VFR_HUD"),
        2: ("GPS_RAW_INT",),
        0.5: ("HOME_POSITION", "BATTERY_STATUS"),
    }.items():
        assert {name: by_name[name] for name in names} == dict.fromkeys(names, hz)


def test_the_estimators_message_is_the_personalitys(streams_of):
    for stack, wanted, other in (("ardupilot", EKF, ESTIMATOR), ("px4", ESTIMATOR, EKF)):
        times = sent(streams_of(autopilot=stack), 5)
        assert len(times[wanted]) == 5
        assert not times[other]


def test_an_unspoken_link_gets_heartbeats_only_until_it_speaks(streams_of):
    streams = streams_of(spoken=False)
    times = sent(streams, 10)
    assert {m for m, at in times.items() if at} == {HEARTBEAT}
    assert len(times[HEARTBEAT]) == 10
    streams.heard(10_000_000)
    times = sent(streams, 10, 10_000_000)
    assert abs(len(times[ATTITUDE]) - 100) <= 1


@pytest.mark.parametrize("rate", [0.2, 1, 3, 7, 20, 30, 50, 99, 100])
def test_an_asked_rate_is_kept_on_the_long_run(streams, rate):
    assert streams.set_interval(ATTITUDE, 1e6 / rate, 0)
    count = len(sent(streams, 60)[ATTITUDE])
    assert abs(count - 60 * rate) <= max(1, 0.01 * 60 * rate)


@pytest.mark.parametrize("rate", [3, 7, 30])
def test_each_interval_is_right_within_a_slice(streams, rate):
    streams.set_interval(ATTITUDE, 1e6 / rate, 0)
    gaps = [b - a for a, b in pairwise(sent(streams, 10)[ATTITUDE])]
    assert all(abs(gap - 1e6 / rate) <= SLICE_US for gap in gaps)


def test_nothing_is_faster_than_a_slice(streams):
    streams.set_interval(ATTITUDE, 1, 0)
    assert streams.interval_us(ATTITUDE) == SLICE_US
    assert len(sent(streams, 1)[ATTITUDE]) == 100


@pytest.mark.parametrize("stop", [-1, -0.5, -3e38])
def test_a_negative_interval_stops_a_message(streams, stop):
    assert streams.set_interval(ATTITUDE, stop, 0)
    assert streams.interval_us(ATTITUDE) == -1
    assert sent(streams, 5)[ATTITUDE] == []


@pytest.mark.parametrize("interval", [-1, 5_000_001, 3e38])
def test_heartbeats_neither_stop_nor_become_rare(desk, interval):
    on_desk = desk()
    streams = on_desk.link.streams
    assert not streams.set_interval(HEARTBEAT, interval, 0)
    assert len(sent(streams, 10)[HEARTBEAT]) == 10
    denied = on_desk.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, HEARTBEAT, interval)
    assert denied == mav.MAV_RESULT_DENIED


def test_heartbeats_can_be_more_frequent(streams):
    assert streams.set_interval(HEARTBEAT, 200_000, 0)
    assert len(sent(streams, 2)[HEARTBEAT]) == 10


@pytest.mark.parametrize("message_id", MESSAGES)
def test_zero_restores_the_default(desk, message_id):
    telemetry = desk().vehicle.telemetry
    plain, changed = (Streams(telemetry, 0, spoken=True) for _ in range(2))
    for interval in (3_000_000, 20_000, 0):
        assert changed.set_interval(message_id, interval, 0)
    assert changed.interval_us(message_id) == plain.interval_us(message_id)
    assert sent(changed, 4) == sent(plain, 4)


def test_the_slowest_rate_is_what_the_answer_can_say(streams):
    streams.set_interval(ATTITUDE, 3e38, 0)
    assert 0 < streams.interval_us(ATTITUDE) < 2**31


def test_a_message_that_is_off_by_default_can_be_had(streams):
    assert sent(streams, 2)[QUATERNION] == []
    streams.set_interval(QUATERNION, 50_000, 2_000_000)
    assert len(sent(streams, 2, 2_000_000)[QUATERNION]) == 40


def test_asking_for_the_same_again_does_not_shift_it(streams):
    streams.set_interval(ATTITUDE, 300_000, 0)
    for at in range(0, 2_000_000, 100_000):
        streams.set_interval(ATTITUDE, 300_000, at)
        times = sent(streams, 0.1, at)[ATTITUDE]
        assert times == [t for t in range(0, 2_000_000, 300_000) if at <= t < at + 100_000]


def test_heartbeats_of_a_fleet_do_not_fall_on_one_tick(streams_of):
    first = [sent(streams_of(system_id=i), 1)[HEARTBEAT][0] for i in range(1, 101, 4)]
    assert max(first.count(at) for at in set(first)) <= 2


def test_a_pause_is_not_caught_up(streams):
    sent(streams, 1)
    after = sent(streams, 1, 60_000_000)[ATTITUDE]
    assert len(after) <= 11
    assert min(b - a for a, b in pairwise(after)) == 100_000


# Groups: parameters and REQUEST_DATA_STREAM

NOT_ARDUPILOTS = mav.MAVLINK_MSG_ID_ESTIMATOR_STATUS


def test_the_groups_are_ardupilots_and_hold_what_there_is():
    assert set(GROUPS) <= set(STREAM_GROUPS)
    named = [message_id for ids in GROUPS.values() for message_id in ids]
    assert len(named) == len(set(named))
    assert set(named) <= set(MESSAGES)
    assert HEARTBEAT not in named
    assert mav.MAVLINK_MSG_ID_RC_CHANNELS_RAW in GROUPS["RC_CHAN"], "DroneKit's vehicle.channels"


@pytest.mark.parametrize("stream_id", [s for s in DATA_STREAMS if s != mav.MAV_DATA_STREAM_ALL])
def test_a_data_stream_sets_its_group_and_no_other(streams, stream_id):
    RateService(streams).handlers["REQUEST_DATA_STREAM"](request(stream_id, 5))
    times = sent(streams, 4)
    mine = {m for name in DATA_STREAMS[stream_id] for m in GROUPS[name]} - {NOT_ARDUPILOTS}
    for message_id in MESSAGES:
        rate = 5 if message_id in mine else UNASKED_HZ.get(message_id, 0)
        assert abs(len(times[message_id]) - 4 * rate) <= 1, message_id


def test_the_data_stream_of_all_is_every_group(streams):
    RateService(streams).handlers["REQUEST_DATA_STREAM"](request(mav.MAV_DATA_STREAM_ALL, 10))
    times = sent(streams, 2)
    for message_id in MESSAGES:
        asked = message_id in GROUP_OF and message_id != NOT_ARDUPILOTS
        rate = 10 if asked else UNASKED_HZ.get(message_id, 0)
        assert abs(len(times[message_id]) - 2 * rate) <= 1, message_id


@pytest.mark.parametrize(("rate", "start"), [(0, 1), (10, 0)])
def test_a_data_stream_can_be_stopped(streams, rate, start):
    RateService(streams).handlers["REQUEST_DATA_STREAM"](request(0, rate, start))
    times = sent(streams, 4)
    assert not any(times[message_id] for message_id in GROUP_OF)
    assert len(times[HEARTBEAT]) == 4


@pytest.mark.parametrize(("stream_id", "start"), [(99, 1), (255, 1), (0, 7)])
def test_a_data_stream_that_nobody_knows_changes_nothing(streams, stream_id, start):
    before = sent(streams, 2)
    RateService(streams).handlers["REQUEST_DATA_STREAM"](request(stream_id, 50, start))
    after = sent(streams, 2, 2_000_000)
    assert {m: len(at) for m, at in after.items()} == {m: len(at) for m, at in before.items()}


def test_a_request_that_is_repeated_keeps_the_rate(streams):
    service, count = RateService(streams), 0
    for at in range(0, 10_000_000, 70_000):  # as clients do that ask at every heartbeat
        streams._telemetry.now_us = at
        service.handlers["REQUEST_DATA_STREAM"](request(0, 4))
        count += len(sent(streams, 0.07, at)[ATTITUDE])
    assert abs(count - 40) <= 1


def test_a_links_rates_are_its_own(desk):
    vehicle = desk()
    other = vehicle.vehicle.converse(spoken=True)
    vehicle.send(request(mav.MAV_DATA_STREAM_EXTRA1, 50))
    assert vehicle.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, QUATERNION, 20_000) == 0
    mine, theirs = sent(vehicle.link.streams, 2), sent(other.streams, 2)
    assert len(mine[ATTITUDE]) == len(mine[QUATERNION]) == 100
    assert len(theirs[ATTITUDE]) == 20
    assert not theirs[QUATERNION]


def test_a_parameter_sets_a_group_within_a_second(streams):
    sent(streams, 1)
    rates = streams._telemetry.autopilot.settings.stream_rates[0]
    rates["EXTRA1"] = 40.0
    sent(streams, 1.5, 1_000_000)
    times = sent(streams, 1, 2_500_000)
    assert len(times[ATTITUDE]) == len(times[mav.MAVLINK_MSG_ID_SIMSTATE]) == 40
    rates["EXTRA1"] = -1.0
    sent(streams, 1.5, 3_500_000)
    assert not sent(streams, 1, 5_000_000)[ATTITUDE]
    rates["EXTRA1"] = 0.0
    sent(streams, 1.5, 6_000_000)
    assert len(sent(streams, 1, 7_500_000)[ATTITUDE]) == 10


def test_a_parameter_leaves_alone_what_the_peer_has_asked_for(streams):
    streams.set_interval(ATTITUDE, 500_000, 0)
    streams._telemetry.autopilot.settings.stream_rates[0]["EXTRA1"] = 40.0
    assert len(sent(streams, 4)[ATTITUDE]) == 8
    assert streams.set_interval(ATTITUDE, 0, 4_000_000)  # the default is the parameter's now
    assert len(sent(streams, 4, 4_000_000)[ATTITUDE]) == 160


@pytest.mark.parametrize(
    ("channel", "counts"), [(None, False), (0, False), (1, True), (3, False), (9, False)]
)
def test_each_channel_has_its_own_parameters(streams_of, channel, counts):
    streams = streams_of(channel=channel)
    streams._telemetry.autopilot.settings.stream_rates[1]["EXTRA2"] = 20.0
    sent(streams, 2)
    assert len(sent(streams, 1, 2_000_000)[mav.MAVLINK_MSG_ID_VFR_HUD]) == (20 if counts else 4)


def test_rates_over_the_wire_are_right_within_ten_percent(desk):
    vehicle = desk()
    for message_id, rate in ((ATTITUDE, 30), (QUATERNION, 7)):
        assert vehicle.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 1e6 / rate) == 0
    got = [m.get_type() for m in vehicle.run(4)]
    assert got.count("ATTITUDE") == pytest.approx(120, rel=0.1)
    assert got.count("ATTITUDE_QUATERNION") == pytest.approx(28, rel=0.1)
    (_, answer) = vehicle.ask(mav.MAV_CMD_GET_MESSAGE_INTERVAL, ATTITUDE)
    assert (answer.message_id, answer.interval_us) == (ATTITUDE, 33_333)
