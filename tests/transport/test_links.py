"""Links are bounded, deaf to strangers, and say clearly what is wrong with an address."""

import socket
import struct
import time
from contextlib import ExitStack, closing, contextmanager, suppress

import pytest

from mavherd.transport.errors import LinkError
from mavherd.transport.links import (
    MAX_PEERS,
    TcpServer,
    UdpIn,
    UdpOut,
    listen_tcp,
    parse_address,
    patience,
    socket_pair_udp,
)
from mavherd.transport.mavlink import Codec, mav
from mavherd.transport.watcher import Watcher

HOST = "127.0.0.1"
PATIENCE = 60.0
NOBODY = 1  # a port that nobody sends from


def udp(connect_to: int | None = None) -> socket.socket:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind((HOST, 0))
    sock.settimeout(PATIENCE)
    if connect_to is not None:
        sock.connect((HOST, connect_to))
    return sock


def port_of(sock: socket.socket) -> int:
    return sock.getsockname()[1]


def until(condition):
    deadline = time.monotonic() + PATIENCE
    while not (value := condition()):
        assert time.monotonic() < deadline
        time.sleep(0.002)
    return value


def arrivals(endpoint):
    """Wait for something and return it."""
    watcher = Watcher([endpoint])
    return until(lambda: watcher.wait(1) and list(endpoint.receive()))


def is_dropped(endpoint):
    """Wait for something; return whether it came to nothing."""
    assert Watcher([endpoint]).wait(PATIENCE)
    return not list(endpoint.receive())


def served() -> TcpServer:
    return TcpServer(listen_tcp(HOST, 0))


@contextmanager
def dialled(server: TcpServer):
    """Yield a connection, and the server's end of it."""
    with socket.create_connection((HOST, server.port), timeout=PATIENCE) as sock:
        label = f"tcp:{HOST}:{port_of(sock)}"

        def accepted():
            assert list(server.receive()) == []
            return [peer for peer in server.links() if peer.label == label]

        (peer,) = until(accepted)
        yield sock, peer


# UDP


def test_udpout_sends_to_its_address_and_hears_the_answer():
    with udp() as ground, closing(UdpOut(HOST, port_of(ground))) as link:
        link.send(b"here I am")
        data, vehicle = ground.recvfrom(100)
        assert data == b"here I am"
        assert not link.spoken
        ground.sendto(b"hello", vehicle)
        assert arrivals(link) == [(link, b"hello")]
        assert link.spoken


def test_udpout_is_deaf_to_everybody_else():
    with udp() as ground, udp() as stranger, closing(UdpOut(HOST, port_of(ground))) as link:
        link.send(b"x")
        _, vehicle = ground.recvfrom(100)
        stranger.sendto(b"obey me", vehicle)
        ground.sendto(b"hello", vehicle)
        assert [data for _, data in arrivals(link)] == [b"hello"]
        assert list(link.receive()) == []


def test_udpout_to_a_port_where_nobody_listens_goes_on_quietly():
    with udp(NOBODY) as late, closing(UdpOut(HOST, port_of(late))) as link:
        for _ in range(5):
            link.send(b"anybody?")
            assert list(link.receive()) == []
        late.connect(link.sockets()[0].getsockname())
        late.setblocking(False)

        def heard():
            link.send(b"anybody?")
            with suppress(BlockingIOError):
                return late.recv(100)

        assert until(heard) == b"anybody?"


def test_a_datagram_flood_does_not_hold_up_the_caller():
    with closing(UdpIn(HOST, 0)) as port, udp(port.port) as flood:
        for _ in range(100):
            flood.send(b"x")
        portions = []
        while sum(portions) < 100:
            portions.append(len(arrivals(port)))
        assert max(portions) <= 64


def test_udpin_answers_each_peer_separately():
    with closing(UdpIn(HOST, 0)) as port, udp(port.port) as a, udp(port.port) as b:
        for sock, word in ((a, b"a"), (b, b"b")):
            sock.send(word)
            ((peer, data),) = arrivals(port)
            assert data == word
            peer.send(b"you are " + word)
        assert (a.recv(100), b.recv(100)) == (b"you are a", b"you are b")
        assert len(port.links()) == 2


def test_udpin_keeps_one_conversation_per_peer():
    with closing(UdpIn(HOST, 0)) as port, udp(port.port) as a:
        a.send(b"1")
        ((first, _),) = arrivals(port)
        a.send(b"2")
        ((again, _),) = arrivals(port)
        assert first is again
        assert port.links() == [first]


def test_udpin_bounds_its_peers_and_lets_the_stalest_go():
    with closing(UdpIn(HOST, 0)) as port, udp(port.port) as faithful:
        faithful.send(b"first")
        ((friend, _),) = arrivals(port)
        seen = []
        for i in range(3 * MAX_PEERS):
            with udp(port.port) as passer_by:
                passer_by.send(b"hello")
                seen += [peer for peer, _ in arrivals(port)]
            if i % 4 == 0:
                faithful.send(b"still there")
                assert arrivals(port)[0][0] is friend
            assert len(port.links()) <= MAX_PEERS
        assert friend.open
        assert friend in port.links()
        assert not seen[0].open


def test_strangers_never_push_out_a_peer_that_makes_sense():
    with closing(UdpIn(HOST, 0)) as port, udp(port.port) as quiet:
        quiet.send(b"first")
        ((friend, _),) = arrivals(port)
        friend.spoken = True
        for _ in range(3 * MAX_PEERS):
            with udp(port.port) as stranger:
                stranger.send(b"noise")
                arrivals(port)
        assert friend in port.links()
        assert len(port.links()) == MAX_PEERS


def test_sending_to_a_peer_that_has_gone_is_no_error():
    with closing(UdpIn(HOST, 0)) as port, udp(port.port) as gone:
        gone.send(b"bye")
        ((peer, _),) = arrivals(port)
        gone.connect((HOST, NOBODY))
        for _ in range(3):
            peer.send(b"are you there?")
        assert list(port.receive()) == []


def test_a_socket_pair_hears_only_itself():
    a, b = socket_pair_udp()
    with a, b, udp() as stranger:
        stranger.sendto(b"let me in", a.getsockname())
        b.send(b"hello")
        a.settimeout(PATIENCE)
        assert a.recv(100) == b"hello"
        a.setblocking(False)
        with pytest.raises(BlockingIOError):
            a.recv(100)


def test_a_socket_pair_holds_a_tick_of_a_large_fleet():
    a, b = socket_pair_udp()
    with a, b:
        for _ in range(100):
            a.send(bytes(1500))
        b.settimeout(PATIENCE)
        assert sum(len(b.recv(2000)) for _ in range(100)) == 150_000


# Floods


def frames(count):
    return Codec(7).encode([mav.MAVLink_statustext_message(6, b"x" * 50)] * count)


def test_much_to_say_goes_out_in_several_short_datagrams():
    said = frames(60)
    with closing(UdpIn(HOST, 0)) as port, udp(port.port) as ground:
        ground.send(b"hello")
        ((peer, _),) = arrivals(port)
        with udp() as other, closing(UdpOut(HOST, port_of(other))) as out:
            for link, sock in ((peer, ground), (out, other)):
                link.send(said)
                heard = []
                while sum(map(len, heard)) < len(said):
                    heard.append(sock.recv(65535))
                assert b"".join(heard) == said
                assert max(map(len, heard)) <= 1200
                assert len(heard) == 4


def test_datagrams_of_a_paused_peer_are_dropped_and_the_others_heard():
    with closing(UdpIn(HOST, 0)) as port, udp(port.port) as flood, udp(port.port) as good:
        flood.send(b"1")
        ((peer, _),) = arrivals(port)
        peer.paused = True
        for _ in range(5):
            flood.send(b"2")
            assert is_dropped(port)
        good.send(b"3")
        assert [data for _, data in arrivals(port)] == [b"3"]
        assert peer in port.links(), "paused is not gone"
        peer.paused = False
        flood.send(b"4")
        assert [data for _, data in arrivals(port)] == [b"4"]


def test_a_paused_udpout_hears_nothing():
    with udp() as ground, closing(UdpOut(HOST, port_of(ground))) as link:
        link.send(b"x")
        _, vehicle = ground.recvfrom(100)
        link.paused = True
        ground.sendto(b"1", vehicle)
        assert is_dropped(link)


def test_a_paused_tcp_peer_waits_and_loses_nothing():
    with (
        closing(served()) as server,
        dialled(server) as (flood, peer),
        dialled(server) as (good, _),
    ):
        peer.paused = True
        flood.sendall(b"later")
        good.sendall(b"now")
        assert [data for _, data in arrivals(server)] == [b"now"]
        assert peer.socket not in server.sockets(), "or the watcher would spin"
        peer.paused = False
        assert [data for _, data in arrivals(server)] == [b"later"]


def test_tcp_reads_a_flood_in_small_portions():
    with closing(served()) as server, dialled(server) as (flood, _):
        flood.sendall(bytes(20_000))
        portions = []
        while sum(portions) < 20_000:
            portions += [len(data) for _, data in arrivals(server)]
        assert max(portions) <= 2048


# TCP


def test_tcp_serves_several_at_once():
    with closing(served()) as server, dialled(server) as (a, _), dialled(server) as (b, _):
        for sock, word in ((a, b"a"), (b, b"b")):
            sock.sendall(word)
            ((peer, data),) = arrivals(server)
            assert data == word
            peer.send(b"you are " + word)
        assert (a.recv(100), b.recv(100)) == (b"you are a", b"you are b")


def test_tcp_reaches_a_peer_that_has_only_connected():
    with closing(served()) as server, dialled(server) as (listener, peer):
        peer.send(b"heartbeat")
        assert listener.recv(100) == b"heartbeat"


def test_tcp_forgets_a_peer_that_hangs_up():
    with closing(served()) as server:
        with dialled(server) as (short_lived, peer):
            short_lived.sendall(b"hello")
            assert arrivals(server) == [(peer, b"hello")]
        until(lambda: list(server.receive()) or not peer.open)
        assert server.links() == []
        assert len(server.sockets()) == 1
        peer.send(b"too late")


def test_tcp_turns_away_whom_it_cannot_hold():
    with closing(served()) as server, ExitStack() as crowd:
        first, *_ = [crowd.enter_context(dialled(server))[0] for _ in range(MAX_PEERS)]
        for _ in range(4):
            with socket.create_connection((HOST, server.port)) as last:
                last.setblocking(False)
                until(lambda sock=last: list(server.receive()) or end_of(sock))
        assert len(server.links()) == MAX_PEERS
        first.sendall(b"still served")
        assert [data for _, data in arrivals(server)] == [b"still served"]


def end_of(sock):
    """Return whether a connection has been closed by the other end."""
    with suppress(BlockingIOError):
        return sock.recv(100) == b""


def test_tcp_drops_a_peer_that_never_reads_and_serves_the_others():
    with (
        closing(served()) as server,
        dialled(server) as (_, stuck),
        dialled(server) as (good, listening),
    ):
        sent = 0
        while stuck.open and sent < 1 << 26:
            stuck.send(bytes(1 << 14))
            sent += 1 << 14
        assert not stuck.open
        stuck.send(b"more")
        assert len(stuck._unsent) < 1 << 19
        assert server.links() == [listening]
        listening.send(b"you go on")
        assert good.recv(100) == b"you go on"


def test_tcp_sends_all_to_a_slow_reader_in_order():
    with closing(served()) as server, dialled(server) as (slow, peer):
        sent, got = b"", b""
        for i in range(2000):
            part = i.to_bytes(4, "big") * 64
            peer.send(part)
            sent += part
            if i % 4 == 0:
                got += slow.recv(2048)
        while len(got) < len(sent):
            peer.send(b"")
            got += slow.recv(1 << 16)
        assert got == sent


def test_a_dropped_peer_does_not_trip_the_watcher_when_another_one_calls():
    with closing(served()) as server, dialled(server) as (_, peer):
        watcher = Watcher([server])
        watcher.wait(0)
        with socket.create_connection((HOST, server.port)):
            assert watcher.wait(PATIENCE)
            until(lambda: list(server.receive()) or len(server.links()) == 2)
            peer.close()  # as a failed send does
            watcher.wait(0)


def test_a_connection_reset_in_the_middle_is_the_end_of_that_peer_only():
    with (
        closing(served()) as server,
        dialled(server) as (rude, reset),
        dialled(server) as (good, peer),
    ):
        rude.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        rude.close()
        good.sendall(b"hello")
        assert arrivals(server) == [(peer, b"hello")]
        until(lambda: reset.send(b"x") or not reset.open)
        peer.send(b"x")
        assert server.links() == [peer]


# Addresses


def test_a_taken_tcp_port_is_named_with_the_cure():
    with listen_tcp(HOST, 0) as taken:
        port = port_of(taken)
        with pytest.raises(LinkError, match=rf"tcp:{HOST}:{port}: .*in use.*another port"):
            listen_tcp(HOST, port)


def test_a_taken_udp_port_is_named_with_the_cure():
    with udp() as taken:
        port = port_of(taken)
        with pytest.raises(LinkError, match=rf"udpin:{HOST}:{port}: .*in use.*another port"):
            UdpIn(HOST, port)


@pytest.mark.parametrize("make", [UdpIn, UdpOut, listen_tcp])
@pytest.mark.parametrize("host", ["no.such.host.invalid", "256.1.1.1", "a..b", "[::1]"])
def test_a_host_that_does_not_exist_is_a_link_error(make, host):
    with pytest.raises(LinkError, match=r":"):
        make(host, 14550)


@pytest.mark.parametrize("make", [UdpIn, UdpOut, listen_tcp])
def test_a_port_beyond_the_last_is_a_link_error(make):
    with pytest.raises(LinkError, match="65535"):
        make(HOST, 65540)


def test_port_zero_cannot_be_sent_to():
    with pytest.raises(LinkError, match="nobody can listen"):
        UdpOut(HOST, 0)


def test_port_zero_listens_on_any_free_port_and_tells_which():
    with closing(UdpIn(HOST, 0)) as a, closing(served()) as b:
        assert a.label == f"udpin:{HOST}:{a.port}"
        assert a.port > 0
        assert b.label == f"tcp:{HOST}:{b.port}"


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("127.0.0.1:14550", ("127.0.0.1", 14550)),
        ("14550", ("127.0.0.1", 14550)),
        (":14550", ("127.0.0.1", 14550)),
        ("localhost:0", ("localhost", 0)),
        ("0.0.0.0:65535", ("0.0.0.0", 65535)),
    ],
)
def test_addresses_are_host_and_port(text, address):
    assert parse_address(text, "--udpout") == address


@pytest.mark.parametrize(
    "text", ["", "localhost", "h:", "h:x", "h:-1", "h:65536", "h:1.5", "1" * 5000, "h: 14550"]
)
def test_anything_else_is_refused_by_name(text):
    with pytest.raises(LinkError, match=r"--udpout .*HOST:PORT"):
        parse_address(text, "--udpout")


def test_closing_twice_is_harmless():
    for endpoint in (UdpIn(HOST, 0), served()):
        endpoint.close()
        endpoint.close()
        assert all(sock.fileno() == -1 for sock in endpoint.sockets())


def test_patience_ends_with_blocking_io_error():
    a, b = socket_pair_udp()
    with a, b:
        patience(a, 0.15)
        kept = a.getsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, struct.calcsize("@ll"))
        assert struct.unpack("@ll", kept) == (0, pytest.approx(150_000, abs=20_000))
        with pytest.raises(BlockingIOError):
            a.recv(100)
        patience(a, PATIENCE)
        b.send(b"in time")
        assert a.recv(100) == b"in time"
