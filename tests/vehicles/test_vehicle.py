"""A vehicle is a function of its inputs: same seed and bytes in, same bytes out."""

import pytest

from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.config import Disturbance, VehicleConfig
from mavherd.vehicles.vehicle import Vehicle

WIND = Disturbance(form="held", amplitude=0.3)


def flight(desk, kind, seconds=12.0, **config):
    """Bytes of a scripted flight (or drive) on one link."""
    vehicle = desk(kind, disturbance=WIND, **config)
    out = bytearray()
    script = {
        0: lambda: vehicle.command(mav.MAV_CMD_DO_SET_MODE, 1, vehicle.guided),
        10: lambda: vehicle.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1),
        20: lambda: vehicle.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 3),
        500: lambda: vehicle.send(vehicle.target(0xDC0, x=3, y=1, z=-3, vx=0.2)),
        600: lambda: vehicle.send(vehicle.target(0xDC7, vx=1.0)),
    }
    for i, data in enumerate(vehicle.frames(seconds)):
        script.get(i, lambda: None)()
        out += data
    return bytes(out)


@pytest.mark.parametrize("stack", ["ardupilot", "px4", "generic"])
@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_one_seed_and_the_same_inputs_give_identical_bytes(desk, kind, stack):
    first = flight(desk, kind, seed=5, autopilot=stack)
    assert len(first) > 10_000
    assert flight(desk, kind, seed=5, autopilot=stack) == first


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_another_seed_or_system_id_is_another_disturbance(desk, kind):
    first = flight(desk, kind, seed=5)
    assert flight(desk, kind, seed=6) != first
    a, b = (desk(kind, disturbance=WIND, seed=5, system_id=i) for i in (1, 2))
    for vehicle in (a, b):
        vehicle.fly()
        vehicle.run(3)
    assert a.where[:3] != b.where[:3]


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_an_outside_listener_does_not_change_another_links_bytes(desk, kind):
    alone = flight(desk, kind, seed=5)
    crowd = desk(kind, disturbance=WIND, seed=5)
    outside = crowd.vehicle.converse()
    stranger = Codec(255, 0)
    chatter = [
        mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
        mav.MAVLink_command_long_message(1, 1, 511, 0, 30, 10_000, 0, 0, 0, 0, 0),
        mav.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0),
        mav.MAVLink_param_request_list_message(1, 1),
    ]
    own_frames = crowd.frames

    def frames(seconds):
        for data in own_frames(seconds):
            crowd.vehicle.handle(b"\xfdnoise" + stranger.encode(chatter), outside)
            crowd.vehicle.report(outside, [])
            yield data

    crowd.frames = frames
    assert flight(lambda *a, **k: crowd, kind) == alone


def test_what_one_link_says_in_pieces_does_not_mix_with_another(quad):
    arm = quad.codec.encode([mav.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)])
    other = quad.vehicle.converse(spoken=True)
    quad.vehicle.handle(arm[:10], quad.link, stream=True)
    assert quad.vehicle.handle(arm[10:], other, stream=True) == b""
    assert not quad.autopilot.armed
    assert quad.vehicle.handle(arm[10:], quad.link, stream=True)
    assert quad.autopilot.armed


def test_datagrams_may_hold_many_messages(quad):
    ask = mav.MAVLink_command_long_message(1, 1, 512, 0, 0, 0, 0, 0, 0, 0, 0)
    names = [m.get_type() for m in quad.send(*[ask] * 20)]
    assert names == ["COMMAND_ACK", "HEARTBEAT"] * 20


def test_every_link_numbers_its_own_frames(quad):
    other = quad.vehicle.converse(spoken=True)
    quad.command(511, mav.MAVLINK_MSG_ID_ATTITUDE, 10_000)
    ears = Codec(255), Codec(255)
    for _ in range(500):
        quad.vehicle.step()
        broadcasts = quad.vehicle.take_broadcasts()
        for ear, link in zip(ears, (quad.link, other), strict=True):
            ear.decode(quad.vehicle.report(link, broadcasts))
    assert [ear.lost for ear in ears] == [0, 0]


def test_the_configuration_survives_the_trip_to_its_process():
    config = VehicleConfig(
        kind="rover",
        system_id=9,
        name="r9",
        north=1.5,
        yaw=-0.25,
        params={"mass": 9.0},
        disturbance=WIND,
        seed=2**62,
        latch_position=False,
    )
    assert VehicleConfig.from_json(config.to_json()) == config


@pytest.mark.parametrize(
    "bad",
    [{"kind": "boat"}, {"system_id": 0}, {"system_id": 241}, {"profile": "wild"}],
)
def test_a_configuration_that_cannot_be_is_refused(bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        VehicleConfig(**{"kind": "rover", "system_id": 1, **bad})


def test_a_parameter_that_does_not_exist_is_named():
    with pytest.raises(ValueError, match="did you mean 'mass'"):
        Vehicle(VehicleConfig(kind="rover", system_id=1, params={"maas": 1.0}))


@pytest.mark.parametrize("stack", ["ardupilot", "px4", "generic"])
def test_a_list_of_parameters_brings_the_version_before_it_ends(desk, stack):
    """DroneKit's `vehicle.version` and `capabilities`, as soon as it is ready."""
    rover = desk("rover", autopilot=stack)
    rover.send(mav.MAVLink_param_request_list_message(1, 1))
    names = [m.get_type() for m in rover.run(0.3)]
    assert "AUTOPILOT_VERSION" in names[: names.index("PARAM_VALUE") + 1]
    assert names.count("PARAM_VALUE") >= len(rover.autopilot.parameters)
