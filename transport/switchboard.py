"""Sorts what external vehicles send by system id, and answers each where it was heard.

Several vehicles may be behind one address: one UDP port that all of them send to, a router on
TCP. A vehicle is what sends heartbeats as component 1, an autopilot's; ground stations, gimbals
and radios on the same line are none.
"""

import socket
import time
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

from .connect import Address
from .errors import LinkError
from .lines import Line, open_line
from .links import Link
from .mavlink import AUTOPILOT_COMPONENT, Codec, Message, mav

FRESH_S = 3.0  # a vehicle heard longer ago is silent
ALONE_S = (
    2.2  # after which a second vehicle of the same id would have been heard: heartbeats at 1 Hz
)
_MAX_SOURCES = 4  # remembered for one system id
_ORDERLY = 8  # frames that a network may bring out of order
_JUMPS = 3  # of a sequence number within FRESH_S: two are counting


class Found(NamedTuple):
    """A vehicle that was heard: its heartbeat."""

    address: Address
    system_id: int
    mav_type: int
    autopilot: int
    source: str  # where it sends from


class _Voice:
    """One source that calls itself by one system id."""

    def __init__(self, link: Link) -> None:
        self.link = link
        self.at = 0.0  # of its newest heartbeat
        self.mav_type = self.autopilot = 0
        self._sequence = 0
        self._jumps = [-FRESH_S] * _JUMPS  # when the sequence number last went back

    def is_two(self, sequence: int, now: float) -> bool:
        """Return whether the sequence numbers of late are those of two senders in turn."""
        step = sequence - self._sequence & 0xFF
        self._sequence = sequence
        if not 128 <= step <= 256 - _ORDERLY:
            return False
        self._jumps = [*self._jumps[1:], now]
        return now - self._jumps[0] < FRESH_S


class _Trunk:
    """One line and who is heard on it."""

    def __init__(self, address: Address, line: Line) -> None:
        self.address = address
        self.line = line
        self.codec = Codec(254)  # it only reads
        self.names: dict[int, str] = {}  # wanted, by system id
        self.voices: dict[int, dict[str, _Voice]] = {}  # by system id and source
        self.holders: dict[int, _Voice] = {}  # whom we believe and answer
        self.heard_since: dict[int, float] = {}  # by system id: its first heartbeat
        self.doubled_at: dict[int, float] = {}  # when two sources were heard in turn
        self.is_spoken_on = False  # anything at all has arrived

    def read(self, now: float) -> Iterator[tuple[int, bytes]]:
        """Yield system id and frames of those whom we believe."""
        for link, data in self.line.receive():
            self.is_spoken_on = True
            parts: dict[int, list[bytes]] = {}
            for message, frame in self.codec.decode_frames(data, stream=link.stream):
                system = message.get_srcSystem()
                if _is_autopilot(message):
                    link.spoken = True
                    self._note(system, link, message, now)
                holder = self.holders.get(system)
                if system not in self.names or not holder or holder.link.label != link.label:
                    continue
                parts.setdefault(system, []).append(frame)
                if message.get_srcComponent() == AUTOPILOT_COMPONENT and holder.is_two(
                    message.get_seq(), now
                ):
                    self.doubled_at[system] = now
            for system, frames in parts.items():
                yield system, b"".join(frames)

    def fresh(self, system_id: int, now: float) -> list[str]:
        """Return the sources from which a system id was heard lately."""
        voices = self.voices.get(system_id, {})
        return [source for source, voice in voices.items() if now - voice.at < FRESH_S]

    def _note(self, system: int, link: Link, heartbeat: Message, now: float) -> None:
        self.heard_since.setdefault(system, now)
        voices = self.voices.setdefault(system, {})
        if link.label not in voices and len(voices) >= _MAX_SOURCES:
            del voices[min(voices, key=lambda source: voices[source].at)]
        voice = voices.setdefault(link.label, _Voice(link))
        others = [other for other in voices.values() if other is not voice]
        if any(other.at > voice.at > now - FRESH_S for other in others):
            self.doubled_at[system] = now  # heard, then the other, now again: not one that moved
        voice.link, voice.at = link, now
        voice.mav_type, voice.autopilot = heartbeat.type, heartbeat.autopilot
        holder = self.holders.get(system)
        if holder is None or now - holder.at > FRESH_S:
            self.holders[system] = voice
        if self.address.scheme == "udpin":
            self._evict(link, now)

    def _evict(self, link: Link, now: float) -> None:
        """Forget who has fallen silent at a source where somebody else speaks now."""
        for system, holder in list(self.holders.items()):
            if holder.link.label == link.label and now - holder.at > FRESH_S:
                del self.holders[system]


class Switchboard:
    """Connects names with vehicles behind addresses; lines are shared by those behind one.

    `receive` must be called a few times a second even if no socket is ready: it also mends lines.
    """

    def __init__(
        self,
        wanted: Mapping[str, tuple[Address, int]] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._clock = clock
        self._trunks: dict[Address, _Trunk] = {}
        self._wanted: dict[str, tuple[_Trunk, int]] = {}
        try:
            for name, (address, system_id) in (wanted or {}).items():
                self.want(name, address, system_id)
        except BaseException:
            self.close()
            raise

    def listen(self, address: Address) -> None:
        """Open a line to `address`, unless it is open; nobody is wanted there yet."""
        if address not in self._trunks:
            self._trunks[address] = _Trunk(address, open_line(address))

    def want(self, name: str, address: Address, system_id: int) -> None:
        """Have the vehicle of `system_id` behind `address` called `name` from now on."""
        self.listen(address)
        trunk = self._trunks[address]
        if other := trunk.names.get(system_id):
            raise LinkError(
                f"{address.text}: {other} and {name} are the same vehicle, system {system_id} there"
                " (give each its own system_id)"
            )
        trunk.names[system_id] = name
        self._wanted[name] = trunk, system_id

    def sockets(self) -> list[socket.socket]:
        """Return what to select on at this moment; lines come and go."""
        return [s for trunk in self._trunks.values() for s in trunk.line.sockets()]

    def receive(self) -> Iterator[tuple[str, bytes]]:
        """Yield names and whole frames of the vehicles wanted, without waiting."""
        now = self._clock()
        for trunk in self._trunks.values():
            for system_id, frames in trunk.read(now):
                yield trunk.names[system_id], frames

    def send(self, name: str, data: bytes) -> None:
        """Send whole frames to a vehicle.

        On a port where we listen: to where it was heard, nowhere before. Other lines have one
        end, whoever is there; `complaint` says whether it is the one wanted.
        """
        trunk, system_id = self._wanted[name]
        if trunk.address.scheme == "udpin":
            if holder := trunk.holders.get(system_id):
                holder.link.send(data)
            return
        for link in trunk.line.links():
            link.send(data)

    def call(self, data: bytes) -> None:
        """Send to every line's far end; a port where we listen has none before it speaks."""
        for trunk in self._trunks.values():
            if trunk.address.scheme != "udpin":
                for link in trunk.line.links():
                    link.send(data)

    def found(self) -> list[Found]:
        """Return every vehicle heard lately, wanted or not, by address and system id."""
        now = self._clock()
        return [
            Found(address, system_id, voice.mav_type, voice.autopilot, source)
            for address, trunk in self._trunks.items()
            for system_id, voices in sorted(trunk.voices.items())
            for source, voice in voices.items()
            if now - voice.at < FRESH_S
        ]

    @property
    def strangers(self) -> dict[Address, dict[int, str]]:
        """Whom nobody wants: address -> system id -> source, as heard lately."""
        found: dict[Address, dict[int, str]] = {address: {} for address in self._trunks}
        for one in self.found():
            if one.system_id not in self._trunks[one.address].names:
                found[one.address][one.system_id] = one.source
        return found

    @property
    def doubles(self) -> dict[Address, dict[int, list[str]]]:
        """Where two have one id: address -> system id -> sources, one if a router joins them."""
        now = self._clock()
        return {
            address: {
                system_id: sorted(trunk.voices[system_id])
                for system_id, at in trunk.doubled_at.items()
                if now - at < FRESH_S
            }
            for address, trunk in self._trunks.items()
        }

    def complaint(self, name: str) -> str:
        """Return why the vehicle behind an address is not, or not only, the one wanted.

        Empty as long as it is heard, and nobody else calls itself so: ALONE_S after its first
        heartbeat at the earliest.
        """
        trunk, wanted = self._wanted[name]
        now, where = self._clock(), trunk.address.text
        if trunk.line.problem:
            return f"{where}: {trunk.line.problem}{_cure(trunk)}"
        if sources := self.doubles[trunk.address].get(wanted):
            both = f"{' and '.join(sources)}; " if len(sources) > 1 else ""
            return (
                f"{where}: two vehicles call themselves system {wanted} "
                f"({both}give each its own: SYSID_THISMAV or MAV_SYS_ID)"
            )
        if trunk.fresh(wanted, now):
            is_sure = now - trunk.heard_since[wanted] >= ALONE_S
            return "" if is_sure else f"{where}: heard; listening for a second system {wanted}"
        if wanted in trunk.holders:
            silent = now - trunk.holders[wanted].at
            return f"{where}: system {wanted} has been silent for {silent:.0f} s"
        if others := self.strangers[trunk.address]:
            ids = " and ".join(map(str, others))
            answer = f"system {ids} answers" if len(others) == 1 else f"systems {ids} answer"
            return (
                f"{where}: {answer} here, the scenario wants {wanted} "
                f"(system_id: {next(iter(others))}, or SYSID_THISMAV/MAV_SYS_ID on the vehicle)"
            )
        return f"{where}: no vehicle is heard{_cure(trunk)}"

    def silences(self) -> list[str]:
        """Return of each address where no vehicle is heard why that may be."""
        now = self._clock()
        quiet = [t for t in self._trunks.values() if not any(t.fresh(s, now) for s in t.voices)]
        return [
            f"{t.address.text}: {t.line.problem or 'no vehicle is heard'}{_cure(t)}" for t in quiet
        ]

    def close(self) -> None:
        """Close every line."""
        for trunk in self._trunks.values():
            trunk.line.close()


def _is_autopilot(message: Message) -> bool:
    """Return whether a message is the heartbeat by which a vehicle is known."""
    return (
        message.get_type() == "HEARTBEAT"
        and message.get_srcComponent() == AUTOPILOT_COMPONENT
        and message.type != mav.MAV_TYPE_GCS
        and message.autopilot != mav.MAV_AUTOPILOT_INVALID
    )


def _cure(trunk: _Trunk) -> str:
    """Return what a user may look at when nobody is heard."""
    if trunk.codec.bad_bytes > 200 and not trunk.voices:
        wrong = f" of {trunk.address.baud}" if trunk.address.baud else ""
        return f" (bytes come, but no MAVLink: is the baud rate{wrong} right?)"
    if trunk.is_spoken_on and not trunk.voices:
        return " (MAVLink comes, but no heartbeat of an autopilot)"
    match trunk.address.scheme:
        case "udpin":
            return " (is it started, and does it send to this address and port?)"
        case "udpout" | "tcp":
            return " (is it started, and does it listen there?)"
    return ""
