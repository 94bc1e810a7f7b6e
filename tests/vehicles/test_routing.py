"""Frames go where the routing rules of the MAVLink guide send them, and never round in circles."""

from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.routing import Router

OWN = 1
A, B, C = "a", "b", "c"  # links
QGC, MAVPROXY, OTHER_VEHICLE, CAMERA = (255, 190), (254, 230), (77, 1), (OWN, 100)


def heartbeat():
    return mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


def command(system, component=1):
    return mav.MAVLink_command_long_message(system, component, 400, 0, 1, 0, 0, 0, 0, 0, 0)


class Net:
    """A router, and senders whose frames arrive at it as real ones do."""

    def __init__(self):
        self.router = Router(OWN)
        self.senders = {}
        self.now = 0.0

    def arrive(self, sender, link, message=None):
        codec = self.senders.setdefault(sender, Codec(*sender))
        (frame,) = codec.frames([message or heartbeat()])
        return self.again(frame, link)

    def again(self, frame, link):
        (received,) = Codec(OWN).decode(frame)
        return self.router.route(received, frame, link, self.now)

    def goes_to(self, sender, link, message=None):
        return self.arrive(sender, link, message).links


def met():
    """QGC on a, MAVProxy on b, another vehicle on c; all have been heard."""
    net = Net()
    for sender, link in ((QGC, A), (MAVPROXY, B), (OTHER_VEHICLE, C)):
        net.arrive(sender, link)
    return net


def test_a_broadcast_goes_to_every_other_link_that_has_spoken():
    net = Net()
    assert net.goes_to(QGC, A) == []
    assert net.goes_to(MAVPROXY, B) == [A]
    assert net.goes_to(QGC, A) == [B]
    assert net.goes_to(QGC, A, command(0, 0)) == [B]
    assert net.goes_to(OTHER_VEHICLE, C, mav.MAVLink_statustext_message(6, b"hi")) == [A, B]


def test_a_message_for_another_system_goes_where_that_was_heard_and_only_there():
    net = met()
    assert net.goes_to(QGC, A, command(77)) == [C]
    assert net.goes_to(QGC, A, command(77, 42)) == [C], "any component of another system"
    assert net.goes_to(QGC, A, command(78)) == []
    ack = mav.MAVLink_command_ack_message(400, 0, target_system=255, target_component=190)
    assert net.goes_to(OTHER_VEHICLE, C, ack) == [A]


def test_a_message_for_one_on_the_same_link_stays_there():
    net = met()
    net.arrive((78, 1), C)
    assert net.goes_to(OTHER_VEHICLE, C, command(78)) == []


def test_what_is_for_this_vehicle_alone_goes_nowhere():
    net = met()
    route = net.arrive(QGC, A, command(OWN))
    assert route.links == []
    assert route.stays


def test_other_components_of_this_vehicle_are_found_on_their_links():
    net = met()
    net.arrive(CAMERA, C)
    route = net.arrive(QGC, A, command(*CAMERA))
    assert route.links == [C]
    assert not route.stays, "the camera will answer"
    everybody = net.arrive(QGC, A, command(OWN, 0))
    assert everybody.links == [C]
    assert everybody.stays


def test_a_component_that_was_never_heard_is_left_to_the_vehicle():
    route = met().arrive(QGC, A, command(OWN, 99))
    assert route.links == []
    assert route.stays


def test_broadcasts_stay_too():
    assert met().arrive(QGC, A).stays
    assert met().arrive(QGC, A, command(0, 0)).stays


def test_our_own_words_that_come_back_are_not_passed_on_and_teach_nothing():
    net = met()
    assert net.goes_to((OWN, 1), A) == []
    assert net.goes_to(MAVPROXY, B, command(OWN)) == []


def test_senders_without_an_id_are_nobody():
    net = met()
    assert net.goes_to((0, 0), A) == []


def test_one_station_on_two_links_does_not_hear_itself():
    net = met()
    net.arrive(QGC, B)
    assert net.goes_to(QGC, A) == [C]
    assert net.goes_to(QGC, B) == [C]


def test_a_frame_that_comes_round_by_another_link_is_not_passed_on_again():
    net = met()
    (frame,) = Codec(200, 1).frames([heartbeat()])
    assert net.again(frame, A).links == [B, C]
    assert net.again(frame, B).links == []
    assert net.again(frame, C).links == []
    net.now += 0.1
    assert net.again(frame, B).links == []


def test_equal_frames_long_after_one_another_are_two_frames():
    net = met()
    (frame,) = Codec(200, 1).frames([heartbeat()])
    assert net.again(frame, A).links == [B, C]
    net.now += 1.0
    assert net.again(frame, A).links == [B, C]


def test_radio_status_is_about_its_own_link():
    assert met().goes_to(QGC, A, mav.MAVLink_radio_status_message(1, 2, 3, 4, 5, 6, 7)) == []


def test_manual_control_is_addressed_too():
    sticks = mav.MAVLink_manual_control_message(OWN, 0, 0, 500, 0, 0)
    assert met().goes_to(QGC, A, sticks) == []
    sticks = mav.MAVLink_manual_control_message(77, 0, 0, 500, 0, 0)
    assert met().goes_to(QGC, A, sticks) == [C]


def test_who_was_silent_for_a_minute_is_not_looked_for_any_more():
    net = met()
    net.now = 50.0
    net.arrive(MAVPROXY, B)
    net.now = 70.0
    assert net.goes_to(QGC, A, command(77)) == []
    assert net.goes_to(QGC, A) == [B]
    net.arrive(OTHER_VEHICLE, C)
    assert net.goes_to(QGC, A, command(77)) == [C]


def test_a_station_that_moves_to_another_link_is_soon_heard_on_its_old_one():
    net = met()
    net.arrive(OTHER_VEHICLE, A)
    net.now = 70.0
    for sender, link in ((OTHER_VEHICLE, A), (MAVPROXY, B)):
        net.arrive(sender, link)
    assert net.goes_to(QGC, B) == [A], "QGC was on a more than a minute ago"


def test_a_closed_link_is_forgotten():
    net = met()
    net.router.keep([A, B])
    assert net.goes_to(QGC, A) == [B]
    assert net.goes_to(QGC, A, command(77)) == []


def test_a_flood_of_invented_senders_crowds_out_nobody_else():
    net = met()
    for system in range(2, 250):
        net.arrive((system, system), C)
    assert net.goes_to(QGC, A) == [B, C]
    assert net.goes_to(OTHER_VEHICLE, C, command(*QGC)) == [A]
    assert sum(map(len, net.router._heard.values())) < 30
    assert len(net.router._recent) <= 128
