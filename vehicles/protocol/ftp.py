"""A MAVLink FTP server of read-only files (mavlink.io/en/services/ftp.html), sans I/O.

Every request is answered at once, with a refusal when it cannot be granted. A repeated request
gets the same answer again, since none depends on what went before but on the open files. As with
ArduPilot the client chooses the numbers of its sessions, and each client has its own.
"""

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ...transport.mavlink import Message, mav
from .ftp_tree import FileTree, file_crc
from .service import Handler

_HEADER = struct.Struct("<HBBBBBxI")
_MAX_DATA = 239
_PAYLOAD = _HEADER.size + _MAX_DATA
_MAX_SESSIONS = 8  # open files on one link
_IDLE_S = 3.0  # of silence after which a session makes room for another
_DEAD_S = 20.0  # of silence after which it is closed
_PER_CALL = 20  # packets of bursts every 10 ms: some 480 kB/s

_ACK: int = mav.MAV_FTP_OPCODE_ACK
_NAK: int = mav.MAV_FTP_OPCODE_NAK
_WRITING = (
    mav.MAV_FTP_OPCODE_CREATEFILE,
    mav.MAV_FTP_OPCODE_WRITEFILE,
    mav.MAV_FTP_OPCODE_REMOVEFILE,
    mav.MAV_FTP_OPCODE_CREATEDIRECTORY,
    mav.MAV_FTP_OPCODE_REMOVEDIRECTORY,
    mav.MAV_FTP_OPCODE_OPENFILEWO,
    mav.MAV_FTP_OPCODE_TRUNCATEFILE,
    mav.MAV_FTP_OPCODE_RENAME,
)

Client = tuple[int, int]  # system id, component id


class Packet(NamedTuple):
    """What FILE_TRANSFER_PROTOCOL carries."""

    sequence: int
    session: int
    opcode: int
    size: int
    req_opcode: int = 0
    burst_complete: int = 0
    offset: int = 0
    data: bytes = b""

    @classmethod
    def unpack(cls, payload: bytes) -> "Packet":
        """Return the packet in a payload."""
        return cls._make((*_HEADER.unpack_from(payload), payload[_HEADER.size :]))

    def pack(self) -> bytes:
        """Return the whole payload, zeros where there is nothing."""
        return (_HEADER.pack(*self[:-1]) + self.data).ljust(_PAYLOAD, b"\0")


class FtpError(Exception):
    """A request that is refused, with one of MAV_FTP_ERR."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


@dataclass(slots=True)
class _Session:
    """An open file; its content is that of the moment it was opened."""

    content: bytes
    touched: float  # s since boot
    burst: Packet | None = None  # the request that is being answered, moved on


class FtpService:
    """Serves the files of `tree` on one link; `on_open` hears the path of each opened file."""

    def __init__(self, tree: FileTree, on_open: Callable[[str], None] = lambda path: None) -> None:
        self.handlers: Mapping[str, Handler] = {"FILE_TRANSFER_PROTOCOL": self._on_message}
        self._tree = tree
        self._on_open = on_open
        self._now = 0.0
        self._sessions: dict[tuple[Client, int], _Session] = {}
        self._operations: dict[int, Callable[[Packet, Client], bytes]] = {
            mav.MAV_FTP_OPCODE_NONE: lambda request, client: b"",
            mav.MAV_FTP_OPCODE_TERMINATESESSION: self._terminate,
            mav.MAV_FTP_OPCODE_RESETSESSION: self._reset,
            mav.MAV_FTP_OPCODE_LISTDIRECTORY: self._list,
            mav.MAV_FTP_OPCODE_OPENFILERO: self._open,
            mav.MAV_FTP_OPCODE_READFILE: self._read,
            mav.MAV_FTP_OPCODE_CALCFILECRC: self._checksum,
            mav.MAV_FTP_OPCODE_BURSTREADFILE: self._burst,
            **dict.fromkeys(_WRITING, _refuse_to_write),
        }

    @property
    def busy(self) -> bool:
        """Whether files are open, which are closed when nobody asks for them any more."""
        return bool(self._sessions)

    def due(self, now: float) -> list[Message]:
        """Return the next packets of the bursts under way."""
        self._now = now
        if not self._sessions:
            return []
        dead = [k for k, s in self._sessions.items() if now - s.touched > _DEAD_S]
        for key in dead:
            del self._sessions[key]
        out: list[Message] = []
        for (client, _), session in self._sessions.items():
            while session.burst and len(out) < _PER_CALL:
                out.append(self._answer(session.burst, client, self._burst))
        return out

    def _on_message(self, m: Message) -> list[Message]:
        request = Packet.unpack(bytes(m.payload))
        if request.opcode in (_ACK, _NAK):
            return []  # another server's answer
        client = m.get_srcSystem(), m.get_srcComponent()
        return [self._answer(request, client, self._operations.get(request.opcode, _unknown))]

    def _answer(
        self, request: Packet, client: Client, operation: Callable[[Packet, Client], bytes]
    ) -> Message:
        opcode = _ACK
        try:
            data = operation(request, client)
        except FtpError as error:
            opcode, data = _NAK, bytes((error.code,))
        is_burst = request.opcode == mav.MAV_FTP_OPCODE_BURSTREADFILE
        reply = Packet(
            sequence=(request.sequence + 1) & 0xFFFF,
            session=request.session,
            opcode=opcode,
            size=len(data),
            req_opcode=request.opcode,
            burst_complete=int(is_burst and opcode == _NAK),
            offset=request.offset,
            data=data,
        )
        return mav.MAVLink_file_transfer_protocol_message(0, *client, reply.pack())

    def _terminate(self, request: Packet, client: Client) -> bytes:
        self._sessions.pop((client, request.session), None)
        return b""

    def _reset(self, request: Packet, client: Client) -> bytes:
        self._sessions = {k: s for k, s in self._sessions.items() if k[0] != client}
        return b""

    def _list(self, request: Packet, client: Client) -> bytes:
        entries = self._tree.list(_path(request))
        if entries is None:
            raise FtpError(mav.MAV_FTP_ERR_FILENOTFOUND)
        listing = b""
        for name, size in entries[request.offset :]:
            line = f"D{name}\0" if size is None else f"F{name}\t{size}\0"
            if len(listing) + len(line) > _MAX_DATA:
                break
            listing += line.encode()
        if not listing:
            raise FtpError(mav.MAV_FTP_ERR_EOF)
        return listing

    def _open(self, request: Packet, client: Client) -> bytes:
        path = _path(request)
        self._make_room((client, request.session))
        content = self._content(path)
        self._sessions[client, request.session] = _Session(content, self._now)
        self._on_open(path)
        return len(content).to_bytes(4, "little")

    def _read(self, request: Packet, client: Client) -> bytes:
        session = self._sessions.get((client, request.session))
        if session is None:
            raise FtpError(mav.MAV_FTP_ERR_INVALIDSESSION)
        session.touched = self._now
        length = min(request.size, _MAX_DATA)
        data = session.content[request.offset : request.offset + length]
        if not data:
            raise FtpError(mav.MAV_FTP_ERR_EOF)
        return data

    def _checksum(self, request: Packet, client: Client) -> bytes:
        return file_crc(self._content(_path(request))).to_bytes(4, "little")

    def _burst(self, request: Packet, client: Client) -> bytes:
        """Return the first part of a burst, and have `due` go on from there until the end."""
        session = self._sessions.get((client, request.session))
        if session:
            session.burst = None
        data = self._read(request._replace(size=request.size or _MAX_DATA), client)
        if session:
            sequence = (request.sequence + 1) & 0xFFFF
            following = request.offset + len(data)
            session.burst = request._replace(sequence=sequence, offset=following)
        return data

    def _content(self, path: str) -> bytes:
        content = self._tree.read(path)
        if content is None:
            raise FtpError(mav.MAV_FTP_ERR_FILENOTFOUND)
        return content

    def _make_room(self, key: tuple[Client, int]) -> None:
        """Close the session that was idle longest, if there must be room for another one."""
        if key in self._sessions or len(self._sessions) < _MAX_SESSIONS:
            return
        stalest = min(self._sessions, key=lambda k: self._sessions[k].touched)
        if self._now - self._sessions[stalest].touched < _IDLE_S:
            raise FtpError(mav.MAV_FTP_ERR_NOSESSIONSAVAILABLE)
        del self._sessions[stalest]


def _path(request: Packet) -> str:
    if not 0 < request.size <= _MAX_DATA:
        raise FtpError(mav.MAV_FTP_ERR_INVALIDDATASIZE)
    name, _, _ = request.data[: request.size].partition(b"\0")
    return name.decode("ascii", errors="replace")


def _refuse_to_write(request: Packet, client: Client) -> bytes:
    raise FtpError(mav.MAV_FTP_ERR_FILEPROTECTED)


def _unknown(request: Packet, client: Client) -> bytes:
    raise FtpError(mav.MAV_FTP_ERR_UNKNOWNCOMMAND)
