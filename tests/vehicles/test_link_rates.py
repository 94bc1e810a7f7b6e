"""SRn_... parameters count by the order in which links are open, and never for the coordinator."""

import socket
import threading
import time
from contextlib import closing, contextmanager

from mavherd.transport.links import TcpServer, listen_tcp, socket_pair_udp
from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.process import VehicleProcess
from mavherd.vehicles.vehicle import Vehicle

VFR_HUD = mav.MAVLINK_MSG_ID_VFR_HUD
PATIENCE = 60.0  # s, on a machine that stands still now and then


@contextmanager
def running(vehicle, *endpoints, coordinator=None):
    """Run a vehicle process in a thread, on the wall clock."""
    control, theirs = socket.socketpair()
    process = VehicleProcess(vehicle, list(endpoints), control=theirs, coordinator=coordinator)
    thread = threading.Thread(target=process.run_free)
    thread.start()
    try:
        yield
    finally:
        control.close()
        thread.join(PATIENCE)
        process.close()
        theirs.close()
        assert not thread.is_alive()


def hud_rate(sock):
    """Ask for the rate of VFR_HUD on a link; parameters count from the second second on."""
    codec = Codec(255, 190)
    deadline = time.monotonic() + PATIENCE
    ask = mav.MAVLink_command_long_message(3, 1, 510, 0, VFR_HUD, 0, 0, 0, 0, 0, 0)
    sock.settimeout(PATIENCE)
    sock.send(codec.encode([ask]))
    while time.monotonic() < deadline:
        for m in codec.decode(sock.recv(65535)):
            if m.get_type() == "MESSAGE_INTERVAL" and m.message_id == VFR_HUD:
                return 1e6 / m.interval_us
    raise AssertionError("no answer")


def test_a_client_that_comes_takes_the_place_of_one_that_has_gone():
    vehicle = Vehicle(VehicleConfig(kind="rover", system_id=3, name="r3", seed=4))
    vehicle.settings.stream_rates[0]["EXTRA2"] = 20.0
    vehicle.settings.stream_rates[1]["EXTRA2"] = 5.0
    server = listen_tcp("127.0.0.1", 0)
    at = "127.0.0.1", server.getsockname()[1]
    ours, theirs = socket_pair_udp()
    with closing(ours), closing(theirs), running(vehicle, TcpServer(server), coordinator=theirs):
        assert hud_rate(ours) == 4  # the vehicle's own
        first = socket.create_connection(at)
        assert hud_rate(first) == 20
        second = socket.create_connection(at)
        assert hud_rate(second) == 5
        first.close()
        deadline = time.monotonic() + PATIENCE
        rates = []
        while 20 not in rates and time.monotonic() < deadline:
            with closing(socket.create_connection(at)) as third:
                rates.append(hud_rate(third))
        assert rates[-1] == 20
        assert hud_rate(second) == 5
        second.close()
