"""The terminal shows each robot, the worst of many, and a verdict; nothing reaches stdout."""

from io import StringIO
from math import dist
from pathlib import Path
from random import Random

import pytest
from rich.console import Console
from rich.text import Text

from mavherd.gcs.mode_names import mode_name
from mavherd.gcs.report.judge import judge
from mavherd.gcs.report.report import RunFacts, build_report
from mavherd.gcs.report.summary import summary_table
from mavherd.gcs.run import live_view
from mavherd.gcs.run.live_view import LiveView
from mavherd.gcs.run.team_text import WORST_ROWS, Scene, nearest, phases
from mavherd.gcs.run.terminal import RunView
from mavherd.scenarios.schema import Expect, Goto, Point, RobotSpec, Scenario
from mavherd.transport.wire import Phase, VehicleState


def state(name, position=(0.0, 0.0, 0.0), mode=15, phase=Phase.ACTIVE, armed=True):
    level = (1.0, 0.0, 0.0, 0.0)
    return VehicleState(name, 1, 0, 0.0, position, (0.3, 0.4, 0.0), level, mode, armed, phase)


def console(*, terminal, width=80, height=24):
    return Console(file=StringIO(), force_terminal=terminal, width=width, height=height)


@pytest.fixture
def clock(monkeypatch):
    """A wall clock that stands until it is moved."""
    now = [100.0]
    monkeypatch.setattr(live_view, "monotonic", lambda: now[0])
    return now


def screen(states, *, targets=None, troubled=(), width=80, height=24, clock="", hint=""):
    out = console(terminal=True, width=width, height=height)
    kinds = {s.name: "rover" for s in states}
    with LiveView(kinds, 60.0, out, hint) as view:
        view.update(12.5, Scene(states, targets or {}, troubled), 3.2, "all ready", clock)
        return Text.from_ansi(out.file.getvalue()).plain


def rows(text, states):
    """Return the names that have a line of their own."""
    return [name for line in text.splitlines() for name in [line.split(" ")[0]] if name in states]


def test_a_robot_is_shown_with_mode_phase_place_speed_and_neighbour(clock):
    text = screen([state("r1"), state("r2", (3.0, 4.0, 0.0))], targets={"r1": 7.25})
    line = next(row for row in text.splitlines() if "r1" in row and "GUIDED" in row)
    for part in ("GUIDED", "active", "0.50", "7.25", "5.00 r2"):
        assert part in line
    assert "12.5 / 60 s" in text
    assert "3.2x real time" in text
    assert "all ready" in text


def test_what_was_asked_of_the_clock_and_what_keys_do_is_shown(clock):
    lines = screen([state("r1")], clock="paused", hint="q quit").splitlines()
    assert lines[0].endswith("60 s   3.2x real time   paused")
    assert lines[-1] == "q quit"


def test_names_of_neighbours_are_whole_at_80_columns(clock):
    text = screen([state("rover-11"), state("rover-12", (130.25, -40.0, 0.0))])
    assert "136.25 rover-12" in text or "136.26 rover-12" in text


def test_a_disarmed_robot_is_shown_as_such(clock):
    assert "disarmed" in screen([state("r1", armed=False)])


def test_a_team_taller_than_the_terminal_folds_to_its_worst_and_a_count(clock):
    states = [state(f"r{i:02d}", (5.0 * i, 0.0, 0.0)) for i in range(50)]
    states[30] = state("r30", (5 * 29 + 0.9, 0.0, 0.0))  # nearly touches r29
    text = screen(states, height=15)
    names = {s.name for s in states}
    shown = rows(text, names)
    assert {"r29", "r30"} < set(shown)
    assert f"and {50 - len(shown)} more, farther from trouble" in text
    assert " 50 rovers: 50 active   nearest 0.90 m" in text
    assert len(text.splitlines()) == 14  # and one for what comes after the view


@pytest.mark.parametrize("count", [30, 100, 240])
def test_many_robots_fit_a_small_terminal(clock, count):
    states = [state(f"quadcopter-{i:03d}", (99.0 * i, 0.0, 0.0)) for i in range(count)]
    lines = screen(states, clock="speed 0.05", hint="keys").splitlines()
    assert len(lines) < 24
    assert max(map(len, lines)) <= 80
    assert len(rows("\n".join(lines), {s.name for s in states})) == WORST_ROWS


def test_a_large_terminal_does_not_show_every_one_of_a_hundred(clock):
    states = [state(f"r{i}", (5.0 * i, 0.0, 0.0)) for i in range(100)]
    assert len(rows(screen(states, height=200), {s.name for s in states})) == WORST_ROWS


def test_a_robot_of_which_something_was_said_is_among_the_worst(clock):
    states = [state(f"r{i:02d}", (1.0 * i**2, 0.0, 0.0)) for i in range(50)]
    names = {s.name for s in states}
    assert "r49" not in rows(screen(states), names)
    assert "r49" in rows(screen(states, troubled={"r49"}), names)


def test_without_a_terminal_a_plain_line_comes_every_five_seconds(clock):
    out = console(terminal=False)
    with LiveView({"r1": "rover", "r2": "rover"}, 60.0, out) as view:
        for second in range(12):
            clock[0] = 100.0 + second
            team = [state("r1"), state("r2", (3.0, 4.0, 0.0))]
            view.update(second, Scene(team, {}), 1.0, "go [on]")
    lines = out.file.getvalue().splitlines()
    assert len(lines) == 3
    assert " ".join(lines[1].split()) == "5.0 s 1.0x 2 active nearest 5.00 m go [on]"
    assert "\x1b" not in out.file.getvalue()


def test_a_screen_is_drawn_whenever_there_is_something_to_show(clock):
    out = console(terminal=True)
    with LiveView({"r1": "rover"}, 60.0, out) as view:
        view.update(0.0, Scene([state("r1")], {}), 1.0)
        view.update(0.0, Scene([state("r1")], {}), 1.0, clock="paused")
        assert "paused" in out.file.getvalue()


def test_nearest_is_mutual_and_in_space():
    near = nearest([state("a"), state("b", (0.0, 3.0, 4.0)), state("c", (0.0, 3.0, 5.5))])
    assert near == {"a": (5.0, "b"), "b": (1.5, "c"), "c": (1.5, "b")}
    assert nearest([state("a")]) == {}


@pytest.mark.parametrize("shape", [(20.0, 20.0, 3.0), (0.0, 50.0, 0.0), (50.0, 0.0, 9.0)])
def test_nearest_of_many_is_as_if_all_were_compared(shape):
    draw = Random(5)
    team = [state(f"r{i}", tuple(draw.uniform(0, s) for s in shape)) for i in range(60)]
    for name, (apart, other) in nearest(team).items():
        (me,) = (s for s in team if s.name == name)
        all_others = [(dist(me.position, s.position), s.name) for s in team if s is not me]
        assert (apart, other) == min(all_others)


def test_phases_are_counted_in_the_order_of_a_mission():
    team = [state("a", phase=Phase.DONE), state("b"), state("c", phase=Phase.DONE)]
    assert phases(team) == "1 active, 2 done"


@pytest.mark.parametrize(
    ("kind", "number", "name"),
    [
        ("quadcopter", 4, "GUIDED"),
        ("rover", 4, "HOLD"),
        ("rover", 15, "GUIDED"),
        ("quadcopter", 9, "LAND"),
        ("quadcopter", 17, "BRAKE"),
        ("quadcopter", 0, "STABILIZE"),
        ("rover", 99, "MODE 99"),
        ("quadcopter", 6 << 16, "OFFBOARD"),
        ("rover", 4 << 16 | 3 << 24, "HOLD"),
    ],
)
def test_modes_are_called_as_ground_stations_call_them(kind, number, name):
    assert mode_name(kind, number) == name


@pytest.fixture
def scenario():
    specs = tuple(
        RobotSpec(
            name=f"r{i}",
            kind="rover",
            system_id=i,
            start=Point(0, 0),
            path=Goto(target=Point(3, 4)),
        )
        for i in (1, 2)
    )
    return Scenario(name="pair", robots=specs, expect=Expect(collisions=0, all_arrive_within_s=5))


def test_the_run_view_measures_the_way_to_go_and_keeps_the_last_event(scenario, clock):
    out = console(terminal=True)
    ports = {"r1": {"system_id": 1, "udp": ["127.0.0.1:14550"], "tcp": None}, "zenoh": "tcp/x"}
    with RunView(scenario, out) as view:
        view.started(Path("runs/pair-1"), ports)
        view.event({"t": 1.0, "vehicle": "r1", "kind": "phase", "text": "active"})
        view.update(1.0, [state("r1")], 2.0)
    text = out.file.getvalue()
    assert "127.0.0.1:14550" in text
    assert "5.00" in text
    assert "r1: active" in text


def summary(scenario, tracks, **changes):
    verdict = judge(scenario, scenario.robots, tracks, 0.0, 20.0)
    values = {"run_id": "pair-1", "seed": 3, "law": "safe", "lockstep": True, "speed": None}
    values |= {"duration_s": 20.0, "wall_s": 2.0, "real_time_factor": 10.0, "digest": "c0ffee" * 9}
    out = console(terminal=False)
    report = build_report(scenario, verdict, RunFacts(**values | changes))
    out.print(summary_table(report, Path("runs/pair-1")))
    return out.file.getvalue()


def test_the_summary_of_a_good_run_says_pass_and_where_to_look(scenario, track):
    tracks = [track("r1", "rover", 1, lambda t: (3, 4, 0))]
    one = Scenario(name="pair", robots=scenario.robots[:1], expect=scenario.expect)
    text = summary(one, tracks)
    assert "PASS" in text
    assert "no collision: none" in text
    assert "collisions 0" in text
    assert "(10.0x)" in text
    assert "digest c0ffee" in text
    assert "runs/pair-1/report.html" in text


def test_the_summary_of_a_bad_run_says_what_failed(scenario, track):
    tracks = [
        track("r1", "rover", 1, lambda t: (0, 0, 0)),
        track("r2", "rover", 2, lambda t: (0.5, 0, 0)),
    ]
    text = summary(scenario, tracks, error="r2 died", exit_code=3, partial=True, late_ticks=4)
    for part in ("FAIL", "no collision: 1", "did not", "partial", "4 of 0 ticks late"):
        assert part in text
    assert max(map(len, text.splitlines())) <= 80


def test_what_external_vehicles_make_a_user_wait_for_is_printed_at_once():
    out = console(terminal=False, width=200)
    spec = RobotSpec(name="quad1", kind="quadcopter", system_id=1, start=Point(0, 0))
    view = RunView(Scenario(name="field", robots=(spec,)), out)
    for kind, text in (
        ("phase", "active"),
        ("preflight", "waits for position: no fix"),
        ("link", "link silent"),
        ("rest", "is brought to hold, then land"),
    ):
        view.event({"t": 1.0, "vehicle": "quad1", "kind": kind, "text": text})
    assert out.file.getvalue().splitlines() == [
        "quad1: waits for position: no fix",
        "quad1: link silent",
        "quad1: is brought to hold, then land",
    ]
