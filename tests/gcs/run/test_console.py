"""What is said to a person goes to whatever stderr is, and never ends a command."""

import os
import pty
import sys

import pytest

from mavherd.gcs.run.console import QuietConsole


@pytest.fixture
def stderr(monkeypatch):
    """Make stderr what is opened at a path or a file descriptor."""
    opened = []

    def become(where):
        opened.append(open(where, "w"))  # noqa: PTH123, SIM115 - a descriptor too
        monkeypatch.setattr(sys, "stderr", opened[-1])

    yield become
    monkeypatch.undo()
    for file in opened:
        try:
            file.close()
        except OSError:  # full
            os.close(os.open(os.devnull, os.O_RDONLY))


@pytest.mark.parametrize(("term", "interactive"), [("xterm", True), ("dumb", False)])
def test_live_output_is_for_terminals_that_can_move_their_cursor(
    stderr, monkeypatch, term, interactive
):
    monkeypatch.setenv("TERM", term)
    far, near = pty.openpty()
    stderr(near)
    assert QuietConsole().is_interactive is interactive
    os.close(far)


def test_colours_that_are_forced_make_no_terminal(stderr, monkeypatch, tmp_path):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    stderr(tmp_path / "log")
    console = QuietConsole()
    console.print("[red]red[/red]")
    assert not console.is_interactive
    assert (tmp_path / "log").read_text() == "\x1b[31mred\x1b[0m\n"


def test_a_stderr_that_is_full_ends_nothing(stderr):
    stderr("/dev/full")
    console = QuietConsole()
    for _ in range(2000):
        console.print("one more line")


def test_no_stderr_at_all_is_no_terminal(monkeypatch):
    monkeypatch.setattr(sys, "stderr", None)
    console = QuietConsole()
    console.print("to nobody")
    assert not console.is_interactive
