"""An external vehicle is asked for all it must tell, and not flown before it is known."""

from math import hypot

import pytest

from mavherd.gcs.station import RETRY_S, TRIES, Station, stack_of
from mavherd.transport.frames import Origin
from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.flight.modes import Mode

SET_INTERVAL, REQUEST_MESSAGE = 511, 512
FLEET = Origin()


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_its_frame_is_brought_into_the_fleets(make_pair, kind, autopilot):
    pair = make_pair(kind, autopilot, external=True)
    pair.until(lambda: pair.status.position_at > 0, 5)
    pair.run(1)
    local = pair.vehicle.robot.kinematics()
    assert hypot(local.north, local.east) > 10  # its own frame is another one
    assert pair.status.position == pytest.approx((0, 0, 0), abs=0.05)
    assert pair.station.problem == pair.station.waits_for == ""


def test_targets_are_in_the_fleets_frame(make_pair):
    pair = make_pair(external=True)
    pair.until(lambda: pair.status.position_at > 0)
    for ask in (
        lambda: pair.station.set_mode(Mode.GUIDED, pair.now),
        lambda: pair.station.arm(pair.now),
        lambda: pair.station.take_off(2, pair.now),
    ):
        request = ask()
        pair.run(0.2)
        assert request.accepted
    pair.run(5)
    pair.station.send_target(pair.now, position=(3.0, 1.0, -2.5))
    pair.run(8)
    assert pair.status.position == pytest.approx((3, 1, -2.5), abs=0.2)
    k, (lat_deg, lon_deg, _) = pair.vehicle.robot.kinematics(), pair.status.global_position
    assert FLEET.from_geodetic(lat_deg, lon_deg) == pytest.approx((3, 1), abs=0.2)
    assert k.north == pytest.approx(3 - 10, abs=0.2)


def test_the_height_is_that_above_the_ground_it_stood_on(make_pair):
    pair = make_pair("quadcopter", "px4", external=True)
    pair.until(lambda: pair.status.position_at > 0)
    pair.station.arm(pair.now)
    pair.run(0.2)
    pair.station.take_off(4, pair.now)
    pair.run(8)
    ground = 12.0 - 3.0  # down in its own frame
    height = ground - pair.vehicle.robot.kinematics().down
    assert height > 3
    assert -pair.status.position[2] == pytest.approx(height, abs=0.05)


def test_nothing_is_sent_to_be_followed_before_the_frame_is_known(make_pair):
    pair = make_pair(external=True)
    pair.drop = frozenset(("GPS_GLOBAL_ORIGIN",))
    pair.each_tick = lambda: pair.station.send_target(pair.now, velocity=(1.0, 0.0, 0.0))
    pair.run(5)
    assert pair.status.position_at < 0
    assert "origin" in pair.station.waits_for
    assert not [m for _, m in pair.sent if "POSITION_TARGET" in m.get_type()]
    pair.drop = frozenset()
    pair.until(lambda: pair.status.position_at > 0, 3)
    pair.run(0.1)
    assert [m for _, m in pair.sent if "POSITION_TARGET" in m.get_type()]


def test_what_is_told_is_in_the_status(make_pair):
    pair = make_pair(external=True)
    pair.run(4)
    s = pair.status
    assert (s.mav_type, s.autopilot) == (mav.MAV_TYPE_QUADROTOR, mav.MAV_AUTOPILOT_ARDUPILOTMEGA)
    assert s.gps_fix >= 3
    assert s.satellites > 3
    assert 0.9 < s.battery_remaining <= 1
    assert 10 < s.battery_v < 17
    assert s.prearm_ok is True
    assert s.home[:2] == pytest.approx((FLEET.lat_deg, FLEET.lon_deg), abs=1e-6)
    assert s.version == (4, 6, 3)
    assert s.boot_s == pytest.approx(pair.now, abs=0.2)


# Asking


def test_one_request_of_a_kind_is_under_way_at_a_time(make_pair):
    pair = make_pair(external=True)
    pair.run(0.1)
    pair.mute = True
    pair.run(RETRY_S - 0.1)
    asked = {int(m.param1) for m in pair.commands(SET_INTERVAL)[-2:]}
    assert len(pair.commands(SET_INTERVAL)) <= 3
    assert len(asked) <= 2
    pair.mute = False
    pair.run(3)
    wanted = {int(m.param1) for m in pair.commands(SET_INTERVAL)}
    assert {30, 32, 33, 24, 1, 147, 245, 42} == wanted


def test_what_comes_is_not_asked_for_again(make_pair):
    pair = make_pair(external=True)
    pair.run(3)
    pair.sent.clear()
    pair.run(30)
    assert not pair.commands(SET_INTERVAL)
    assert 1 <= len(pair.commands(REQUEST_MESSAGE)) <= 5


def test_a_stream_that_stops_is_asked_for_again(make_pair):
    pair = make_pair(external=True)
    pair.run(3)
    pair.link.streams.set_interval(mav.MAVLINK_MSG_ID_ATTITUDE, -1, pair.vehicle.now_us)
    pair.sent.clear()
    pair.run(12)
    assert {int(m.param1) for m in pair.commands(SET_INTERVAL)} == {mav.MAVLINK_MSG_ID_ATTITUDE}
    pair.sent.clear()
    pair.run(12)
    assert not pair.commands(SET_INTERVAL)


def test_a_stream_that_another_station_has_slowed_down_is_asked_for_again(make_pair):
    pair = make_pair(external=True)
    pair.run(3)
    position = mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED
    pair.link.streams.set_interval(position, 1e6, pair.vehicle.now_us)
    pair.run(12)
    assert pair.link.streams.interval_us(position) == 1e6 / 20


def test_a_vehicle_that_refuses_intervals_is_asked_the_older_way():
    station = Station("q", 5, 20, origin=FLEET)
    vehicle = Codec(5)
    station.receive(vehicle.encode([mav.MAVLink_heartbeat_message(2, 3, 1, 0, 3, 3)]), 0.0)
    groups = set()
    for tick in range(40):
        now = tick * 0.05
        for m in Codec(5).decode(station.transmit(now)):
            if m.get_type() == "REQUEST_DATA_STREAM":
                groups.add(m.req_stream_id)
            elif m.get_type() == "COMMAND_LONG":
                no = mav.MAVLink_command_ack_message(m.command, mav.MAV_RESULT_UNSUPPORTED)
                station.receive(vehicle.encode([no]), now)
    assert groups == {
        mav.MAV_DATA_STREAM_POSITION,
        mav.MAV_DATA_STREAM_EXTRA1,
        mav.MAV_DATA_STREAM_EXTENDED_STATUS,
    }


def test_a_silent_vehicle_is_asked_nothing(make_pair):
    pair = make_pair(external=True)
    pair.run(3)
    pair.mute = pair.deaf = True
    pair.run(3 + RETRY_S * (TRIES + 1))  # what was under way runs out
    pair.sent.clear()
    pair.run(20)
    assert {m.get_type() for _, m in pair.sent} == {"HEARTBEAT"}


def test_a_reboot_begins_it_all_again(make_pair):
    pair = make_pair(external=True)
    pair.run(4)
    pair.sent.clear()
    pair.station.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, (1.0,), "reboot", pair.now)
    pair.until(lambda: pair.status.boots == 1, 5)
    s = pair.status
    assert s.position_at < 0
    assert {s.gps_fix, s.sensors, s.prearm_ok, s.landed, s.battery_remaining, s.origin} == {None}
    assert s.boot_s < 2
    pair.until(lambda: pair.status.position_at > 0, 8)
    pair.run(1)
    assert len({int(m.param1) for m in pair.commands(SET_INTERVAL)}) == 8
    assert pair.status.position == pytest.approx((0, 0, 0), abs=0.05)


# Who it is


@pytest.mark.parametrize(
    ("kind", "autopilot", "mav_type", "said", "text"),
    [
        ("rover", "ardupilot", 2, 3, "it says that it is a quadrotor, not a rover"),
        ("quadcopter", "ardupilot", 10, 3, "a ground rover, not a quadcopter"),
        ("quadcopter", "ardupilot", 2, 12, "its flight stack is px4, not ardupilot"),
        ("quadcopter", "px4", 2, 3, "its flight stack is ardupilot, not px4"),
        ("quadcopter", "auto", 2, 4, "is neither ArduPilot nor PX4"),
        ("quadcopter", "ardupilot", 1, 3, "a fixed wing, not a quadcopter"),
    ],
)
def test_the_wrong_vehicle_is_a_problem(kind, autopilot, mav_type, said, text):
    station = Station("q", 5, 20, kind=kind, stack=stack_of(autopilot), origin=FLEET)
    station.receive(
        Codec(5).encode([mav.MAVLink_heartbeat_message(mav_type, said, 1, 0, 3, 3)]), 1.0
    )
    assert station.problem.startswith("q: ")
    assert text in station.problem
    (hello,) = Codec(5).decode(station.transmit(1.0))  # it is left alone
    assert hello.get_type() == "HEARTBEAT"


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_an_unnamed_flight_stack_is_learnt(make_pair, autopilot):
    pair = make_pair("quadcopter", autopilot, external=True, auto=True)
    pair.run(1)
    assert pair.station.stack.name == autopilot
    request = pair.station.set_mode(Mode.HOLD, pair.now)
    pair.run(0.2)
    assert request.accepted
    question = pair.station.parameters.read("SYSID_THISMAV", pair.now)
    pair.until(lambda: question.done, 5)
    assert question.accepted == (autopilot == "ardupilot")


def test_another_part_of_the_system_is_not_the_vehicle(make_pair):
    pair = make_pair(external=True)
    pair.run(1)
    gimbal = mav.MAVLink_heartbeat_message(mav.MAV_TYPE_GIMBAL, 8, 0, 0, 3, 3)
    pair.hear(gimbal, component=mav.MAV_COMP_ID_GIMBAL)
    pair.hear(gimbal)  # some claim to be the autopilot
    assert pair.station.problem == ""
    assert pair.status.mav_type == mav.MAV_TYPE_QUADROTOR


def test_answers_to_other_stations_are_not_ours(make_pair):
    pair = make_pair(external=True)
    pair.run(2)
    request = pair.station.arm(pair.now)
    pair.hear(mav.MAVLink_command_ack_message(400, 4, target_system=255, target_component=190))
    assert not request.done
    pair.hear(mav.MAVLink_command_ack_message(400, 0, target_system=254, target_component=190))
    assert request.accepted


def test_a_long_text_is_put_together(make_pair):
    pair = make_pair(external=True)
    pair.run(1)
    pair.station.new_texts()
    first = b"Arming denied: Resolve system health failures fir"
    pair.hear(mav.MAVLink_statustext_message(2, first + b"s", 7, 0))
    assert pair.station.new_texts() == []
    pair.hear(mav.MAVLink_statustext_message(2, b"t\t", 7, 1))
    ((_, severity, text),) = pair.station.new_texts()
    assert (severity, text) == (2, "Arming denied: Resolve system health failures first")


PREARM = mav.MAV_SYS_STATUS_PREARM_CHECK
OFFBOARD, HOLD = 6 << 16, 4 << 16 | 3 << 24


@pytest.mark.parametrize(
    ("autopilot", "custom_mode", "enabled", "healthy", "ok"),
    [
        (3, 4, PREARM, PREARM, True),
        (3, 4, PREARM, 0, False),
        (3, 4, 0, 0, None),  # it checks nothing
        (12, HOLD, 0, PREARM, True),
        (12, HOLD, 0, 0, False),
        (12, OFFBOARD, 0, PREARM, True),
        (12, OFFBOARD, 0, 0, None),  # it has no set-points, as none were sent
    ],
)
def test_whether_it_may_arm_is_told_in_two_ways(autopilot, custom_mode, enabled, healthy, ok):
    station = Station("q", 5, 20, stack=None, origin=FLEET)
    status = (PREARM if autopilot == 3 else 0, enabled, healthy)
    said = [
        mav.MAVLink_heartbeat_message(2, autopilot, 1, custom_mode, 3, 3),
        mav.MAVLink_sys_status_message(*status, *[0] * 10),
    ]
    station.receive(Codec(5).encode(said), 1.0)
    assert station.status.prearm_ok is ok
