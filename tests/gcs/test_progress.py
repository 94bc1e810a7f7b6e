"""What takes long shows how far it is; what does not, says nothing."""

from io import StringIO

import pytest
from rich.console import Console

from mavherd.gcs import progress


@pytest.fixture
def clock(monkeypatch):
    class Clock:
        now = 100.0

        def monotonic(self):
            return self.now

    clock = Clock()
    monkeypatch.setattr(progress, "time", clock)
    return clock


def console(*, terminal):
    return Console(file=StringIO(), force_terminal=terminal, width=80)


@pytest.mark.parametrize("terminal", [True, False])
def test_what_is_over_in_two_seconds_says_nothing(clock, terminal):
    out = console(terminal=terminal)
    with progress.Bar("converting", out) as bar:
        for k in range(19):
            clock.now = 100 + k / 10
            bar.reach(k / 20)
    assert out.file.getvalue() == ""


def test_without_a_terminal_a_line_comes_now_and_then_with_the_time_left(clock):
    out = console(terminal=False)
    with progress.Bar("converting", out) as bar:
        for k in range(400):
            clock.now = 100 + k / 10
            bar.reach(k / 800)
    lines = out.file.getvalue().splitlines()
    assert len(lines) == 3
    assert lines[0] == "converting: 12%, 70 s left"


def test_at_a_terminal_a_bar_comes_and_goes(clock):
    out = console(terminal=True)
    with progress.Bar("converting", out) as bar:
        for k in range(60):
            clock.now = 100 + k / 10
            bar.reach(k / 60)
    assert "converting" in out.file.getvalue()
    assert "95%" in out.file.getvalue()
