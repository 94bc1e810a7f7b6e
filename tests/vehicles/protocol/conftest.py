"""What tests of telemetry share: asking for one message, and a vehicle under way."""

import pytest

from mavherd.transport.mavlink import mav


@pytest.fixture(scope="session")
def ask():
    """Ask a vehicle on a desk for one message by name; it must be given."""

    def ask_for(on_desk, name):
        message_id = getattr(mav, f"MAVLINK_MSG_ID_{name}")
        (_, message) = on_desk.ask(mav.MAV_CMD_REQUEST_MESSAGE, message_id)
        assert message.get_type() == name
        return message

    return ask_for


@pytest.fixture
def moving(desk):
    """Make a vehicle that is under way, away from the origin and from north."""

    def make(kind="quadcopter", **config):
        where = {"north": 40.0, "east": -30.0, "down": -2.0, "yaw": 0.4, "system_id": 7}
        vehicle = desk(kind, **{**where, **config})
        assert vehicle.command(mav.MAV_CMD_DO_SET_MODE, 1, vehicle.guided) == 0
        assert vehicle.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 0
        if kind == "quadcopter":
            vehicle.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 3)
            vehicle.run(7)
        for _ in range(20):
            vehicle.send(vehicle.target(0xDC7, vx=1.0, vy=1.5, vz=-0.3))
            vehicle.run(0.1)
        return vehicle

    return make
