"""The launcher shows the team a few times a second, and at once what somebody has asked for."""

from io import StringIO

import pytest
from rich.console import Console

from mavherd.gcs.run import live_view, showing
from mavherd.gcs.run.clock_control import ClockControl
from mavherd.gcs.run.showing import Showing
from mavherd.gcs.run.terminal import RunView
from mavherd.gcs.run.view import Unseen
from mavherd.scenarios.loader import load_scenario


class Witness(Unseen):
    """A view that keeps when it was shown what."""

    def __init__(self):
        self.seen = []

    def update(self, now, states, going):
        self.seen.append((now, going.clock))


@pytest.fixture
def wall(monkeypatch):
    """A wall clock that stands until it is moved."""
    now = [100.0]
    for module in (showing, live_view):
        monkeypatch.setattr(module, "monotonic", lambda: now[0])
    return now


def test_what_goes_on_is_shown_four_times_a_second_and_what_stands_once(wall):
    view = Witness()
    show = Showing(view, list)
    control = ClockControl(0.05, None, wall=wall[0])
    for _ in range(16):
        show.show_paced(control, at_once=False)
        wall[0] += 0.125
    assert len(view.seen) == 8
    control.order("pause", wall[0])
    for _ in range(24):
        show.show_paced(control, at_once=False)
        wall[0] += 0.125
    assert [clock for _, clock in view.seen[8:]] == ["paused"] * 3


def test_a_step_is_shown_when_it_is_done(wall):
    view = Witness()
    show = Showing(view, list)
    control = ClockControl(0.05, None, paused=True, wall=wall[0])
    show.show_paced(control, at_once=False)
    control.order("step", wall[0])
    show.show_paced(control, at_once=True)
    control.ticked(0.05, wall[0])
    for _ in range(3):
        show.show_paced(control, at_once=False)
    assert view.seen == [(0.0, "paused"), (0.0, "paused"), (0.05, "paused")]


def test_an_order_is_on_the_screen_at_once(wall):
    screen = Console(file=StringIO(), force_terminal=True, width=80, height=24)
    control = ClockControl(0.05, None, wall=wall[0])
    with RunView(load_scenario("one-rover"), screen) as view:
        show = Showing(view, list)
        show.show_paced(control, at_once=False)
        wall[0] += 0.01
        control.order("pause", wall[0])
        show.show_paced(control, at_once=True)
        assert "paused" in screen.file.getvalue()
