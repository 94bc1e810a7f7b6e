"""What takes long says what it is at, and how far; what does not, says nothing."""

import time
from io import StringIO

import pytest
from rich.console import Console

from mavherd.gcs import patience
from mavherd.gcs.patience import Patience

LONG = 3600.0
GONE = "\x1b[?25h\r\x1b[1A\x1b[2K"  # the cursor is back, the line is empty


def screen(*, terminal=False):
    return Console(file=StringIO(), force_terminal=terminal, width=60)


def shown(console, text):
    deadline = time.monotonic() + 60
    while text not in console.file.getvalue():
        assert time.monotonic() < deadline, f"never shown: {text}"
        time.sleep(0.01)


def test_what_is_quick_says_nothing():
    console = screen()
    with Patience(console, wait_s=LONG) as step:
        step("reading")
        step("writing")
    assert console.file.getvalue() == ""


def test_without_a_terminal_each_step_has_a_line_from_the_one_that_takes_long():
    console = screen()
    with Patience(console, wait_s=0.05) as step:
        step("reading [all]")
        shown(console, "reading [all] ...\n")
        step("writing")
    assert console.file.getvalue() == "reading [all] ...\nwriting ...\n"


def test_at_a_terminal_there_is_one_line_that_goes_away():
    console = screen(terminal=True)
    with Patience(console, wait_s=0.05) as step:
        step("reading")
        shown(console, "reading")
        step("writing")
        shown(console, "writing")
    assert console.file.getvalue().endswith(GONE)


def fail(console):
    with Patience(console, wait_s=0.05) as step:
        step("reading")
        shown(console, "reading")
        raise ValueError("oh")


def test_an_error_ends_it_too():
    console = screen(terminal=True)
    with pytest.raises(ValueError, match="oh"):
        fail(console)
    assert console.file.getvalue().endswith(GONE)


@pytest.fixture
def clock(monkeypatch):
    class Clock:
        now = 100.0

        def monotonic(self):
            return self.now

    clock = Clock()
    monkeypatch.setattr(patience, "time", clock)
    return clock


@pytest.mark.parametrize("terminal", [True, False])
def test_what_is_over_in_two_seconds_says_nothing(clock, terminal):
    out = screen(terminal=terminal)
    with patience.Bar("converting", out) as bar:
        for k in range(19):
            clock.now = 100 + k / 10
            bar.reach(k / 20)
    assert out.file.getvalue() == ""


def test_without_a_terminal_a_line_comes_now_and_then_with_the_time_left(clock):
    out = screen(terminal=False)
    with patience.Bar("converting", out) as bar:
        for k in range(400):
            clock.now = 100 + k / 10
            bar.reach(k / 800)
    lines = out.file.getvalue().splitlines()
    assert len(lines) == 3
    assert lines[0] == "converting: 12%, 70 s left"


def test_at_a_terminal_a_bar_comes_and_goes(clock):
    out = screen(terminal=True)
    with patience.Bar("converting", out) as bar:
        for k in range(60):
            clock.now = 100 + k / 10
            bar.reach(k / 60)
    assert "converting" in out.file.getvalue()
    assert "95%" in out.file.getvalue()
