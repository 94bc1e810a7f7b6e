"""MAVLink bytes to messages and back, without pymavlink's connection layer.

`mav` is the dialect: the classes of its messages, its enums and its constants.
"""

import struct
from collections.abc import Iterable, Iterator
from typing import Any, Final

from fastcrc.crc16 import mcrf4xx

from .dialect import form_numbered, form_of, mav
from .form import Form, base_size
from .message import Message

__all__ = ["AUTOPILOT_COMPONENT", "Codec", "Message", "datagrams", "mav"]

V1_MARKER: Final = 0xFE
V2_MARKER: Final = 0xFD
_V1_OVERHEAD: Final = 8  # header 6, checksum 2
_V2_OVERHEAD: Final = 12  # header 10, checksum 2
_SIGNATURE: Final = 13
_SIGNED_FLAG: Final = 0x01
_V1_LAST_ID: Final = 255
# Headers without the marker, which the checksum leaves out
_V1_HEADER: Final = struct.Struct("<BBBBB")
_V2_HEADER: Final = struct.Struct("<BBBBBBHB")
_MAX_SENDERS: Final = 256
_MAX_DATAGRAM: Final = 1200  # bytes: fits every MTU, and MAVSDK's receive buffer of 2048

AUTOPILOT_COMPONENT: int = mav.MAV_COMP_ID_AUTOPILOT1

_forms: dict[Any, Form] = {}  # by class, of those that were sent
_forms_by_number: dict[int, Form] = {}  # of those that were heard


class Codec:
    """One end of one link: packs with its own ids and sequence, unpacks what arrives.

    It packs MAVLink 2, but MAVLink 1 for a peer of which nothing else was heard so far; what
    MAVLink 1 cannot carry (ids above 255, extension fields) is then left out.

    Garbage between frames, truncated frames and wrong checksums are skipped and counted in
    `bad_bytes`; frames that a sender's sequence numbers say are missing, in `lost`.
    """

    def __init__(self, system_id: int, component_id: int = AUTOPILOT_COMPONENT) -> None:
        self.system_id = system_id
        self.component_id = component_id
        self.sequence = 0  # of the next frame
        self.version = 2  # of MAVLink in what we pack
        self.bad_bytes = 0
        self.lost = 0
        self._buffer = b""
        self._expected: dict[int, int] = {}  # the next sequence number of each sender
        self._heard_v2 = False

    def encode(self, messages: Iterable[Message]) -> bytes:
        """Return the frames of `messages`, in order."""
        return b"".join(self.frames(messages))

    def frames(self, messages: Iterable[Message]) -> list[bytes]:
        """Return one frame for each message that the peer's MAVLink can carry."""
        if self.version == 1:
            messages = [m for m in messages if _form_of(m).number <= _V1_LAST_ID]
            return [self._frame_v1(message) for message in messages]
        return [self._frame(message) for message in messages]

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
            message = self._read(frame)
            if message is None:
                # A message of another dialect has a checksum that cannot be verified: searched
                # byte by byte like garbage, it cannot hide a good frame.
                at += 1
                self.bad_bytes += 1
                continue
            at += length
            out.append((message, frame))
        self._buffer = buffer[at:]
        return out

    def _frame(self, message: Message) -> bytes:
        """Return a frame of MAVLink 2: the zeros at the end of the payload are cut off."""
        form = _forms.get(message.__class__) or _form_of(message)
        payload = form.pack(message).rstrip(b"\0") or b"\0"
        sequence, number = self.sequence, form.number
        self.sequence = (sequence + 1) & 0xFF
        start = _V2_HEADER.pack(
            len(payload),
            0,
            0,
            sequence,
            self.system_id,
            self.component_id,
            number & 0xFFFF,
            number >> 16,
        )
        body = start + payload
        checksum: int = mcrf4xx(body + form.crc_extra)
        return b"\xfd" + body + checksum.to_bytes(2, "little")

    def _frame_v1(self, message: Message) -> bytes:
        """Return a frame of MAVLink 1: no zeros are cut off, and extension fields are."""
        form = _form_of(message)
        payload, size = form.pack(message), base_size(form.kind)
        sequence = self.sequence
        self.sequence = (sequence + 1) & 0xFF
        start = _V1_HEADER.pack(size, sequence, self.system_id, self.component_id, form.number)
        body = start + payload[:size]
        checksum: int = mcrf4xx(body + form.crc_extra)
        return b"\xfe" + body + checksum.to_bytes(2, "little")

    def _read(self, frame: bytes) -> Message | None:
        """Return the message in a frame of the right length, None when it is not a good one."""
        size = frame[1]
        if frame[0] == V2_MARKER:
            start, sequence, system, component = 10, frame[4], frame[5], frame[6]
            number = frame[7] | frame[8] << 8 | frame[9] << 16
        else:
            start, sequence, system, component, number = 6, frame[2], frame[3], frame[4], frame[5]
        form = _forms_by_number.get(number)
        if form is None:
            form = form_numbered(number)
            if form is None:
                return None
            _forms_by_number[number] = form
        stop = start + size
        if mcrf4xx(frame[1:stop] + form.crc_extra) != frame[stop] | frame[stop + 1] << 8:
            return None
        if not self._heard_v2:
            self._heard_v2 = start == 10
            self.version = 2 if self._heard_v2 else 1
        sender = system << 8 | component
        if self._expected.get(sender) != sequence:
            self._count_lost(sender, sequence)
        self._expected[sender] = (sequence + 1) & 0xFF
        if size < form.size:
            payload = frame[start:stop].ljust(form.size, b"\0")
            return form.read(payload, 0, system, component, sequence)
        return form.read(frame, start, system, component, sequence)

    def _count_lost(self, sender: int, sequence: int) -> None:
        expected = self._expected.get(sender)
        if expected is None:
            if len(self._expected) >= _MAX_SENDERS:
                self._expected.clear()  # a flood of invented senders must not grow us
            return
        gap = (sequence - expected) & 0xFF
        if gap != 0xFF:  # the same frame twice
            self.lost += gap


def _form_of(message: Message) -> Form:
    kind = message.__class__
    form = _forms.get(kind)
    if form is None:
        form = _forms[kind] = form_of(kind)
    return form


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
