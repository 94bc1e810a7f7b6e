"""MANUAL_CONTROL and RC overrides become channels and sticks, from the right station only."""

import pytest

from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.flight.sticks import PilotInput, Sticks
from mavherd.vehicles.vehicle import Vehicle

NOT_GIVEN = 0x7FFF
IGNORE = 0xFFFF


class Radio:
    """A pilot's input and the clock of the autopilot that reads it."""

    def __init__(self, kind="quadcopter", personality="ardupilot"):
        config = VehicleConfig(kind=kind, system_id=7, autopilot=personality)
        self.autopilot = Vehicle(config).autopilot
        self.autopilot.now = 10.0
        self.input = PilotInput(self.autopilot)

    def send(self, m, station=255):
        (received,) = Codec(7).decode(Codec(station, 190).encode([m]))
        self.input.take(received, self.autopilot.now)

    def manual(self, x=0, y=0, z=500, r=0, station=255, target=7):
        self.send(mav.MAVLink_manual_control_message(target, x, y, z, r, 0), station)

    def override(self, *channels, station=255, high=()):
        low = (*channels, *[IGNORE] * (8 - len(channels)))
        m = mav.MAVLink_rc_channels_override_message(7, 1, *low, *high)
        self.send(m, station)

    def wait(self, seconds):
        self.autopilot.now += seconds

    @property
    def sticks(self):
        return self.input.sticks


def near(*values):
    return Sticks(*(v if v is None else pytest.approx(v, abs=0.01) for v in values))


def test_nobody_at_the_sticks():
    assert Radio().sticks == Sticks()
    assert not Radio().input.lost
    assert Radio().input.channels == (1500, 1500, 1000, *[1500] * 15)
    assert Radio("rover").input.channels == (1500,) * 18


def test_a_joystick_moves_all_four_sticks():
    radio = Radio()
    radio.manual(x=1000, y=-500, z=250, r=1000)
    assert radio.input.channels[:4] == (1250, 1000, 1250, 2000)
    # forward lowers the nose: negative pitch
    assert radio.sticks == near(-0.474, -1.0, 1.0, 0.25)


def test_axes_that_are_not_given_stay_as_they_are():
    radio = Radio()
    radio.manual(x=NOT_GIVEN, y=1000, z=NOT_GIVEN, r=NOT_GIVEN)
    assert radio.sticks == near(1.0, 0.0, 0.0, None)
    radio.manual(x=NOT_GIVEN, y=NOT_GIVEN, z=700, r=NOT_GIVEN)
    assert radio.sticks == near(1.0, 0.0, 0.0, 0.7)


def test_axes_beyond_their_range_are_full():
    radio = Radio()
    radio.manual(x=-32768, y=32766, z=-5000, r=-32768)
    assert radio.sticks == near(1.0, 1.0, -1.0, 0.0)


def test_a_rovers_throttle_goes_both_ways():
    radio = Radio("rover")
    for z, throttle in ((1000, 1.0), (0, 0.0), (-1000, -1.0)):
        radio.manual(z=z)
        assert radio.sticks.throttle == pytest.approx(throttle)


def test_px4_has_the_throttles_middle_at_500():
    radio = Radio("rover", "px4")
    for z, throttle in ((1000, 1.0), (500, 0.0), (0, -1.0)):
        radio.manual(z=z)
        assert radio.sticks.throttle == pytest.approx(throttle)


def test_overrides_are_pulses():
    radio = Radio()
    radio.override(1750, 1500, 1600, 1000)
    assert radio.sticks == near(0.474, 0.0, -1.0, 0.6)
    assert radio.input.channels[:4] == (1750, 1500, 1600, 1000)


def test_an_ignored_channel_stays_and_a_released_one_rests():
    radio = Radio()
    radio.override(2000, 2000, 1600, 1500)
    radio.override(IGNORE, 0, IGNORE, 0)
    assert radio.input.channels[:4] == (2000, 1500, 1600, 1500)


def test_high_channels_are_released_with_another_number():
    radio = Radio()
    radio.override(1500, high=(1100,))
    assert radio.input.channels[8] == 1100
    radio.override(1500, high=(0,))
    assert radio.input.channels[8] == 1100
    radio.override(1500, high=(0xFFFE,))
    assert radio.input.channels[8] == 1500


def test_absurd_pulses_are_full_deflection():
    radio = Radio()
    radio.override(1, 60000, 60000, 1)
    assert radio.sticks == near(-1.0, 1.0, -1.0, 1.0)
    assert radio.input.channels[:4] == (800, 2200, 2200, 800)


def test_a_small_offset_is_no_deflection():
    radio = Radio()
    radio.override(1520, 1490, 1500, 1510)
    assert radio.sticks[:3] == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("speak", [Radio.manual, lambda r, **k: r.override(1900, 1500, 1500, **k)])
def test_only_sysid_mygcs_is_heeded_on_ardupilot(speak):
    radio = Radio()
    speak(radio, station=245)
    assert radio.sticks == Sticks()
    radio.autopilot.settings.gcs_system_id = 245
    speak(radio, station=255)
    assert radio.sticks == Sticks()
    speak(radio, station=245)
    assert radio.sticks.throttle == pytest.approx(0.5)


@pytest.mark.parametrize("personality", ["px4", "generic"])
def test_elsewhere_every_station_is(personality):
    radio = Radio(personality=personality)
    radio.manual(station=245)
    assert radio.sticks.throttle == 0.5


def test_a_joystick_for_another_vehicle_is_not_ours():
    radio = Radio()
    for target in (0, 8, 255):
        radio.manual(target=target)
    assert radio.sticks == Sticks()


def test_each_channel_expires_by_itself():
    radio = Radio()
    radio.override(2000, 2000, 1700)
    radio.wait(2.0)
    radio.override(IGNORE, IGNORE, 1700)
    radio.wait(1.5)
    assert radio.sticks == near(0.0, 0.0, 0.0, 0.7)
    radio.wait(1.5)
    assert radio.sticks == Sticks()
    assert radio.input.channels[2] == 1000


def test_the_timeout_is_a_setting():
    radio = Radio()
    radio.autopilot.settings.pilot_timeout = 0.5
    radio.manual()
    radio.wait(0.6)
    assert radio.sticks == Sticks()
    radio.autopilot.settings.pilot_timeout = 0.0  # RC_OVERRIDE_TIME 0: no overrides
    radio.manual()
    assert radio.sticks == Sticks()


def test_a_pilot_who_falls_silent_is_lost_until_he_is_back():
    radio = Radio()
    radio.manual()
    radio.wait(1.4)
    assert not radio.input.lost
    radio.wait(0.2)
    assert radio.input.lost
    radio.manual()
    assert not radio.input.lost


def test_a_pilot_who_lets_go_of_every_channel_is_not_lost():
    radio = Radio()
    radio.override(1500, 1500, 1500, 1500)
    radio.override(0, 0, 0, 0, 0, 0, 0, 0)
    radio.wait(60)
    assert not radio.input.lost
