"""What tests of processes share: who our children are."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest


@pytest.fixture
def children() -> Callable[[], set[int]]:
    """Return our child processes, at this moment: children()."""

    def find() -> set[int]:
        found: set[int] = set()
        for thread in Path("/proc/self/task").iterdir():
            with suppress(FileNotFoundError, ProcessLookupError):  # one that has ended meanwhile
                found.update(map(int, (thread / "children").read_text().split()))
        return found

    return find
