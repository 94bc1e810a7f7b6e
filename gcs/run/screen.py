"""Lines at the bottom of a terminal that are drawn over in place, and what is printed above them.

Not rich's Live: that one moves up by the lines it has drawn, which is wrong once the terminal has
wrapped them anew, and erases before it draws.
"""

from collections import deque
from collections.abc import Sequence
from typing import Any, NamedTuple

from rich.console import Console, RenderableType
from rich.text import Text

_KEPT = 60  # things printed above, for when all is drawn anew
_BEGIN, _END = "\x1b[?2026h\x1b[?25l", "\x1b[?25h\x1b[?2026l"  # shown at once, where that is known
_WIPE = "\x1b[H\x1b[K\n\x1b[J\x1b[H"  # not `2J`, by which some push the old lines into the history
_REST_OF_LINE, _BELOW = "\x1b[K", "\x1b[J"


class _Said(NamedTuple):
    what: RenderableType
    how: dict[str, Any]


class Screen:
    """Each change is one write, and no line is erased that is drawn again: nothing flickers.

    After a change of the terminal's size everything visible is drawn anew: the end of what was
    printed, then the lines. The cursor is never left hidden, whatever kills us.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._above: deque[_Said] = deque(maxlen=_KEPT)
        self._lines: list[str] = []  # on the screen now
        self._size = console.size

    def draw(self, lines: Sequence[Text]) -> None:
        """Show these lines, cropped to the terminal, instead of those before."""
        size = self._console.size
        lines = lines[: max(1, size.height - 1)]
        new = [self._cropped(line, size.width) for line in lines]
        if size != self._size:
            self._write(
                _WIPE + self._end_of_above(size.width, size.height - 1 - len(new)) + _drawn(new)
            )
        elif new != self._lines:
            self._write(self._up() + _drawn(new) + _BELOW)
        self._size, self._lines = size, new

    def print(self, what: RenderableType, **how: Any) -> None:
        """Print something above the lines; `how` as rich's `Console.print` takes it."""
        self._above.append(_Said(what, how))
        said = self._text(what, how).replace("\n", _REST_OF_LINE + "\n")
        self._write(self._up() + said + _drawn(self._lines) + _BELOW)

    def clear(self) -> None:
        """Take the lines away; what was printed stays."""
        if self._lines:
            self._write(self._up() + _BELOW)
        self._lines = []

    def _up(self) -> str:
        return f"\r\x1b[{len(self._lines)}A" if self._lines else ""

    def _cropped(self, line: Text, width: int) -> str:
        line = line.copy()
        line.truncate(width, overflow="ellipsis")
        return self._text(line, {"end": "", "no_wrap": True, "overflow": "ignore", "crop": False})

    def _text(self, what: RenderableType, how: dict[str, Any]) -> str:
        with self._console.capture() as capture:
            self._console.print(what, **how)
        return capture.get()

    def _end_of_above(self, width: int, room: int) -> str:
        """Return as many of the last lines above as fit into so many rows."""
        end: deque[str] = deque()
        lines = "".join(self._text(*said) for said in self._above).splitlines()
        for line in reversed(lines):
            room -= max(1, -(-Text.from_ansi(line).cell_len // width))
            if room < 0:
                break
            end.appendleft(line + "\n")
        return "".join(end)

    def _write(self, text: str) -> None:
        if not self._console.quiet:
            file = self._console.file
            file.write(_BEGIN + text + _END)
            file.flush()


def _drawn(lines: Sequence[str]) -> str:
    return "".join(f"{line}{_REST_OF_LINE}\n" for line in lines)
