"""Whoever takes a vehicle out of GUIDED has it; its own failsafe on a silent link is undone."""

import pytest

from mavherd.gcs.safety.takeover import Grip
from mavherd.gcs.station import Station, StationError, stack_of
from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.flight.modes import Mode

OFFBOARD, AUTO_RTL = 0x60000, 0x5040000


class Held:
    """A grip on a vehicle that says what the test has it say, ten times a second."""

    def __init__(self, autopilot="px4"):
        stack = stack_of(autopilot)
        self.station = Station("q", 5, 10, stack=stack)
        self.number = stack.personality.autopilot
        self.grip = Grip(self.station)
        self.codec = Codec(5)
        self.mode = stack.modes("quadcopter").number(Mode.GUIDED)
        self.armed = True
        self.silent = self.obeys = False
        self.quiet = False  # no heartbeat is due
        self.asked = []
        self.now = 0.0

    def run(self, seconds):
        results = []
        for _ in range(round(seconds * 10)):
            self.now += 0.1
            if not (self.silent or self.quiet):
                self.say(
                    mav.MAVLink_heartbeat_message(2, self.number, 128 * self.armed, self.mode, 4, 3)
                )
            results.append(self.grip.check(self.now))
            for m in Codec(5).decode(self.station.transmit(self.now)):
                if getattr(m, "command", 0) == mav.MAV_CMD_DO_SET_MODE and not self.silent:
                    self.asked.append(self.now)
                    self.say(mav.MAVLink_command_ack_message(m.command, 0 if self.obeys else 1))
                    self.mode = OFFBOARD if self.obeys else self.mode
        return results

    def say(self, message):
        self.station.receive(self.codec.encode([message]), self.now)


def test_a_vehicle_in_guided_and_armed_is_ours():
    assert all(Held().run(3))


def test_a_pilot_wins_at_once_and_what_the_vehicle_says_is_told():
    held = Held()
    held.run(3)
    held.mode = AUTO_RTL
    held.say(mav.MAVLink_statustext_message(4, b"Pilot took over using sticks"))
    with pytest.raises(StationError) as caught:
        held.run(1)
    assert str(caught.value) == (
        "q: left OFFBOARD for RTL at 3.1 s: the vehicle says 'Pilot took over using sticks'"
    )
    assert not held.asked


def test_only_what_may_be_the_reason_is_told():
    held = Held()
    held.run(1)
    held.say(mav.MAVLink_statustext_message(4, b"Wind is strong"))
    held.say(mav.MAVLink_statustext_message(6, b"EKF3 IMU0 yaw alignment complete"))
    held.run(1)
    held.say(mav.MAVLink_statustext_message(6, b"RTL by switch"))
    held.mode = AUTO_RTL
    with pytest.raises(StationError) as caught:
        held.run(1)
    assert str(caught.value).endswith(
        "for RTL at 2.1 s: the vehicle says 'Wind is strong', 'RTL by switch'"
    )


def test_what_it_says_while_nothing_has_changed_yet_for_its_heartbeat_comes_once_a_second():
    held = Held()
    held.run(1)
    held.quiet = True
    held.run(0.5)
    held.say(mav.MAVLink_statustext_message(6, b"RTL by switch"))
    held.run(0.3)
    held.quiet, held.mode = False, AUTO_RTL
    with pytest.raises(StationError, match="the vehicle says 'RTL by switch'"):
        held.run(1)


def test_a_vehicle_that_disarms_itself_is_lost():
    held = Held("ardupilot")
    held.run(1)
    held.armed = False
    with pytest.raises(StationError, match=r"q: disarmed itself at 1.1 s"):
        held.run(1)


def test_its_own_failsafe_on_a_silent_link_is_undone():
    held = Held()
    held.run(3)
    held.silent, held.obeys = True, True
    held.run(5)
    held.silent, held.mode = False, AUTO_RTL
    results = held.run(3)
    assert results[-1]
    assert not results[0]
    assert len(held.asked) == 1
    held.mode = AUTO_RTL  # and now it is somebody
    with pytest.raises(StationError, match="left OFFBOARD"):
        held.run(1)


def test_a_pilot_wins_also_soon_after_a_silence_that_has_led_to_nothing():
    held = Held()
    held.run(3)
    held.silent = True
    held.run(2)
    held.silent = False
    assert all(held.run(1))
    held.mode = AUTO_RTL
    with pytest.raises(StationError, match="left OFFBOARD for RTL"):
        held.run(0.2)
    assert not held.asked


def test_a_vehicle_that_comes_back_by_itself_is_not_asked():
    held = Held()
    held.run(3)
    held.silent = True
    held.run(5)
    held.silent, held.mode = False, AUTO_RTL
    assert not any(held.run(0.5))  # PX4 goes back when set-points flow again
    held.mode = OFFBOARD
    assert all(held.run(3))
    assert not held.asked


def test_a_vehicle_that_does_not_come_back_is_given_up_after_a_few_tries():
    held = Held()
    held.run(3)
    held.silent = True
    held.run(5)
    held.silent, held.mode = False, AUTO_RTL
    with pytest.raises(StationError, match=r"left OFFBOARD for RTL .* not come back \(q: mode"):
        held.run(20)
    assert 2 <= len(held.asked) <= 6
    assert held.now < 16


def test_one_that_has_disarmed_meanwhile_is_not_asked_back():
    held = Held()
    held.run(3)
    held.silent = True
    held.run(5)
    held.silent, held.armed = False, False
    with pytest.raises(StationError, match="disarmed itself"):
        held.run(5)
    assert not held.asked
