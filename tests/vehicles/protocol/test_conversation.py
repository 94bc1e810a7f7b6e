"""A link that is opened late is served as one that was there from the start."""

from mavherd.transport.mavlink import mav
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
