"""Keys come one by one and unseen, and the terminal is as it was before when they are no more."""

import os
import pty
import signal
import subprocess
import sys
import termios
from contextlib import contextmanager

import pytest

from mavherd.gcs.run.clock_control import ClockControl
from mavherd.gcs.run.keys import COMMANDS, Keys, keys_of_terminal, split_keys


@contextmanager
def terminal():
    """A terminal: where one types, and where a program reads."""
    ours, theirs = pty.openpty()
    try:
        yield ours, theirs
    finally:
        os.close(ours)
        os.close(theirs)


def test_keys_are_characters_and_escape_sequences():
    assert split_keys(" .\x1b[C+\x1bOC\x1b[1;5Cq\x1b") == [
        *(" ", ".", "\x1b[C", "+", "\x1bOC", "\x1b[1;5C", "q", "\x1b")
    ]
    assert split_keys("") == []


@pytest.mark.parametrize("command", sorted(set(COMMANDS.values())))
def test_every_key_is_a_command_that_the_clock_knows(command):
    ClockControl(0.05, None, wall=0.0).order(command, 0.0)


def test_without_a_terminal_there_are_no_keys(monkeypatch):
    for stream in (None, open(os.devnull)):  # noqa: SIM115, PTH123 - closed below
        monkeypatch.setattr(sys, "stdin", stream)
        assert keys_of_terminal() is None
        if stream:
            stream.close()
            assert keys_of_terminal() is None


def test_keys_are_needed_at_both_ends(monkeypatch):
    with terminal() as (_, theirs), os.fdopen(os.dup(theirs)) as stdin, open(os.devnull) as null:  # noqa: PTH123
        monkeypatch.setattr(sys, "stdin", stdin)
        monkeypatch.setattr(sys, "stderr", null)
        assert keys_of_terminal() is None
        monkeypatch.setattr(sys, "stderr", stdin)
        assert keys_of_terminal() is not None


def test_a_terminal_that_is_not_ours_is_left_alone():
    with terminal() as (ours, theirs):  # it is not the controlling terminal of this process
        before = termios.tcgetattr(theirs)
        with Keys(theirs) as keys:
            os.write(ours, b" \n")
            assert keys.pressed() == []
            assert termios.tcgetattr(theirs) == before


def test_the_handler_of_sigcont_is_put_back():
    before = signal.getsignal(signal.SIGCONT)
    with terminal() as (_, theirs), Keys(theirs):
        assert signal.getsignal(signal.SIGCONT) != before
    assert signal.getsignal(signal.SIGCONT) == before


READER = """
import sys
from mavherd.gcs.run.keys import keys_of_terminal

got = []
try:
    with keys_of_terminal() as keys:
        print("reads", flush=True)
        while "q" not in got:
            keys.wait(1.0)
            got += keys.pressed()
        if "!" in got:
            raise ZeroDivisionError
finally:
    print(got, flush=True)
"""


@pytest.mark.parametrize("end", ["q", "!q"])
def test_at_a_terminal_keys_come_one_by_one_without_an_echo(end):
    with terminal() as (ours, theirs):
        before = termios.tcgetattr(theirs)
        process = subprocess.Popen(
            ["setsid", "--ctty", "--wait", sys.executable, "-c", READER],
            stdin=theirs,
            stdout=subprocess.PIPE,
            stderr=theirs,
            text=True,
        )
        assert process.stdout.readline() == "reads\n"
        assert not termios.tcgetattr(theirs)[3] & (termios.ECHO | termios.ICANON)
        assert termios.tcgetattr(theirs)[3] & termios.ISIG  # Ctrl-C is Ctrl-C
        os.write(ours, b" \x1b[C" + end.encode())
        said, _ = process.communicate(timeout=60)
        assert said.strip() == str([" ", "\x1b[C", *end])
        assert termios.tcgetattr(theirs) == before
