"""Lines that are drawn over in place: as a terminal shows them, whatever its size becomes."""

import re
from io import StringIO

import pytest
from rich.console import Console
from rich.text import Text

from mavherd.gcs.run.screen import Screen

_CODE = re.compile(r"\x1b\[(\??)([0-9;]*)([A-Za-z])|(\n)|(\r)|([^\x1b\n\r]+)")


class Terminal:
    """As much of one as we use: it wraps, scrolls, and erases; old lines go into a history."""

    def __init__(self, width, height):
        self.width, self.height = width, height
        self.rows = [""]
        self.row = self.column = 0
        self.history = []

    def feed(self, data):
        for private, number, code, newline, home, text in _CODE.findall(data):
            if newline:
                self._down()
            elif home:
                self.column = 0
            elif text:
                self._type(text)
            elif not private:
                self._obey(code, int(number or 1))

    def resize(self, width, height):
        """Wrap every line anew and keep the cursor's line in sight, as most terminals do."""
        rows = []
        for row in self.rows:
            rows += [row[i : i + width] for i in range(0, max(1, len(row)), width)]
        self.width, self.height = width, height
        self.rows, self.row, self.column = rows, len(rows) - 1, 0
        self._scroll()

    def _type(self, text):
        for letter in text:
            if self.column == self.width:
                self._down()
            row = self.rows[self.row].ljust(self.column)
            self.rows[self.row] = row[: self.column] + letter + row[self.column + 1 :]
            self.column += 1

    def _down(self):
        self.row, self.column = self.row + 1, 0
        if self.row == len(self.rows):
            self.rows.append("")
        self._scroll()

    def _scroll(self):
        while len(self.rows) > self.height:
            self.history.append(self.rows.pop(0))
            self.row -= 1

    def _obey(self, code, number):
        match code:
            case "A":
                self.row = max(0, self.row - number)
            case "H":
                self.row = self.column = 0
            case "K":
                self.rows[self.row] = self.rows[self.row][: self.column]
            case "J":
                del self.rows[self.row + 1 :]
                self.rows[self.row] = self.rows[self.row][: self.column]
            case "m":
                pass
            case _:
                raise AssertionError(f"unknown code {code}")


class Bench:
    """A screen and the terminal that shows it."""

    def __init__(self, width=20, height=8):
        self.out = StringIO()
        self.console = Console(
            file=self.out, force_terminal=True, width=width, height=height, color_system=None
        )
        self.terminal = Terminal(width, height)
        self.terminal.feed("$ mavherd run\n")
        self.screen = Screen(self.console)

    def draw(self, *lines):
        self.screen.draw([Text(line) for line in lines])
        return self.visible()

    def visible(self):
        written = self.out.getvalue()
        self.out.seek(0)
        self.out.truncate()
        self.terminal.feed(written)
        return [row for row in self.terminal.rows if row]

    def resize(self, width, height):
        self.terminal.resize(width, height)
        self.console.size = width, height


def test_lines_are_drawn_over_in_place():
    bench = Bench()
    bench.draw("one", "two, long", "three")
    assert bench.draw("uno", "due") == ["$ mavherd run", "uno", "due"]
    assert bench.draw("I", "II", "III") == ["$ mavherd run", "I", "II", "III"]


def test_nothing_is_erased_that_is_drawn_again_and_each_change_is_one_whole():
    bench = Bench()
    bench.draw("one", "two")
    bench.screen.draw([Text("one"), Text("2")])
    written = bench.out.getvalue()
    assert written.startswith("\x1b[?2026h\x1b[?25l")
    assert written.endswith("\x1b[?25h\x1b[?2026l")
    assert written.index("2\x1b[K") < written.index("\x1b[J")


def test_what_has_not_changed_is_not_written():
    bench = Bench()
    bench.draw("one", "two")
    bench.screen.draw([Text("one"), Text("two")])
    assert bench.out.getvalue() == ""


def test_what_is_printed_stays_above():
    bench = Bench()
    bench.draw("one", "two")
    bench.screen.print("a problem")
    assert bench.visible() == ["$ mavherd run", "a problem", "one", "two"]
    bench.screen.clear()
    assert bench.visible() == ["$ mavherd run", "a problem"]


@pytest.mark.parametrize("size", [(9, 8), (20, 4), (7, 4), (40, 30)])
def test_another_size_leaves_no_line_of_before_on_the_screen(size):
    bench = Bench()
    bench.screen.print("ports")
    lines = "first line is long", "second line is long"
    bench.draw(*lines)
    bench.resize(*size)
    shown = bench.draw(*lines)
    width = size[0]
    cropped = [line if len(line) <= width else line[: width - 1] + "…" for line in lines]
    assert shown == ["ports", *cropped]
    bench.resize(20, 8)
    assert bench.draw("third") == ["ports", "third"]


def test_of_what_was_printed_the_last_that_fits_is_printed_again():
    bench = Bench(20, 8)
    for text in ("one", "two", "three, which is long indeed", "four"):
        bench.screen.print(text, soft_wrap=True)
    bench.draw("line")
    bench.resize(10, 6)
    assert bench.draw("line") == ["three, whi", "ch is long", " indeed", "four", "line"]


def test_no_more_is_drawn_than_there_is_room_for():
    bench = Bench(20, 4)
    assert bench.draw("1", "2", "3", "4", "5") == ["1", "2", "3"]
    assert bench.terminal.history == ["$ mavherd run"]
