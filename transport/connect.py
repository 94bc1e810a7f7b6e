"""Where an external vehicle is reached: `tcp:HOST:PORT` and its like, read and explained."""

import re
from dataclasses import dataclass, field
from difflib import get_close_matches
from ipaddress import ip_address

from .errors import LinkError

FORMS = "tcp:HOST:PORT, udpin:HOST:PORT, udpout:HOST:PORT, serial:DEVICE[:BAUD]"
DEFAULT_BAUD = 57600  # of telemetry radios, and of PX4's and ArduPilot's TELEM1
_BAUD_RATES = range(300, 12_000_001)
_PORTS = range(1, 65536)
_EXAMPLES = {
    "tcp": "tcp:127.0.0.1:5760",
    "udpin": "udpin:127.0.0.1:14550",
    "udpout": "udpout:127.0.0.1:14580",
    "serial": f"serial:/dev/ttyUSB0:{DEFAULT_BAUD}",
}
_ELSEWHERE = {  # what MAVProxy, pymavlink and MAVSDK call the same
    "udp": "udpin",
    "udpbcast": "udpout",
    "tcpout": "tcp",
    "tcpclient": "tcp",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Address:
    """One end of a link to an external vehicle; two spellings of one place are equal."""

    text: str = field(compare=False)  # as errors and logs show it
    scheme: str  # tcp | udpin | udpout | serial
    host: str = ""
    port: int = 0
    device: str = ""
    baud: int = 0

    @property
    def loopback(self) -> bool:
        """Whether surely nothing but this machine is at the other end: a simulation."""
        if self.scheme == "serial":
            return False
        if self.host.lower() == "localhost":
            return True
        try:
            return ip_address(self.host).is_loopback
        except ValueError:
            return False  # a name: whoever answers to it


def parse_connect(text: str) -> Address:
    """Return the address in `text`; raise LinkError that names what is wrong and the cure."""
    scheme, colon, rest = text.strip().partition(":")
    name = scheme.lower()
    if not colon or name not in _EXAMPLES:
        raise LinkError(f"connect {text!r}: {_unknown(text.strip(), name, rest)}")
    if rest.startswith("//"):
        without = rest.removeprefix("//") if name != "serial" else "/" + rest.lstrip("/")
        raise LinkError(f"connect {text!r}: no slashes here (did you mean '{name}:{without}'?)")
    return _serial(text, rest) if name == "serial" else _network(text, name, rest)


def _network(text: str, scheme: str, rest: str) -> Address:
    host, colon, digits = rest.rpartition(":")
    example = _EXAMPLES[scheme]
    if not colon and not rest.isdecimal():
        raise LinkError(f"connect {text!r}: the port is missing (as in '{example}')")
    if not digits.isdecimal() or len(digits) > 5 or int(digits) not in _PORTS:
        raise LinkError(f"connect {text!r}: {digits!r} is no port (ports are 1..{_PORTS[-1]})")
    if not host:
        cure = f"'{scheme}:127.0.0.1:{digits}' for this machine"
        if scheme == "udpin":
            cure += f", '{scheme}:0.0.0.0:{digits}' for every network it is in"
        raise LinkError(f"connect {text!r}: the host is missing ({cure})")
    bare = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    if not re.fullmatch(r"[\w.-]+", bare) and not _is_ip6(bare):
        raise LinkError(f"connect {text!r}: {host!r} is no host (as in '{example}')")
    return Address(text=text.strip(), scheme=scheme, host=bare, port=int(digits))


def _serial(text: str, rest: str) -> Address:
    device, colon, digits = rest.rpartition(":")
    if not colon or not digits.isdecimal():  # names under /dev/serial/by-path hold colons
        device, digits = rest, str(DEFAULT_BAUD)
    if "," in device:
        device, _, digits = device.partition(",")
        cure = f"did you mean 'serial:{device}:{digits}'?"
        raise LinkError(f"connect {text!r}: the baud rate comes after a colon ({cure})")
    if not device:
        raise LinkError(f"connect {text!r}: the device is missing (as in '{_EXAMPLES['serial']}')")
    if len(digits) > 8 or int(digits) not in _BAUD_RATES:
        limits = f"{_BAUD_RATES[0]}..{_BAUD_RATES[-1]}"
        raise LinkError(f"connect {text!r}: {digits} is no baud rate ({limits})")
    return Address(text=text.strip(), scheme="serial", device=device, baud=int(digits))


def _unknown(text: str, scheme: str, rest: str) -> str:
    """Return what is wrong with an address whose scheme is none of ours, and what was meant."""
    if text.startswith(("/", "COM")):
        device, _, baud = text.replace(",", ":").partition(":")
        meant = f"serial:{device}:{baud or DEFAULT_BAUD}"
        return f"a device is written with its scheme (did you mean '{meant}'?)"
    if not rest or not scheme.isalnum() or scheme.isdecimal():
        meant = f"tcp:{text}" if rest.isdecimal() else _EXAMPLES["tcp"]
        listening = f"udpin:{text}" if rest.isdecimal() else _EXAMPLES["udpin"]
        return f"no scheme (did you mean '{meant}' or '{listening}'? Known: {FORMS})"
    if scheme == "tcpin":
        return "a vehicle is called, it does not call us over TCP (as in 'tcp:127.0.0.1:5760')"
    near = get_close_matches(scheme, _EXAMPLES, n=1)
    if meant := _ELSEWHERE.get(scheme) or (near[0] if near else ""):
        return f"unknown scheme {scheme!r} (did you mean '{meant}:{rest.removeprefix('//')}'?)"
    return f"unknown scheme {scheme[:20]!r} (known: {FORMS})"


def _is_ip6(host: str) -> bool:
    try:
        return ip_address(host).version == 6
    except ValueError:
        return False
