"""Every vehicle gets ports of its own, and 14550 stays with the ground stations."""

import socket
from contextlib import ExitStack

import pytest

from mavherd.gcs.run.ports import API_UDP, GCS_UDP, LOOPBACK, TCP, PortPlan, free_tcp_port
from mavherd.transport.errors import LinkError
from mavherd.transport.links import listen_tcp
from mavherd.vehicles.config import MAX_SYSTEM_ID


def targets(plan, instance):
    return [port for host, port in plan.udp_targets(instance) if host == LOOPBACK]


def test_every_vehicle_sends_to_14550_and_to_an_api_port_of_its_own():
    plan = PortPlan()
    assert targets(plan, 0) == [GCS_UDP, API_UDP]
    assert targets(plan, 3) == [GCS_UDP, API_UDP + 3]
    api = [targets(plan, i)[1] for i in range(MAX_SYSTEM_ID)]
    assert len(set(api)) == MAX_SYSTEM_ID
    assert GCS_UDP not in api


def test_14550_is_stepped_over_wherever_the_api_ports_begin():
    for first in (14500, 14549, 14550):
        api = [targets(PortPlan(api_udp=first), i)[1] for i in range(60)]
        assert len(set(api)) == 60
        assert GCS_UDP not in api
    assert targets(PortPlan(api_udp=15000), 5)[1] == 15005


def test_so_is_another_port_of_ground_stations():
    plan = PortPlan(gcs_udp=15550, api_udp=15540)
    api = [targets(plan, i)[1] for i in range(MAX_SYSTEM_ID)]
    assert len(set(api)) == MAX_SYSTEM_ID
    assert 15550 not in api


def test_zero_opens_none():
    assert targets(PortPlan(gcs_udp=0), 2) == [API_UDP + 2]
    assert targets(PortPlan(api_udp=0), 2) == [GCS_UDP]
    assert PortPlan(gcs_udp=0, api_udp=0).udp_targets(2) == []
    assert PortPlan(tcp=0).listen(2) is None


def test_a_port_that_cannot_be_is_refused():
    with pytest.raises(LinkError, match="65535"):
        PortPlan(tcp=65530).listen(1)
    with pytest.raises(LinkError, match="65535"):
        PortPlan(api_udp=65530).udp_targets(6)


def test_a_standard_port_that_is_taken_gives_way_to_the_next_free_one():
    instance = MAX_SYSTEM_ID  # far from the ports of anything else that runs here
    with ExitStack() as taken:
        ports = []
        for _ in range(12):
            sock = taken.enter_context(PortPlan().listen(instance))
            ports.append(sock.getsockname()[1])
            assert sock.getsockname()[0] == LOOPBACK
    assert len(set(ports)) == 12
    assert all(TCP + 10 * instance <= port < TCP + 10 * instance + 10 for port in ports[:5])


def test_a_port_set_by_hand_that_is_taken_is_an_error():
    with listen_tcp(LOOPBACK, 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(LinkError, match=str(port)):
            PortPlan(tcp=port).listen(0)


def test_a_free_port_is_free():
    port = free_tcp_port()
    with socket.socket() as sock:
        sock.bind((LOOPBACK, port))
