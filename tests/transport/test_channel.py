"""Lines of JSON arrive whole, in order, and the end of the other side is noticed."""

import os
import socket
import threading
from contextlib import contextmanager

import pytest

from mavherd.transport.channel import MAX_LINE, Channel, ChannelClosed


@contextmanager
def pair():
    a, b = map(Channel, socket.socketpair())
    try:
        yield a, b
    finally:
        a.close()
        b.close()


def test_objects_arrive_in_order():
    with pair() as (a, b):
        for i in range(50):
            a.send({"i": i, "text": "ä\nb"})
        assert [b.receive() for _ in range(50)] == [{"i": i, "text": "ä\nb"} for i in range(50)]


def test_a_partial_line_waits_for_its_rest():
    with pair() as (a, b):
        for part in (b'{"tick"', b": 1", b"2}"):
            a.socket.sendall(part)
            assert b.receive(timeout=0.01) is None
        a.socket.sendall(b'\n{"next": 1}\n{"cut')
        assert b.receive(timeout=1) == {"tick": 12}
        assert b.receive(timeout=1) == {"next": 1}
        assert b.receive(timeout=0.01) is None


def test_nothing_is_none_after_the_timeout():
    with pair() as (_, b):
        assert b.receive(timeout=0) is None


def test_end_of_file_is_the_end_after_what_was_sent_before():
    with pair() as (a, b):
        a.send({"last": 1})
        a.close()
        assert b.receive() == {"last": 1}
        for _ in range(2):
            with pytest.raises(ChannelClosed):
                b.receive()


def test_end_of_file_within_a_line_is_the_end():
    with pair() as (a, b):
        a.socket.sendall(b'{"half')
        a.close()
        with pytest.raises(ChannelClosed):
            b.receive(timeout=1)


def test_sending_to_nobody_is_the_end():
    with pair() as (a, b):
        b.close()
        with pytest.raises(ChannelClosed):
            a.send({"anybody": "there"})


def test_a_line_larger_than_the_sockets_buffer_arrives():
    with pair() as (a, b):
        big = {"text": "x" * (MAX_LINE // 2)}
        sender = threading.Thread(target=a.send, args=(big,))
        sender.start()
        assert b.receive(timeout=60) == big
        sender.join()


def test_a_line_without_end_is_cut_off():
    def flood(sock: socket.socket) -> None:
        try:
            while True:
                sock.sendall(b"x" * (1 << 16))
        except OSError:
            pass

    with pair() as (a, b):
        sender = threading.Thread(target=flood, args=(a.socket,))
        sender.start()
        with pytest.raises(ChannelClosed):
            b.receive(timeout=60)
        b.close()
        sender.join()


def test_open_files_come_along_in_order():
    with pair() as (a, b):
        ends = [os.pipe() for _ in range(3)]
        a.send({"first": 1}, [ends[0][0]])
        a.send({"none": 0})
        a.send({"others": 2}, [read for read, _ in ends[1:]])
        for read, _ in ends:
            os.close(read)  # what was sent stays open
        assert [list(b.receive(1)) for _ in range(3)] == [["first"], ["none"], ["others"]]
        for i, (_, write) in enumerate(ends):
            os.write(write, b"%d" % i)
            os.close(write)
        assert [os.read(fd, 9) for fd in b.fds] == [b"0", b"1", b"2"]
        for fd in b.fds:
            os.close(fd)
