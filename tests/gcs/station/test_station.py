"""A station asks until it is answered, and repeats what the vehicle said when it is refused."""

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.gcs.station import (
    COMPONENT_ID,
    RETRY_S,
    SYSTEM_ID,
    TRIES,
    Station,
    VehicleStatus,
)
from mavherd.transport.frames import quaternion_from_euler
from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.flight.modes import Mode
from mavherd.vehicles.vehicle import Vehicle

RATE_HZ = 20.0


class Pair:
    """A station and its vehicle, tick by tick; `deaf` and `mute` break either direction."""

    def __init__(self, kind="quadcopter", **config):
        self.vehicle = Vehicle(VehicleConfig(kind=kind, system_id=5, **config))
        self.link = self.vehicle.converse()
        self.frames = []
        self.station = Station("q", 5, RATE_HZ, lambda frame, now: self.frames.append(frame))
        self.now = 0.0
        self.deaf = self.mute = False
        self.sent = []

    @property
    def status(self):
        return self.station.status

    def run(self, seconds):
        for _ in range(round(seconds * RATE_HZ)):
            out = self.station.transmit(self.now)
            self.sent.append(out)
            data = self.vehicle.handle(out, self.link) if not self.deaf else b""
            for _ in range(5):
                self.vehicle.step()
                data += self.vehicle.report(self.link, self.vehicle.take_broadcasts())
            self.now = self.vehicle.now_us * 1e-6
            if not self.mute:
                self.station.receive(data, self.now)

    def received(self, name):
        """What the station has sent of one message, as the vehicle would read it."""
        messages = [m for out in self.sent for m in Codec(5).decode(out)]
        return [m for m in messages if m.get_type() == name]


@pytest.fixture
def pair():
    it = Pair()
    it.run(1)
    return it


def ack(command, result, system=5):
    return Codec(system).encode([mav.MAVLink_command_ack_message(command, result)])


# What it hears


def test_it_asks_for_the_streams_it_needs_once_it_hears_the_vehicle(pair):
    pair.frames.clear()
    pair.run(5)
    names = [Codec(1).decode(frame)[0].get_type() for frame in pair.frames]
    assert names.count("LOCAL_POSITION_NED") == pytest.approx(5 * RATE_HZ, rel=0.05)
    assert names.count("ATTITUDE") == pytest.approx(5 * RATE_HZ / 2, rel=0.05)
    assert names.count("HEARTBEAT") == pytest.approx(10, abs=2)  # of both
    for unwanted in ("GLOBAL_POSITION_INT", "GPS_RAW_INT", "POSITION_TARGET_LOCAL_NED", "VFR_HUD"):
        assert unwanted not in names
    assert "SYS_STATUS" in names


def test_it_asks_nothing_before_it_hears_the_vehicle():
    silent = Station("q", 5, RATE_HZ)
    (hello,) = Codec(1).decode(silent.transmit(0.0))
    assert (hello.get_type(), hello.type) == ("HEARTBEAT", mav.MAV_TYPE_GCS)
    assert (hello.get_srcSystem(), hello.get_srcComponent()) == (SYSTEM_ID, COMPONENT_ID)
    assert silent.transmit(0.5) == b""
    assert silent.status.position_at < 0


def test_the_status_is_what_the_vehicle_says():
    there = Pair("rover", north=7.0, east=-3.0, yaw=1.0)
    there.run(1)
    status = there.status
    assert status.position == pytest.approx((7, -3, 0))
    assert status.yaw == pytest.approx(1.0)
    assert status.quaternion == pytest.approx(quaternion_from_euler(0, 0, 1.0), abs=1e-6)
    assert not status.armed
    there.station.arm(there.now)
    there.run(0.1)
    assert status.armed
    assert there.now - status.position_at <= 0.051


def test_other_systems_are_not_heard(pair):
    before = pair.status.position_at
    stranger = Codec(6).encode([mav.MAVLink_local_position_ned_message(0, 99, 0, 0, 0, 0, 0)])
    pair.station.receive(stranger, 50.0)
    assert pair.status.position_at == before


def test_texts_are_handed_out_once(pair):
    pair.station.command(mav.MAV_CMD_DO_SET_MODE, (1, 99), "mode 99", pair.now)
    pair.run(0.2)
    ((at, severity, text),) = pair.station.new_texts()
    assert text == "No such mode 99"
    assert severity == mav.MAV_SEVERITY_WARNING
    assert 1.0 < at < 1.3
    assert pair.station.new_texts() == []


def test_the_tap_sees_every_byte_of_both_directions(pair):
    tapped = Station("q", 5, RATE_HZ, lambda frame, now: seen.append(frame))
    seen = []
    out = tapped.transmit(0.0)
    telemetry = pair.vehicle.converse(spoken=True).codec.encode(
        [pair.vehicle.telemetry.make(i) for i in (0, 30, 32)]
    )
    tapped.receive(telemetry, 0.1)
    assert b"".join(seen) == out + telemetry


@given(st.binary(max_size=300))
def test_random_bytes_from_a_vehicle_do_no_harm(data):
    station = Station("q", 5, RATE_HZ)
    station.receive(data, 1.0)
    assert station.status == VehicleStatus()
    assert station.transmit(1.0)


# What it asks


def test_an_accepted_request_is_asked_once(pair):
    pair.sent.clear()
    request = pair.station.arm(pair.now)
    assert request.result is None
    assert not request.accepted
    assert not request.refused
    pair.run(3)
    assert request.accepted
    assert len([m for m in pair.received("COMMAND_LONG") if m.command == 400]) == 1


def test_a_refusal_repeats_what_the_vehicle_says(pair):
    pair.station.set_mode(Mode.RTL, pair.now)
    pair.run(0.2)
    request = pair.station.arm(pair.now)
    pair.run(0.2)
    assert request.refused
    assert not request.accepted
    assert request.error == (
        "q: arming refused (FAILED): the vehicle says 'Arm: RTL mode not armable'"
    )


def test_a_refusal_without_a_reason_says_at_least_what_and_how(pair):
    request = pair.station.take_off(3, pair.now)
    pair.run(0.2)
    assert request.error == "q: takeoff refused (FAILED)"


@pytest.mark.parametrize(("result", "word"), [(2, "DENIED"), (3, "UNSUPPORTED"), (77, "result 77")])
def test_every_refusal_is_named(pair, result, word):
    request = pair.station.arm(pair.now)
    pair.station.receive(ack(400, result), pair.now)
    assert request.refused
    assert f"({word})" in request.error


def test_no_answer_is_five_tries_and_then_an_error(pair):
    pair.deaf = True
    pair.sent.clear()
    request = pair.station.arm(pair.now)
    pair.run(RETRY_S * TRIES - 0.1)
    assert not request.refused
    asked = [m for m in pair.received("COMMAND_LONG") if m.command == 400]
    assert [m.confirmation for m in asked] == list(range(TRIES))
    pair.run(RETRY_S)
    assert request.error.startswith("q: no answer to arming after 5 tries")
    pair.run(5)
    assert len([m for m in pair.received("COMMAND_LONG") if m.command == 400]) == TRIES


def test_a_lost_command_is_repeated_until_it_is_heard(pair):
    pair.deaf = True
    request = pair.station.arm(pair.now)
    pair.run(1.2)
    pair.deaf = False
    pair.run(0.6)
    assert request.accepted
    assert pair.status.armed


def test_a_lost_answer_does_no_harm(pair):
    pair.mute = True
    request = pair.station.arm(pair.now)
    pair.run(0.7)
    pair.mute = False
    pair.run(0.6)
    assert request.accepted


def test_in_progress_is_not_an_answer(pair):
    request = pair.station.arm(pair.now)
    pair.station.receive(ack(400, mav.MAV_RESULT_IN_PROGRESS), pair.now)
    assert request.result is None
    pair.station.receive(ack(400, 0), pair.now)
    assert request.accepted


def test_answers_of_others_and_to_other_commands_are_not_ours(pair):
    request = pair.station.arm(pair.now)
    pair.station.receive(ack(400, 0, system=6), pair.now)
    pair.station.receive(ack(22, 0), pair.now)
    assert request.result is None


def test_a_flight_by_station_alone(pair):
    for ask in (
        lambda: pair.station.set_mode(Mode.GUIDED, pair.now),
        lambda: pair.station.arm(pair.now),
        lambda: pair.station.take_off(2, pair.now),
    ):
        request = ask()
        pair.run(0.2)
        assert request.accepted
    pair.run(6)
    assert pair.status.position == pytest.approx((0, 0, -2), abs=0.15)
    for _ in range(30):
        pair.station.send_target(pair.now, position=(2.0, 1.0, -2.5), yaw=pi / 2)
        pair.run(0.2)
    assert pair.status.position == pytest.approx((2, 1, -2.5), abs=0.2)
    assert pair.status.yaw == pytest.approx(pi / 2, abs=0.05)
    assert pair.station.land(pair.now)
    pair.run(8)
    assert not pair.status.armed
    assert pair.status.position[2] == 0
    assert pair.station.codec.lost == pair.link.codec.lost == 0


PARTS = {
    "position": (0x007, (1.0, 2.0, 3.0)),
    "velocity": (0x038, (4.0, 5.0, 6.0)),
    "acceleration": (0x1C0, (7.0, 8.0, 9.0)),
    "yaw": (0x400, 0.0),
    "yaw_rate": (0x800, 0.0),
}


@given(st.sets(st.sampled_from(sorted(PARTS))))
def test_a_target_gives_what_it_is_given_and_ignores_the_rest(names):
    station = Station("q", 5, RATE_HZ)
    station.send_target(1.0, **{name: PARTS[name][1] for name in names})
    (m,) = (m for m in Codec(1).decode(station.transmit(0.0)) if "POSITION_TARGET" in m.get_type())
    assert m.type_mask == sum(bits for name, (bits, _) in PARTS.items() if name not in names)
    assert (m.target_system, m.target_component, m.coordinate_frame) == (5, 1, 1)
    if "velocity" in names:
        assert (m.vx, m.vy, m.vz) == (4, 5, 6)


def test_a_newer_command_takes_the_place_of_an_older_one(pair):
    arming = pair.station.arm(pair.now)
    disarming = pair.station.disarm(pair.now)
    assert arming.error == "q: overtaken by disarming"
    pair.run(1)
    assert disarming.accepted
    assert not pair.status.armed


def test_requests_for_messages_wait_for_one_another(pair):
    heard = []
    pair.station.listen(lambda m, now: heard.append(m.get_type()))
    ids = (mav.MAVLINK_MSG_ID_HOME_POSITION, mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    command = mav.MAV_CMD_REQUEST_MESSAGE
    asked = [pair.station.command(command, (i,), f"message {i}", pair.now) for i in ids]
    pair.run(0.5)
    assert all(request.accepted for request in asked)
    assert {"HOME_POSITION", "AUTOPILOT_VERSION"} <= set(heard)


def test_a_vehicle_in_progress_is_given_more_time(pair):
    pair.deaf = True
    request = pair.station.arm(pair.now)
    pair.run(0.1)
    pair.station.receive(ack(400, mav.MAV_RESULT_IN_PROGRESS), pair.now)
    pair.sent.clear()
    pair.run(4)
    assert not pair.received("COMMAND_LONG")
    assert not request.done


def test_a_body_target_is_forward_and_right():
    station = Station("q", 5, RATE_HZ)
    station.send_target(1.0, velocity=(1.0, 0.0, 0.0), yaw_rate=0.2, body=True)
    (m,) = (m for m in Codec(1).decode(station.transmit(0.0)) if "POSITION_TARGET" in m.get_type())
    assert m.coordinate_frame == mav.MAV_FRAME_BODY_NED
