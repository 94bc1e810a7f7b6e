"""What a sweep shows while it goes on: a bar with the time left, or a line now and then."""

import io

from rich.console import Console

from mavherd.gcs.sweep import terminal
from mavherd.gcs.sweep.terminal import SweepView

OVER = {"exit_code": 0, "collisions": 0}
HIT = {"exit_code": 1, "collisions": 2}
FAILED = {"exit_code": 3, "error": "x"}


def watch(monkeypatch, *, is_terminal):
    """Return a view, the clock that it looks at, and what it has written."""
    clock = [100.0]
    monkeypatch.setattr(terminal.time, "monotonic", lambda: clock[0])
    out = io.StringIO()
    console = Console(
        file=out,
        force_terminal=is_terminal,
        force_interactive=is_terminal,
        width=100,
        get_time=lambda: clock[0],
    )
    return SweepView(console), clock, out


def test_where_there_is_no_terminal_a_line_now_and_then_says_how_far_it_is(monkeypatch):
    view, clock, out = watch(monkeypatch, is_terminal=False)
    with view:
        view.begun(10, 400)
        for _ in range(10):
            clock[0] += 1.01
            view.ended([OVER, HIT])
            view.refresh()
        view.finished()
    assert out.getvalue().splitlines() == [
        "10 of 400 runs are done already",
        "30 of 400 runs, 2 a second, 0:03:07 left, 10 collided",
        "20 runs in 10.1 s, 1.98 a second",
    ]


def test_a_terminal_has_a_bar_with_the_time_left_and_what_was_counted(monkeypatch):
    view, clock, out = watch(monkeypatch, is_terminal=True)
    with view:
        view.begun(0, 100)
        for k in range(10):
            clock[0] += 2
            view.ended([HIT if k else FAILED])
            view.refresh()
    assert "10/100" in out.getvalue()
    assert "0:03:00" in out.getvalue()  # 90 runs, 2 s each
    assert "9 collided, 1 failed" in out.getvalue()


def test_runs_that_were_done_before_do_not_make_it_look_fast(monkeypatch):
    view, clock, out = watch(monkeypatch, is_terminal=True)
    with view:
        view.begun(900, 1000)
        for _ in range(10):
            clock[0] += 2
            view.ended([OVER])
            view.refresh()
    assert "910/1000" in out.getvalue()
    assert "0:03:00" in out.getvalue()


def test_a_grid_that_takes_long_to_check_is_told_without_a_terminal_too(monkeypatch):
    view, clock, out = watch(monkeypatch, is_terminal=False)
    with view:
        for points in range(1, 151):
            clock[0] += 0.125
            view.checked(points, 200)
    assert out.getvalue().splitlines() == [
        "checking the grid: 17 of 200 points, 0:00:23 left",
        "checking the grid: 97 of 200 points, 0:00:13 left",
    ]
