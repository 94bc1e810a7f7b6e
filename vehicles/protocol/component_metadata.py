"""COMPONENT_METADATA: where ground stations find our metadata.

pymavlink's dialect lacks this message of common.xml, so it is declared here as the dialect
declares its own.
"""

import struct

from ...transport.mavlink import Message, mav

COMPONENT_METADATA = 397


class _Metadata(mav.MAVLink_message):  # type: ignore[misc] # the dialect is not typed
    id = COMPONENT_METADATA
    msgname = "COMPONENT_METADATA"
    fieldnames = ("time_boot_ms", "file_crc", "uri")
    ordered_fieldnames = fieldnames
    fieldtypes = ("uint32_t", "uint32_t", "char")
    array_lengths = (0, 0, 100)
    crc_extra = 182
    unpacker = struct.Struct("<II100s")

    def __init__(self, time_boot_ms: int, file_crc: int, uri: bytes) -> None:
        super().__init__(self.id, self.msgname)
        self._fieldnames = list(self.fieldnames)
        self.time_boot_ms, self.file_crc, self.uri = time_boot_ms, file_crc, uri

    def pack(self, link: object, force_mavlink1: bool = False) -> bytes:
        payload = self.unpacker.pack(self.time_boot_ms, self.file_crc, self.uri)
        frame: bytes = self._pack(link, self.crc_extra, payload, force_mavlink1=force_mavlink1)
        return frame


def component_metadata(boot_ms: int, uri: str, crc: int) -> Message:
    """Return COMPONENT_METADATA: at `uri` is a general.json whose checksum is `crc`.

    `boot_ms` is the time since boot; of `uri` 99 bytes are sent at most.
    """
    return _Metadata(boot_ms & 0xFFFFFFFF, crc, uri.encode()[:99])
