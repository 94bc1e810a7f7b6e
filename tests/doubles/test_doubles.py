"""Each double does what it says, seen by pymavlink on the raw link."""

import os
import socket
import time
from contextlib import ExitStack
from math import cos, hypot, pi

import pytest
from manners import Manners
from vehicle_double import HOME, HOST, vehicle_double

os.environ["MAVLINK20"] = "1"
from pymavlink import mavutil

mav = mavutil.mavlink
PATIENCE = 60.0
ARMED = mav.MAV_MODE_FLAG_SAFETY_ARMED
POSITION_ONLY, POSITION_AND_VELOCITY, VELOCITY = 0xDF8, 0xDC0, 0xDC7


class Clock:
    """The time by which a double has manners: it passes when a test says so."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


def call(address):
    return mavutil.mavlink_connection(address, source_system=254, retries=10)


class Ground:
    """A ground station made of pymavlink."""

    def __init__(self, double, clock, link):
        self.double = double
        self.clock = clock
        self.link = link
        self.seen = []
        self.beat_at = 0.0
        self.turn()

    def turn(self):
        """Send a heartbeat when one is due; return the next message, if any."""
        if time.monotonic() >= self.beat_at:
            self.beat_at = time.monotonic() + 1
            self.link.mav.heartbeat_send(6, 8, 0, 0, 4)
        m = self.link.recv_match(blocking=True, timeout=0.05)
        if m:
            self.seen.append(m)
        return m

    def until(self, condition, what, stream=None):
        """Go on until `condition(newest message)` is true; `stream` is sent at 10 Hz."""
        deadline, due, m = time.monotonic() + PATIENCE, 0.0, None
        while not condition(m):
            if time.monotonic() > deadline:
                pytest.fail(f"no {what}; heard {sorted({m.get_type() for m in self.seen})}")
            if stream and time.monotonic() >= due:
                due = time.monotonic() + 0.1
                self.target(*stream)
            m = self.turn()
        return m

    def wait(self, name, where=lambda m: True, stream=None):
        """Return the next message of this name."""
        return self.until(lambda m: m and m.get_type() == name and where(m), name, stream)

    def settle(self):
        """Let a second of the vehicle pass, which says everything once in that time."""
        for _ in range(2):
            self.wait("HEARTBEAT")

    def silence(self):
        """Return when nothing has come for a second."""
        quiet = 0

        def is_silent(m):
            nonlocal quiet
            quiet = 0 if m else quiet + 1
            return quiet > 20

        self.until(is_silent, "silence")

    def command(self, command, *params):
        """Send a command; return the result."""
        p = (*params, *(0,) * (7 - len(params)))
        self.link.mav.command_long_send(self.double.system_id, 1, command, 0, *p)
        return self.wait("COMMAND_ACK", lambda m: m.command == command).result

    def stream(self, *names, hz=10):
        for name in names:
            number = getattr(mav, f"MAVLINK_MSG_ID_{name}")
            assert self.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, number, 1e6 / hz) == 0

    def target(self, mask, x=0.0, y=0.0, z=0.0, vx=0.0, vy=0.0, vz=0.0):
        self.link.mav.set_position_target_local_ned_send(
            *(0, self.double.system_id, 1, mav.MAV_FRAME_LOCAL_NED, mask),
            *(x, y, z, vx, vy, vz, 0, 0, 0, 0, 0),
        )

    def param(self, name, value):
        """Set a parameter; return when the vehicle has it."""
        words = name.encode(), value, mav.MAV_PARAM_TYPE_REAL32
        self.link.mav.param_set_send(self.double.system_id, 1, *words)
        self.wait("PARAM_VALUE", lambda m: (m.param_id, m.param_value) == (name, value))

    def mode(self, number, sub=0):
        return self.command(mav.MAV_CMD_DO_SET_MODE, 1, number, sub)

    def arm(self):
        return self.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)

    def go(self, mode):
        """Arm in this mode; return when the double has seen it."""
        assert (self.mode(mode), self.arm()) == (0, 0)
        self.wait("HEARTBEAT", lambda m: m.base_mode & ARMED)


@pytest.fixture
def start(tmp_path):
    """Start a double and a ground station: start("rover", Manners(...))."""
    with ExitStack() as stack:

        def begin(kind, manners=None, link="tcp", **options):
            clock, line = Clock(), None
            if link == "udpin":
                line = call(f"udpin:{HOST}:0")
                options["port"] = line.port.getsockname()[1]
            double = stack.enter_context(
                vehicle_double(tmp_path, kind, manners, link=link, clock=clock, **options)
            )
            line = line or call(double.address.removeprefix("serial:"))
            stack.callback(line.close)
            return Ground(double, clock, line)

        yield begin


def names(messages):
    return {m.get_type() for m in messages}


def test_a_mannerless_double_lets_everything_through(start):
    ground = start("rover", Manners(streams_on_request=False), position=(4, 2, 0))
    here = ground.wait("LOCAL_POSITION_NED")
    assert (here.x, here.y) == pytest.approx((2, 4), abs=0.2)
    assert ground.mode(15) == mav.MAV_RESULT_ACCEPTED
    assert ground.arm() == mav.MAV_RESULT_ACCEPTED
    actor = ground.double.actor
    ground.until(lambda _: actor.position[0] > 2.5, "drive north", stream=(POSITION_ONLY, 3, 4))


@pytest.mark.parametrize("link", ["tcp", "udpin", "udpout", "serial"])
def test_streams_come_on_request_only_on_every_kind_of_link(start, link):
    ground = start("quadcopter", link=link)
    ground.settle()
    unasked = {"HEARTBEAT", "STATUSTEXT", "GPS_GLOBAL_ORIGIN", "HOME_POSITION"}
    assert names(ground.seen) <= unasked
    ground.stream("LOCAL_POSITION_NED")
    ground.wait("LOCAL_POSITION_NED")
    ground.settle()
    assert names(ground.seen) <= {*unasked, "COMMAND_ACK", "LOCAL_POSITION_NED"}
    ground.link.mav.request_data_stream_send(1, 1, mav.MAV_DATA_STREAM_ALL, 4, 1)
    ground.wait("ATTITUDE")
    ground.wait("SYS_STATUS")
    assert "EXTENDED_SYS_STATE" not in names(ground.seen)
    number = mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE
    assert ground.command(mav.MAV_CMD_REQUEST_MESSAGE, number) == mav.MAV_RESULT_ACCEPTED
    if "EXTENDED_SYS_STATE" not in names(ground.seen):
        ground.wait("EXTENDED_SYS_STATE")


def test_the_origin_comes_late_and_ten_metres_off(start):
    ground = start("quadcopter", Manners(origin_after_s=2, origin_off=(8, 6, -2)))
    ground.stream("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "EKF_STATUS_REPORT")
    early = ground.wait("GLOBAL_POSITION_INT")
    assert (early.lat, early.lon) == (0, 0)
    assert not ground.wait("EKF_STATUS_REPORT").flags & 0x10
    ground.settle()
    assert not names(ground.seen) & {"LOCAL_POSITION_NED", "GPS_GLOBAL_ORIGIN", "HOME_POSITION"}
    ground.clock.now += 2
    here = ground.wait("LOCAL_POSITION_NED")
    assert (here.x, here.y, here.z) == pytest.approx((-8, -6, 2), abs=0.2)
    origin = next((m for m in ground.seen if m.get_type() == "GPS_GLOBAL_ORIGIN"), None)
    origin = origin or ground.wait("GPS_GLOBAL_ORIGIN")
    lat, lon, alt, _ = map(float, HOME.split(","))
    north = (origin.latitude * 1e-7 - lat) * 111_190
    east = (origin.longitude * 1e-7 - lon) * 111_320 * cos(lat * pi / 180)
    assert (north, east) == pytest.approx((8, 6), abs=0.1)
    assert origin.altitude * 1e-3 - alt == pytest.approx(2)
    ground.wait("EKF_STATUS_REPORT", lambda m: m.flags & 0x10)
    assert ground.wait("GLOBAL_POSITION_INT", lambda m: m.lat != 0).lat == round(lat * 1e7)


def test_targets_are_in_the_shifted_frame_too(start):
    ground = start("rover", Manners(origin_off=(8, 6, 0)))
    ground.stream("LOCAL_POSITION_NED")
    ground.go(15)
    ground.wait(
        "LOCAL_POSITION_NED",
        lambda m: hypot(m.x + 8, m.y + 4) < 0.3,
        stream=(POSITION_ONLY, -8, -4),
    )
    assert ground.double.actor.position[:2] == pytest.approx((0, 2), abs=0.35)


def test_arming_is_refused_for_a_while_with_ardupilots_reason(start):
    ground = start("quadcopter", Manners(arming_refused_s=1.5))
    ground.stream("SYS_STATUS", hz=4)
    prearm = mav.MAV_SYS_STATUS_PREARM_CHECK
    assert not ground.wait("SYS_STATUS").onboard_control_sensors_health & prearm
    assert ground.mode(4) == 0
    assert ground.arm() == mav.MAV_RESULT_FAILED
    assert "Arm: Need Position Estimate" in [
        m.text for m in ground.seen if m.get_type() == "STATUSTEXT"
    ]
    ground.clock.now = 1.4
    ground.wait("STATUSTEXT", lambda m: m.text == "PreArm: Need Position Estimate")
    assert ground.arm() == mav.MAV_RESULT_FAILED
    ground.clock.now = 1.5
    ground.wait("SYS_STATUS", lambda m: m.onboard_control_sensors_health & prearm)
    assert ground.arm() == mav.MAV_RESULT_ACCEPTED


def test_px4_refuses_to_arm_in_its_own_words(start):
    ground = start("quadcopter", Manners(arming_refused_s=1.50), autopilot="px4")
    assert ground.arm() == mav.MAV_RESULT_TEMPORARILY_REJECTED
    ground.wait("STATUSTEXT", lambda m: m.text.startswith("Preflight Fail: no heading"))
    chunks = [m for m in ground.seen if m.get_type() == "STATUSTEXT" and m.id]
    assert "".join(m.text for m in chunks).startswith("Arming denied: Resolve system health")
    assert [m.chunk_seq for m in chunks] == [0, 1]


def test_a_refusal_may_come_unannounced(start):
    ground = start("rover", Manners(arming_refused_s=30, refuses_unannounced=True))
    ground.stream("SYS_STATUS", hz=4)
    prearm = mav.MAV_SYS_STATUS_PREARM_CHECK
    assert ground.wait("SYS_STATUS").onboard_control_sensors_health & prearm
    assert ground.arm() == mav.MAV_RESULT_FAILED


def test_an_early_mode_is_accepted_and_lost(start):
    ground = start("quadcopter", Manners(early_mode_lost_s=1.5))
    assert ground.mode(4) == mav.MAV_RESULT_ACCEPTED
    ground.wait("HEARTBEAT", lambda m: m.custom_mode == 4)
    ground.settle()
    assert ground.double.actor.mode == "GUIDED"
    ground.clock.now += 1.5
    ground.wait("HEARTBEAT", lambda m: m.custom_mode == 0)


def test_velocity_beside_a_position_is_ignored(start):
    ground = start("rover", Manners(position_only=True))
    ground.go(15)
    actor, ahead = ground.double.actor, (POSITION_AND_VELOCITY, 0, 0, 0, 1.0, 0, 0)
    ground.until(lambda _: actor.targets >= 20, "targets at the vehicle", stream=ahead)
    assert hypot(*actor.position[:2]) < 0.3  # else it runs ahead of its place


def test_velocity_zero_turns_the_rover_north(start):
    ground = start("rover", Manners(drives_while_turning=True), home="47.3977,8.5456,488,90")
    ground.stream("ATTITUDE")
    assert ground.wait("ATTITUDE").yaw == pytest.approx(pi / 2, abs=0.1)
    ground.go(15)
    ground.wait("ATTITUDE", lambda m: abs(m.yaw) < 0.1, stream=(VELOCITY, 0, 0, 0, 0, 0, 0))


def test_the_rover_drives_along_its_nose_while_it_turns(start):
    ground = start("rover", Manners(drives_while_turning=True))
    ground.stream("LOCAL_POSITION_NED")
    ground.go(15)
    back = (VELOCITY, 0, 0, 0, -0.8, 0.05, 0)  # but it looks north
    ground.wait("LOCAL_POSITION_NED", lambda m: m.x > 0.1, stream=back)  # ours turns on the spot
    ground.wait("LOCAL_POSITION_NED", lambda m: m.x < 0, stream=back)


def test_px4_returns_when_the_stream_is_older_than_it_allows(start):
    ground = start("quadcopter", autopilot="px4")
    ground.param("COM_OF_LOSS_T", 60)
    ground.target(POSITION_ONLY, 0, 0, -3)
    ground.go(6)
    actor = ground.double.actor
    ground.until(lambda _: actor.position[2] < -1, "take-off", stream=(POSITION_ONLY, 0, 0, -3))
    assert actor.mode == "OFFBOARD"
    ground.param("COM_OF_LOSS_T", 1)
    ground.wait("HEARTBEAT", lambda m: m.custom_mode == (4 << 16 | 5 << 24))


def test_a_silent_link_carries_nothing_and_comes_back(start):
    ground = start("rover", Manners(silences=((0.5, 1.5),)))
    ground.stream("ATTITUDE")
    ground.go(15)
    actor, at = ground.double.actor, ground.double.actor.armed_at
    assert [actor.is_silent(at + s) for s in (0.4, 0.5, 1.9, 2.0)] == [False, True, True, False]
    ground.clock.now += 1
    ground.silence()
    ground.clock.now += 1
    ground.wait("ATTITUDE")


def test_a_broken_connection_can_be_called_again(start):
    ground = start("rover", Manners(hangs_up_after_s=1))
    ground.go(15)
    host, port = ground.double.address.split(":")[1:]
    with socket.create_connection((host, int(port)), PATIENCE) as again:
        assert again.recv(1)  # the newest caller is served
        ground.clock.now += 1
        while again.recv(4096):
            pass
    with socket.create_connection((host, int(port)), PATIENCE) as again:
        assert again.recv(1)


def test_it_disarms_itself(start):
    ground = start("rover", Manners(disarms_after_s=1))
    ground.go(15)
    ground.clock.now += 0.9
    ground.settle()
    assert ground.double.actor.armed
    ground.clock.now += 0.2
    ground.wait("HEARTBEAT", lambda m: not m.base_mode & ARMED)


@pytest.mark.parametrize(
    ("kind", "autopilot", "mode", "number"),
    [("rover", "ardupilot", "HOLD", 4), ("quadcopter", "px4", "POSCTL", 3 << 16)],
)
def test_a_pilot_takes_over(start, kind, autopilot, mode, number):
    ground = start(kind, Manners(pilot_after_s=1, pilot_mode=mode), autopilot=autopilot)
    if autopilot == "px4":
        ground.param("COM_OF_LOSS_T", 60)
    ground.target(POSITION_ONLY)
    ground.go(15 if kind == "rover" else 6)
    ground.clock.now += 0.9
    ground.settle()
    assert ground.double.actor.mode != mode
    ground.clock.now += 0.2
    ground.wait("HEARTBEAT", lambda m: m.custom_mode == number)
    assert ground.double.actor.mode == mode
