"""What a link is told, and whom a vehicle heeds on it."""

from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.protocol.ftp import Packet
from mavherd.vehicles.protocol.ftp_tree import PARAMETER_PACK

OPEN, READ, ACK = 4, 5, 128


def test_a_file_opened_with_the_first_message_of_a_late_link_stays_open(quad):
    quad.run(30.0)
    quad.link = quad.vehicle.converse()

    def ask(opcode, sequence, data=b"", size=0):
        request = Packet(sequence, 0, opcode, size or len(data), data=data)
        message = mav.MAVLink_file_transfer_protocol_message(0, 1, 1, request.pack())
        return next(m for m in quad.send(message) if m.get_type() == message.get_type())

    assert ask(OPEN, 1, PARAMETER_PACK.encode()).payload[3] == ACK
    quad.run(0.05)
    assert ask(READ, 2, size=10).payload[3] == ACK


def test_with_sysid_enforce_one_outside_station_is_obeyed_and_the_coordinator(desk):
    quad = desk("quadcopter", params={"SYSID_ENFORCE": 1})
    arm = mav.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)

    def answers(link, system_id):
        return bool(quad.vehicle.handle(Codec(system_id, 190).encode([arm]), link))

    outside, coordinator = quad.vehicle.converse(), quad.vehicle.converse(channel=None)
    assert not answers(outside, 254)
    assert answers(outside, 255)
    assert answers(coordinator, 254)
