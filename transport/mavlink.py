"""MAVLink bytes to messages and back. The only module that imports pymavlink.

The generated dialect is used as it is (`mav`), without pymavlink's connection layer.
"""

from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from .message import Message

__all__ = ["AUTOPILOT_COMPONENT", "Codec", "Message", "datagrams", "mav"]

V1_MARKER = 0xFE
V2_MARKER = 0xFD
_V1_OVERHEAD = 8  # header 6, checksum 2
_V2_OVERHEAD = 12  # header 10, checksum 2
_SIGNATURE = 13
_SIGNED_FLAG = 0x01
_V1_LAST_ID = 255
_SIZES = {"char": 1, "float": 4, "double": 8} | {
    f"{sign}int{bits}_t": bits // 8 for sign in ("", "u") for bits in (8, 16, 32, 64)
}
_MAX_DATAGRAM = 1200  # bytes: fits every MTU, and MAVSDK's receive buffer of 2048

AUTOPILOT_COMPONENT: int = mav.MAV_COMP_ID_AUTOPILOT1


class Codec:
    """One end of one link: packs with its own ids and sequence, unpacks what arrives.

    It packs MAVLink 2, but MAVLink 1 for a peer of which nothing else was heard so far; what
    MAVLink 1 cannot carry (ids above 255, extension fields) is then left out.

    Garbage between frames, truncated frames and wrong checksums are skipped and counted in
    `bad_bytes`; frames that a sender's sequence numbers say are missing, in `lost`.
    """

    def __init__(self, system_id: int, component_id: int = AUTOPILOT_COMPONENT) -> None:
        self._mav = mav.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
        self._buffer = b""
        self._sequences: dict[tuple[int, int], int] = {}
        self._heard_v2 = False
        self.version = 2  # of MAVLink in what we pack
        self.bad_bytes = 0
        self.lost = 0

    def encode(self, messages: Iterable[Message]) -> bytes:
        """Return the frames of `messages`, in order."""
        return b"".join(self.frames(messages))

    def frames(self, messages: Iterable[Message]) -> list[bytes]:
        """Return one frame for each message that the peer's MAVLink can carry."""
        if self.version == 1:
            messages = [m for m in messages if m.get_msgId() <= _V1_LAST_ID]
            return [_as_v1(m, f) for m, f in zip(messages, self._pack(messages), strict=True)]
        return self._pack(messages)

    def _pack(self, messages: Iterable[Message]) -> list[bytes]:
        out = []
        for message in messages:
            out.append(message.pack(self._mav))
            self._mav.seq = (self._mav.seq + 1) & 0xFF
        return out

    def decode(self, data: bytes, *, stream: bool = True) -> list[Message]:
        """Return the messages in `data`.

        On a stream an incomplete frame waits for its rest; a datagram's is dropped.
        """
        return [message for message, _ in self.decode_frames(data, stream=stream)]

    def decode_frames(self, data: bytes, *, stream: bool = True) -> list[tuple[Message, bytes]]:
        """Return the messages in `data`, each with the bytes of its frame."""
        buffer = self._buffer + data if self._buffer else data
        out: list[tuple[Message, bytes]] = []
        at, end = 0, len(buffer)
        while at < end:
            length = _frame_length(buffer, at, end)
            if length == 0 or at + length > end:
                if length == 0 or not stream:
                    at += 1
                    self.bad_bytes += 1
                    continue
                break  # the rest is still to come
            frame = buffer[at : at + length]
            try:
                message = self._mav.decode(bytearray(frame))
            except mav.MAVError:
                message = None
            if message is None or message.get_msgId() < 0:
                # A message of another dialect (negative id) has a checksum that cannot be
                # verified: searched byte by byte like garbage, it cannot hide a good frame.
                at += 1
                self.bad_bytes += 1
                continue
            at += length
            if not self._heard_v2:
                self._heard_v2 = frame[0] == V2_MARKER
                self.version = 2 if self._heard_v2 else 1
            self._count(message)
            out.append((message, frame))
        self._buffer = buffer[at:]
        return out

    def _count(self, message: Message) -> None:
        sender = message.get_srcSystem(), message.get_srcComponent()
        sequence: int = message.get_seq()
        last = self._sequences.get(sender)
        if last == sequence:
            return  # the same frame twice
        if last is not None:
            self.lost += (sequence - last - 1) & 0xFF
        elif len(self._sequences) >= 256:
            self._sequences.clear()  # a flood of invented senders must not grow us
        self._sequences[sender] = sequence


def datagrams(data: bytes) -> Iterator[bytes]:
    """Cut frames into datagrams that every receiver takes whole; no frame is torn."""
    start, end = 0, len(data)
    while end - start > _MAX_DATAGRAM:
        at = start
        while length := _frame_length(data, at, end):
            if at + length - start > _MAX_DATAGRAM:
                break
            at += length
        if at == start:  # not a frame: ours to pass on, not to mend
            break
        yield data[start:at]
        start = at
    yield data[start:]


def _as_v1(message: Message, frame: bytes) -> bytes:
    """Return a MAVLink 2 frame as MAVLink 1: no trailing zeros cut off, no extension fields."""
    kind: Any = message.__class__
    length = _base_length(kind)
    payload = frame[10:-2].ljust(length, b"\0")[:length]
    body = bytes((length, *frame[4:8])) + payload  # length, sequence, system, component, id
    checksum: int = mav.x25crc(body + bytes((message.crc_extra,))).crc
    return b"\xfe" + body + checksum.to_bytes(2, "little")


@cache
def _base_length(kind: Any) -> int:
    """Return the payload bytes of a message without its extension fields.

    The dialect does not say where they begin, but `crc_extra`, by which two ends assure one
    another that they mean the same fields, is made of those before them only.
    """
    counts = range(len(kind.ordered_fieldnames), 0, -1)
    count = next((n for n in counts if _crc_extra(kind, n) == kind.crc_extra), counts[0])
    fields = list(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))[:count]
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    return sum(_SIZES[types[name]] * (array or 1) for name, array in fields)


def _crc_extra(kind: Any, count: int) -> int:
    """Return the `crc_extra` that a message of the first `count` fields would have."""
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    text = f"{kind.msgname} ".encode()
    for name, array in list(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))[:count]:
        text += f"{types[name]} {name} ".encode() + (bytes((array,)) if array else b"")
    crc: int = mav.x25crc(text).crc
    return crc & 0xFF ^ crc >> 8


def _frame_length(buffer: bytes, at: int, end: int) -> int:
    """Return the length of the frame that begins at `at`, 0 when none does.

    As long as the header is incomplete, any length beyond `end` says "wait".
    """
    marker = buffer[at]
    if marker == V2_MARKER:
        if at + 3 > end:
            return _V2_OVERHEAD
        flags = buffer[at + 2]
        if flags & ~_SIGNED_FLAG:
            return 0  # a flag we do not know changes the layout
        return buffer[at + 1] + _V2_OVERHEAD + (_SIGNATURE if flags else 0)
    if marker == V1_MARKER:
        return buffer[at + 1] + _V1_OVERHEAD if at + 2 <= end else _V1_OVERHEAD
    return 0
