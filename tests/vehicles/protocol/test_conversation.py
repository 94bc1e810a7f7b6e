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


def counted(messages, name):
    return sum(m.get_type() == name for m in messages)


def test_lists_come_whole_however_long_nobody_asked(quad):
    for pause in (0.0, 0.01, 30.0):
        quad.run(pause)
        quad.send(mav.MAVLink_param_request_list_message(1, 1))
        assert counted(quad.run(30.0), "PARAM_VALUE") == len(quad.vehicle.parameters)


def test_an_upload_that_stalls_after_silence_is_asked_for_again_and_given_up(quad):
    for pause in (0.0, 0.01, 30.0):
        quad.run(pause)
        (asked,) = quad.send(mav.MAVLink_mission_count_message(1, 1, 2))
        assert asked.get_type() == "MISSION_REQUEST"
        heard = quad.run(20.0)
        assert counted(heard, "MISSION_REQUEST") > 2
        assert counted(heard, "MISSION_ACK") == 1


def test_reads_are_limited_in_each_moment_and_not_over_all(quad):
    read = mav.MAVLink_param_request_read_message(1, 1, b"", 0)
    few, many = [read] * 60, [read] * 300
    for pause in (0.01, 0.02, 5.0):
        assert len(quad.send(*few)) == 60
        assert len(quad.send(*many)) < 100
        quad.run(pause)
