"""The files that MAVLink FTP serves: made when they are asked for, never read from a disk.

@PARAM/param.pck                      all parameters, packed as ArduPilot packs them
component_metadata/general.json       where the metadata are (mavlink.io, component metadata)
component_metadata/parameter.json     names, units, limits and texts of the parameters
"""

import json
from collections.abc import Callable, Mapping
from functools import cache
from typing import NamedTuple
from zlib import crc32

GENERAL = "component_metadata/general.json"
PARAMETER = "component_metadata/parameter.json"
PARAMETER_PACK = "@PARAM/param.pck"
GENERAL_URI = f"mftp:///{GENERAL}"

Query = Mapping[str, int]
"""What follows `?` in a path: `withdefaults=1&start=10`; what is no number is left out."""
Content = Callable[[Query], bytes]


class Entry(NamedTuple):
    """One line of a directory: a file and its bytes, or a directory (`size` None)."""

    name: str
    size: int | None


class FileTree:
    """Read-only files by their path from the root; there is nothing above the root."""

    def __init__(self, files: Mapping[str, Content]) -> None:
        self._files = {tuple(path.split("/")): content for path, content in files.items()}

    def read(self, path: str) -> bytes | None:
        """Return the content of a file, None when there is none such."""
        name, _, query = path.partition("?")
        content = self._files.get(_parts(name))
        return content(_parse(query)) if content else None

    def list(self, path: str) -> list[Entry] | None:
        """Return what is in a directory, None when there is none such."""
        above = _parts(path)
        depth = len(above)
        entries = []
        for parts, content in self._files.items():
            if parts[:depth] == above and len(parts) > depth:
                is_file = len(parts) == depth + 1
                entries.append(Entry(parts[depth], len(content({})) if is_file else None))
        return sorted(set(entries)) if entries or not above else None


def vehicle_files(parameter_pack: Content, parameter_metadata: Callable[[], bytes]) -> FileTree:
    """Return the files of a vehicle.

    `parameter_pack` is asked for `param.pck` as things are now (`withdefaults`, `start` and
    `count` in its query), `parameter_metadata` for `parameter.json`, once.
    """
    metadata = cache(parameter_metadata)

    @cache
    def general() -> bytes:
        parameters = {
            "type": 1,  # COMP_METADATA_TYPE_PARAMETER
            "uri": f"mftp:///{PARAMETER}",
            "fileCrc": file_crc(metadata()),
        }
        return json.dumps({"version": 1, "metadataTypes": [parameters]}).encode()

    return FileTree(
        {
            PARAMETER_PACK: parameter_pack,
            GENERAL: lambda query: general(),
            PARAMETER: lambda query: metadata(),
        }
    )


def file_crc(data: bytes) -> int:
    """Return MAVLink's CRC-32 of a file: the usual polynomial, from 0 and not inverted."""
    return crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


def _parts(path: str) -> tuple[str, ...]:
    return tuple(part for part in path.split("/") if part not in ("", "."))


def _parse(query: str) -> Query:
    pairs = (item.partition("=") for item in query.split("&"))
    return {key: int(value) for key, _, value in pairs if value.isascii() and value.isdecimal()}
