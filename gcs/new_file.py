"""Files that have their name only when they are complete."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Yield the name to write to, `path` with `.part`, which becomes `path` when that went well.

    After an error, a full disk or Ctrl-C, nothing is left of it, and an older file stays.
    """
    part = path.with_name(path.name + ".part")
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file."""
    with new_file(path) as part:
        part.write_text(text, encoding="utf-8")
