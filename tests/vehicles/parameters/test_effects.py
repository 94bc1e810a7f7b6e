"""Parameters over the wire change what the whole vehicle does."""

import pytest

from mavherd.transport.mavlink import mav
from mavherd.vehicles.flight.modes import Mode

AUTOPILOT_VERSION = (mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION)


def set_parameter(desk, name, value):
    desk.send(mav.MAVLink_param_set_message(desk.vehicle.config.system_id, 1, name, value, 9))


def test_initial_mode_counts_at_boot(desk):
    assert desk("quadcopter", params={"INITIAL_MODE": 5}).autopilot.mode is Mode.LOITER
    assert desk("rover", params={"INITIAL_MODE": 4}).autopilot.mode is Mode.HOLD
    plain = desk("quadcopter")
    assert plain.autopilot.modes.number(plain.autopilot.mode) == 0
    assert plain.vehicle.parameters["INITIAL_MODE"] == 0


def test_one_station_may_be_the_only_one(desk):
    quad = desk("quadcopter")
    assert quad.ask(*AUTOPILOT_VERSION)
    set_parameter(quad, b"SYSID_MYGCS", 250)
    assert quad.ask(*AUTOPILOT_VERSION)  # not enforced
    set_parameter(quad, b"SYSID_ENFORCE", 1)
    assert quad.ask(*AUTOPILOT_VERSION) == []


def test_an_echo_reaches_every_link_that_has_spoken(desk):
    quad = desk("quadcopter")
    other = quad.vehicle.converse(spoken=True)
    set_parameter(quad, b"RTL_ALT", 1600)
    quad.vehicle.step()
    news = quad.vehicle.take_broadcasts()
    for link in (quad.link, other):
        heard = quad.codec.decode(quad.vehicle.report(link, news))
        (echo,) = (m for m in heard if m.get_type() == "PARAM_VALUE")
        assert (echo.param_id, echo.param_value) == ("RTL_ALT", 1600)


def test_a_refusal_says_why_on_the_link(desk, texts):
    quad = desk("quadcopter")
    set_parameter(quad, b"RTL_ALT", -1)
    assert "RTL_ALT: -1 is not within 0 to 300000 cm" in texts(quad.run(0.1))


def test_a_gain_counts_in_flight(desk):
    quad = desk("quadcopter")
    quad.fly(3.0)
    set_parameter(quad, b"WPNAV_SPEED", 60)
    quad.send(quad.target(0xDF8, x=20.0, z=-3.0))
    quad.run(6.0)
    assert quad.where.v_north == pytest.approx(0.6, abs=0.05)
