"""The terminal shows each robot, the worst of many, and a verdict; nothing reaches stdout."""

import re
import time
from io import StringIO
from math import dist
from pathlib import Path
from random import Random

import pytest
from rich.console import Console

from mavherd.gcs.mode_names import mode_name
from mavherd.gcs.patience import Patience
from mavherd.gcs.report.judge import judge
from mavherd.gcs.report.report import RunFacts, build_report
from mavherd.gcs.report.summary import MAX_MISSING, summary_table
from mavherd.gcs.run import live_view, terminal
from mavherd.gcs.run.live_view import LiveView
from mavherd.gcs.run.team_text import WORST_ROWS, Scene, nearest, phases
from mavherd.gcs.run.terminal import RunView
from mavherd.gcs.run.view import Going
from mavherd.scenarios.schema import Expect, Goto, Point, RobotSpec, Scenario
from mavherd.transport.wire import Phase, VehicleState


def state(name, position=(0.0, 0.0, 0.0), mode=15, phase=Phase.ACTIVE, armed=True):
    level = (1.0, 0.0, 0.0, 0.0)
    return VehicleState(name, 1, 0, 0.0, position, (0.3, 0.4, 0.0), level, mode, armed, phase)


def console(*, terminal, width=80, height=24):
    return Console(
        file=StringIO(),
        force_terminal=terminal,
        force_interactive=terminal,
        width=width,
        height=height,
    )


@pytest.fixture
def clock(monkeypatch):
    """A wall clock that stands until it is moved."""
    now = [100.0]
    monkeypatch.setattr(live_view, "monotonic", lambda: now[0])
    return now


def screen(states, *, targets=None, width=80, height=24, clock="", hint="", **more):
    out = console(terminal=True, width=width, height=height)
    view = LiveView({s.name: "rover" for s in states}, 60.0, out, hint)
    going = Going(3.2, clock, more.pop("late", 0), more.pop("outside", 0))
    view.update(12.5, Scene(states, targets or {}, **more), going, "all ready")
    return seen(out)


def seen(out):
    """Return what was written, without the codes that move the cursor."""
    return re.sub(r"\x1b\[[?0-9;]*[A-Za-z]", "", out.file.getvalue())


def rows(text, states):
    """Return the names that have a line of their own."""
    return [name for line in text.splitlines() for name in [line.split(" ")[0]] if name in states]


def test_a_robot_is_shown_with_mode_phase_place_speed_and_neighbour(clock):
    text = screen([state("r1"), state("r2", (3.0, 4.0, 0.0))], targets={"r1": 7.25})
    line = next(row for row in text.splitlines() if "r1" in row and "GUIDED" in row)
    for part in ("GUIDED", "active", "0.50", "7.25", "5.00 r2"):
        assert part in line
    assert "12.50 / 60 s" in text
    assert "at most 15 s left" in text  # 47.5 s, 3.2 times as fast
    assert "3.2x real time" in text
    assert "all ready" in text


def test_what_was_asked_of_the_clock_and_what_keys_do_is_shown(clock):
    lines = screen([state("r1")], clock="paused", hint="q quit").splitlines()
    assert lines[0].endswith("60 s   3.2x real time   paused")  # for how long, nobody knows
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
    assert " 50 rovers: nearest 0.90 m   50 active" in text
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


def test_without_a_terminal_a_plain_line_comes_after_two_seconds_then_every_five(clock):
    out = console(terminal=False)
    view = LiveView({"r1": "rover", "r2": "rover"}, 62.0, out)
    for second in range(12):
        clock[0] = 100.0 + second
        team = [state("r1"), state("r2", (3.0, 4.0, 0.0))]
        view.update(second, Scene(team, {}), Going(1.0, late=second), "go [on]")
    lines = [" ".join(line.split()) for line in out.file.getvalue().splitlines()]
    assert lines == [
        "2.00 s 1.0x 2 active nearest 5.00 m at most 1:00 min left 2 ticks late go [on]",
        "7.00 s 1.0x 2 active nearest 5.00 m at most 55 s left 7 ticks late",
    ]
    assert "\x1b" not in out.file.getvalue()


def test_a_screen_is_drawn_whenever_there_is_something_to_show(clock):
    out = console(terminal=True)
    view = LiveView({"r1": "rover"}, 60.0, out)
    view.update(0.0, Scene([state("r1")], {}), Going())
    view.update(0.0, Scene([state("r1")], {}), Going(clock="paused"))
    assert "paused" in out.file.getvalue()


def test_a_tick_can_be_seen_in_the_time(clock):
    for step, shown in ((0.1, "0.3 / 60 s"), (0.05, "0.25 / 60 s"), (0.004, "0.252 / 60 s")):
        out = console(terminal=True)
        view = LiveView({"r1": "rover"}, 60.0, out, step=step)
        view.update(0.252, Scene([state("r1")], {}), Going())
        assert shown in seen(out)


def test_what_is_slow_or_old_or_from_outside_has_a_line_of_its_own(clock):
    team = [state("r1"), state("r2", (3.0, 4.0, 0.0))]
    fine = screen(team).splitlines()
    assert len(fine) == 5
    _, _, line, *table = screen(team, late=3, outside=1, old={"r2": 4.2}).splitlines()
    assert line == "3 ticks late, 1 outside client, no news of r2 for 4 s"
    assert "4 s old" in table[2]


def test_a_robot_without_news_is_among_the_worst(clock):
    states = [state(f"r{i:02d}", (1.0 * i**2, 0.0, 0.0)) for i in range(50)]
    names = {s.name for s in states}
    assert "r49" in rows(screen(states, old={"r49": 2.0}), names)


@pytest.mark.parametrize("count", [1, 6, 100])
@pytest.mark.parametrize("size", [(40, 24), (80, 10), (40, 10), (24, 5)])
def test_the_smallest_terminals_have_no_line_too_long_and_none_too_many(clock, count, size):
    states = [state(f"quadcopter-{i:03d}", (99.0 * i, 0.0, 0.0)) for i in range(count)]
    width, height = size
    lines = screen(states, clock="paused", hint="keys", width=width, height=height).splitlines()
    assert len(lines) < height
    assert max(map(len, lines)) <= width
    assert "12.50 / 60 s" in lines[0]
    assert lines[-1] == "keys"


def test_a_narrow_terminal_keeps_who_is_near_whom(clock):
    team = [state("r1"), state("r2", (3.0, 4.0, 0.0))]
    head, row, _ = screen(team, targets={"r1": 7.25}, width=40).splitlines()[-3:]
    assert head.split() == ["robot", "phase", "to", "go", "nearest"]
    assert row.split() == ["r1", "active", "7.25", "5.00", "r2"]


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
        view.update(1.0, [state("r1")], Going(2.0))
    text = out.file.getvalue()
    assert "127.0.0.1:14550" in text
    assert "5.00" in text
    assert "r1: active" in text


def summary(scenario, tracks, folder=Path("runs/pair-1"), width=80, cut_short=False, **changes):
    verdict = judge(scenario, scenario.robots, tracks, 0.0, 20.0, broken_off=cut_short)
    values = {"run_id": "pair-1", "seed": 3, "law": "safe", "lockstep": True, "speed": None}
    values |= {"duration_s": 20.0, "wall_s": 2.0, "real_time_factor": 10.0, "digest": "c0ffee" * 9}
    out = console(terminal=False, width=width)
    report = build_report(scenario, verdict, RunFacts(**values | changes))
    out.print(summary_table(report, folder), crop=False)
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
    text = summary(
        scenario, tracks, error="r2 died", exit_code=3, missing=["run.rrd: none"], late_ticks=4
    )
    for part in ("FAIL", "no collision: 1", "did not", "partial", "4 of 0 ticks late"):
        assert part in text
    assert max(map(len, text.splitlines())) <= 80


def test_the_summary_of_a_run_that_was_broken_off_leaves_open_what_it_has_not_decided(
    scenario, track
):
    tracks = [track(f"r{i}", "rover", i, lambda t, i=i: (3 * i, 4, 0)) for i in (1, 2)]
    text = summary(scenario, tracks, cut_short=True, error="interrupted", exit_code=130)
    assert "open no collision: none by the time it broke off" in text
    assert " ok " not in text


def test_a_recording_with_nothing_in_it_is_not_to_be_watched(scenario, track, tmp_path):
    (tmp_path / "run.rrd.part").touch()
    tracks = [track(f"r{i}", "rover", i, lambda t, i=i: (3 * i, 4, 0)) for i in (1, 2)]
    assert "mavherd view" not in summary(scenario, tracks, folder=tmp_path)


def test_the_summary_says_what_is_missing_and_how_to_watch(scenario, track, tmp_path):
    (tmp_path / "run.rrd.part").write_bytes(b"RRF2")
    tracks = [track(f"r{i}", "rover", i, lambda t, i=i: (3 * i, 4, 0)) for i in (1, 2)]
    missing = [f"thing {k}: none" for k in range(9)]
    text = summary(scenario, tracks, folder=tmp_path, missing=missing, exit_code=130)
    assert text.startswith(" INTERRUPTED  pair")
    assert f"watch it  mavherd view {tmp_path}\n" in text
    assert "partial: thing 0: none\n" in text
    assert f"and {9 - MAX_MISSING} more, in report.json\n" in text


@pytest.mark.parametrize(("count", "width"), [(6, 80), (100, 80), (100, 60)])
def test_the_summary_fits_a_screen_with_whole_names(track, count, width):
    specs = tuple(
        RobotSpec(name=f"quadcopter-{i:03d}", kind="quadcopter", system_id=i, start=Point(0, 3 * i))
        for i in range(1, count + 1)
    )
    scenario = Scenario(name="team", robots=specs, expect=Expect(collisions=0))
    tracks = [
        track(s.name, s.kind, s.system_id, lambda t, s=s: (0, 3 * s.system_id, 2)) for s in specs
    ]
    lines = summary(scenario, tracks, width=width).splitlines()
    assert len(lines) < 24
    assert max(len(line.rstrip()) for line in lines) <= width
    assert any(line.split()[-1:] == ["quadcopter-002"] for line in lines)


def test_numbers_that_mean_trouble_are_in_the_summary_and_no_others():
    fleet = {"deadlock_all_s": 0.0, "deadlock_any_s": 0.0, "setpoint_longest_gap_s": 0.05}
    report = {"passed": True, "exit_code": 0, "scenario": "s", "law": "safe", "seed": 1}
    report |= {"assertions": [], "robots": [], "collisions": 0, "min_separation_m": None}
    report |= {"duration_s": 1.0, "wall_s": None, "real_time_factor": None, "late_ticks": 0}
    report |= {"outside_clients": 0, "partial": False, "digest": None, "run_id": "s-1"}

    def shown(lockstep=True, **numbers):
        out = console(terminal=False)
        told = report | {"fleet": fleet | numbers, "lockstep": lockstep}
        out.print(summary_table(told, Path("runs/s-1")))
        return out.file.getvalue()

    assert "1.0 s simulated" in shown()
    assert "simulated" not in shown(lockstep=False), "external vehicles may be real"
    assert not {"deadlock", "setpoints", "links"} & set(re.split(r"\W", shown()))
    assert "deadlock: for 3.5 s some stood" in shown(deadlock_any_s=3.5)
    assert "deadlock: for 2.0 s nobody moved" in shown(deadlock_any_s=3.5, deadlock_all_s=2.0)
    assert "setpoints: none for 0.75 s" in shown(setpoint_longest_gap_s=0.75)
    assert "links: 1 frame lost" in shown(lost_frames=1)


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


def test_what_is_waited_for_before_and_after_a_run_has_lines_of_its_own(scenario, monkeypatch):
    monkeypatch.setattr(terminal, "Patience", lambda out: Patience(out, wait_s=0.0))
    out = console(terminal=False, width=200)

    def said(text):
        deadline = time.monotonic() + 60
        while text not in out.file.getvalue():
            assert time.monotonic() < deadline, f"never said: {text}"
            time.sleep(0.01)

    with RunView(scenario, out) as view:
        view.step("starting")
        said("starting ...\n")
        view.started(Path("runs/pair-1"), {})
        said("run folder runs/pair-1\n")
        view.step("drawing")
        said("drawing ...\n")
    assert len(out.file.getvalue().splitlines()) == 3


def test_a_long_address_is_printed_once_and_is_not_the_status(clock):
    out = console(terminal=True)
    spec = RobotSpec(name="quad1", kind="quadcopter", system_id=1, start=Point(0, 0))
    with RunView(Scenario(name="field", robots=(spec,)), out) as view:
        view.event({"t": 1.0, "vehicle": None, "kind": "viewer", "text": "http://127.0.0.1:9"})
        view.update(1.0, [], Going())
    assert seen(out).count("http://127.0.0.1:9") == 1
