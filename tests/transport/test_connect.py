"""An address says where a vehicle is, and a wrong one what was meant."""

import pytest

from mavherd.transport.connect import Address, parse_connect
from mavherd.transport.errors import LinkError


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("tcp:127.0.0.1:5760", ("tcp", "127.0.0.1", 5760, "", 0)),
        ("TCP:drone.local:5760", ("tcp", "drone.local", 5760, "", 0)),
        ("tcp:[::1]:5760", ("tcp", "::1", 5760, "", 0)),
        (" udpin:0.0.0.0:14550 ", ("udpin", "0.0.0.0", 14550, "", 0)),
        ("udpout:192.168.4.1:65535", ("udpout", "192.168.4.1", 65535, "", 0)),
        ("serial:/dev/ttyUSB0", ("serial", "", 0, "/dev/ttyUSB0", 57600)),
        ("serial:/dev/ttyACM0:115200", ("serial", "", 0, "/dev/ttyACM0", 115200)),
        (
            "serial:/dev/serial/by-path/pci-0:14.0-usb-0:2:1.0",
            ("serial", "", 0, "/dev/serial/by-path/pci-0:14.0-usb-0:2:1.0", 57600),
        ),
    ],
)
def test_an_address_is_read(text, expected):
    a = parse_connect(text)
    assert (a.scheme, a.host, a.port, a.device, a.baud) == expected
    assert a.text == text.strip()


def test_two_spellings_of_one_place_are_one_address():
    assert parse_connect("serial:/dev/ttyS0") == parse_connect("SERIAL:/dev/ttyS0:57600")
    assert parse_connect("tcp:127.0.0.1:5760") != parse_connect("tcp:127.0.0.1:5770")


@pytest.mark.parametrize(
    ("text", "cure"),
    [
        ("udp:127.0.0.1:14550", "unknown scheme 'udp' (did you mean 'udpin:127.0.0.1:14550'?)"),
        ("udp://127.0.0.1:14550", "did you mean 'udpin:127.0.0.1:14550'?"),
        ("udpbcast:192.168.1.255:14550", "did you mean 'udpout:192.168.1.255:14550'?"),
        ("tcp://127.0.0.1:5760", "no slashes here (did you mean 'tcp:127.0.0.1:5760'?)"),
        ("serial:///dev/ttyACM0:57600", "did you mean 'serial:/dev/ttyACM0:57600'?"),
        ("tpc:127.0.0.1:5760", "did you mean 'tcp:127.0.0.1:5760'?"),
        ("tcpin:0.0.0.0:5760", "as in 'tcp:127.0.0.1:5760'"),
        ("/dev/ttyUSB0", "did you mean 'serial:/dev/ttyUSB0:57600'?"),
        ("/dev/ttyUSB0,115200", "did you mean 'serial:/dev/ttyUSB0:115200'?"),
        ("serial:/dev/ttyUSB0,115200", "did you mean 'serial:/dev/ttyUSB0:115200'?"),
        ("COM3", "did you mean 'serial:COM3:57600'?"),
        ("127.0.0.1:5760", "did you mean 'tcp:127.0.0.1:5760' or 'udpin:127.0.0.1:5760'?"),
        ("bluetooth:00:11", "unknown scheme 'bluetooth' (known: tcp:HOST:PORT, "),
        ("", "no scheme"),
        ("tcp", "no scheme"),
        ("tcp:5760", "the host is missing ('tcp:127.0.0.1:5760' for this machine)"),
        ("udpin::14550", "'udpin:0.0.0.0:14550' for every network it is in"),
        ("tcp:127.0.0.1", "the port is missing (as in 'tcp:127.0.0.1:5760')"),
        ("tcp:localhost", "the port is missing"),
        ("tcp:127.0.0.1:", "'' is no port (ports are 1..65535)"),
        ("udpin:127.0.0.1:0", "'0' is no port"),
        ("udpin:127.0.0.1:65536", "'65536' is no port"),
        ("udpin:127.0.0.1:-1", "'-1' is no port"),
        ("tcp:two words:5760", "'two words' is no host"),
        ("tcp:fe80::zz:5760", "is no host"),
        ("serial:", "the device is missing (as in 'serial:/dev/ttyUSB0:57600')"),
        ("serial:/dev/ttyUSB0:57", "57 is no baud rate (300..12000000)"),
        ("serial:/dev/ttyUSB0:9999999999", "is no baud rate"),
    ],
)
def test_a_wrong_address_says_what_is_wrong_and_what_was_meant(text, cure):
    with pytest.raises(LinkError) as caught:
        parse_connect(text)
    assert str(caught.value).startswith(f"connect {text!r}: ")
    assert cure in str(caught.value)


@pytest.mark.parametrize(
    ("text", "inside"),
    [
        ("tcp:127.0.0.1:5760", True),
        ("tcp:127.8.9.1:5760", True),
        ("tcp:localhost:5760", True),
        ("tcp:LocalHost:5760", True),
        ("tcp:[::1]:5760", True),
        ("udpin:127.0.0.1:14550", True),
        ("udpin:0.0.0.0:14550", False),  # anybody may send there
        ("udpout:10.0.0.7:14550", False),
        ("tcp:127.evil.example:5760", False),
        ("serial:/dev/ttyUSB0", False),
    ],
)
def test_only_what_cannot_leave_this_machine_is_loopback(text, inside):
    assert parse_connect(text).loopback is inside


def test_an_address_may_be_made_by_hand():
    by_hand = Address(text="the lab's", scheme="udpin", host="127.0.0.1", port=14550)
    assert by_hand == parse_connect("udpin:127.0.0.1:14550")
