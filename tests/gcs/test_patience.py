"""What takes long says what it is at; what does not, says nothing."""

import time
from io import StringIO

import pytest
from rich.console import Console

from mavherd.gcs.patience import Patience

LONG = 60.0
GONE = "\x1b[?25h\r\x1b[1A\x1b[2K"  # the cursor is back, the line is empty


def screen(*, terminal=False):
    return Console(file=StringIO(), force_terminal=terminal, width=60)


def shown(console, text):
    deadline = time.monotonic() + 20
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
