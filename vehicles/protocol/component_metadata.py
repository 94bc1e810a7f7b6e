"""COMPONENT_METADATA: where ground stations find our metadata."""

from ...transport import extra_messages
from ...transport.extra_messages import COMPONENT_METADATA_ID as COMPONENT_METADATA
from ...transport.mavlink import Message

__all__ = ["COMPONENT_METADATA", "component_metadata"]


def component_metadata(boot_ms: int, uri: str, crc: int) -> Message:
    """Return COMPONENT_METADATA: at `uri` is a general.json whose checksum is `crc`.

    `boot_ms` is the time since boot; of `uri` 99 bytes are sent at most.
    """
    return extra_messages.component_metadata(boot_ms & 0xFFFFFFFF, crc, uri.encode()[:99])
