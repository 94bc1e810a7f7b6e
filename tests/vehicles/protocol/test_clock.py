"""TIMESYNC is answered with our time; PING by those flight stacks that do."""

from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.protocol.clock import ClockService


def received(message, sender=(255, 190)):
    return Codec(1).decode(Codec(*sender).encode([message]))[0]


def answers(service, message):
    m = received(message)
    handler = service.handlers.get(m.get_type())
    return handler(m) if handler else []


def test_a_time_question_is_answered_with_our_time_and_theirs():
    service = ClockService(lambda: 12_345_678, answers_ping=False)
    for theirs in (1, 2**63 - 1, -5, 0):
        (reply,) = answers(service, mav.MAVLink_timesync_message(0, theirs))
        assert (reply.tc1, reply.ts1) == (12_345_678_000, theirs)


def test_in_the_moment_of_boot_the_answer_is_still_no_question():
    (reply,) = answers(
        ClockService(lambda: 0, answers_ping=False), mav.MAVLink_timesync_message(0, 9)
    )
    assert reply.tc1 != 0


def test_an_answer_is_not_answered():
    service = ClockService(lambda: 1, answers_ping=True)
    assert answers(service, mav.MAVLink_timesync_message(77, 9)) == []
    assert answers(service, mav.MAVLink_ping_message(5, 6, 255, 190)) == []
    assert answers(service, mav.MAVLink_ping_message(5, 6, 0, 190)) == []


def test_a_ping_comes_back_to_its_sender():
    service = ClockService(lambda: 1, answers_ping=True)
    (reply,) = answers(service, mav.MAVLink_ping_message(5, 6, 0, 0))
    assert (reply.time_usec, reply.seq) == (5, 6)
    assert (reply.target_system, reply.target_component) == (255, 190)


def test_ardupilot_does_not_answer_pings():
    service = ClockService(lambda: 1, answers_ping=False)
    assert answers(service, mav.MAVLink_ping_message(5, 6, 0, 0)) == []
