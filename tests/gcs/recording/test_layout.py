"""The layout shows what is recorded, for one robot as for a hundred."""

from itertools import count

import numpy as np
import pytest

pytest.importorskip("rerun")

import rerun.blueprint as rrb

from mavherd.gcs.recording.layout import HEIGHT_PX, TAB_PX, WIDTH_PX, layout
from mavherd.gcs.recording.panels import ARCHETYPE
from mavherd.gcs.recording.scene import Scene
from mavherd.gcs.recording.stage import FEW, MANY, Stage, StagedRobot
from mavherd.gcs.recording.stream import Stream
from mavherd.transport.frames import Origin
from mavherd.transport.wire import Phase, Target, VehicleState


def stage(kinds, law="safe"):
    ids = count(1)
    robots = [StagedRobot(n, k, next(ids), (0, 0, 0), (9, 9, 0)) for n, k in kinds.items()]
    return Stage("layout", law, tuple(robots), Origin())


def parts(piece):
    """Yield a container or view and all that is in it."""
    yield piece
    for inner in getattr(piece, "contents", ()) if isinstance(piece, rrb.Container) else ():
        yield from parts(inner)


def views(blueprint):
    return [piece for piece in parts(blueprint.root_container) if isinstance(piece, rrb.View)]


def tabs(blueprint):
    """Return the names of the robots' tabs and which tab is open."""
    numbers = blueprint.root_container.contents[1]
    return [tab.name for tab in numbers.contents], numbers.active_tab


TEAM = {"r1": "rover", "r2": "rover", "q3": "quadcopter"}


def test_every_plot_of_a_team_shows_something_that_is_recorded(
    tmp_path, strict, read_back, track, commanded
):
    names = {
        "rover": [f"{s}_wheel_{what}_rad_s" for what in ("speed", "command") for s in ("l", "r")],
        "quadcopter": [f"rotor{n}_{w}_rad_s" for w in ("speed", "command") for n in range(4)],
    }
    stream = Stream("layout", file=tmp_path / "run.rrd")
    scene = Scene(stream, stage(TEAM))
    still = (0.0, 0.0, 0.0)
    for i, (name, kind) in enumerate(TEAM.items()):
        rows = track(name, kind, i + 1, lambda t, i=i: (t, 2.0 * i, 0.5), 2.0)
        scene.add_truth(commanded(rows, dict.fromkeys(names[kind], 1.0), {"x_command_m": 0.0}))
        scene.add_targets([Target(name, 1.0, still, still, still, still)])
    scene.add_states(
        [VehicleState(n, 1, 0, 1.0, still, still, (1, 0, 0, 0), 4, True, Phase(3)) for n in TEAM],
        1.0,
    )
    scene.add_clock(1.0, 1.0)
    scene.add_event({"t": 1.0, "vehicle": None, "kind": "problem", "text": "none"})
    scene.flush(everything=True)
    stream.close()
    seen = read_back(tmp_path / "run.rrd")
    shown = [v for v in views(layout(stage(TEAM))) if not isinstance(v, rrb.MapView)]
    assert len(shown) > 20
    for view in shown:
        mapped = {
            (entity, mapping.source_component)
            for entity, drawings in getattr(view, "visualizer_overrides", {}).items()
            for one in (drawings if isinstance(drawings, list) else [drawings])
            for mapping in (getattr(one, "mappings", None) or ())
        }
        for entity, component in mapped:
            assert str(component) in seen[entity], (view.name, entity)
            assert str(component).startswith(f"{ARCHETYPE}:")
        if not mapped:
            assert any(entity.startswith(view.origin) for entity in seen), view.name


def test_names_of_plots_fit_beside_their_buttons():
    robots = {f"q{i}": "quadcopter" for i in range(MANY + 1)}
    for who in (TEAM, robots, {"x": "submarine"}):
        for view in views(layout(stage(who), ("q3",))):
            assert len(view.name) <= 70, view.name


@pytest.mark.parametrize(
    ("robots", "selected", "names", "opened"),
    [
        (1, (), ["Team", "q0"], 1),
        (3, (), ["Team", "q0", "q1", "q2"], 0),
        (3, ("q2",), ["Team", "q2", "q0", "q1"], 1),
        (FEW + 1, (), ["Team"], 0),
        (MANY + 70, ("q80", "nobody", "q80"), ["Team", "q80"], 1),
    ],
)
def test_few_robots_have_a_tab_each_and_of_many_the_selected(robots, selected, names, opened):
    kinds = {f"q{i}": "quadcopter" for i in range(robots)}
    assert tabs(layout(stage(kinds), selected)) == (names, opened)


def test_of_a_crowd_a_selected_robot_is_picked_out_of_what_is_recorded_of_all():
    kinds = {f"q{i}": "quadcopter" for i in range(MANY + 1)}
    view = next(v for v in views(layout(stage(kinds), ("q7",))) if v.origin == "/fleet/each")
    style = view.visualizer_overrides["/fleet/each"].overrides
    (shown,) = [b for b in style if "visible" in str(b.component_descriptor())]
    assert np.flatnonzero(shown.as_arrow_array().to_pylist()).tolist() == [7]


def test_where_nobody_coordinates_there_are_no_phases_and_nothing_of_a_law():
    names = {view.name for view in views(layout(stage(TEAM, law="")))}
    assert "Phases" not in names
    assert not any(name.startswith(("Feed-forward", "Age")) for name in names)
    assert "Modes" in names


def test_of_what_logs_do_not_hold_a_recording_made_of_them_has_no_view():
    names = {view.name for view in views(layout(stage(TEAM), afterwards=True))}
    assert names.isdisjoint({"Feed-forward, m/s", "Times real time"})
    assert "Age of what is known, s" in names


def heights(piece, height):
    """Yield each plot and how high it is without its bar and its time axis, in points."""
    if isinstance(piece, rrb.TimeSeriesView):
        yield piece, height - TAB_PX - 16
    elif isinstance(piece, rrb.Tabs):
        for inner in piece.contents:
            below_bar = 0 if isinstance(inner, rrb.View) else TAB_PX
            yield from heights(inner, height - below_bar)
    elif isinstance(piece, rrb.Vertical):
        shares = piece.row_shares or [1] * len(piece.contents)
        for inner, share in zip(piece.contents, shares, strict=True):
            yield from heights(inner, height * share / sum(shares))


def ticks(low, high, height):
    """Return how many ticks the viewer writes: at powers of ten, 20 points apart or more."""
    step = next(10.0**k for k in range(-9, 9) if 10.0**k * height / (high - low) >= 20)
    return np.floor(high / step) - np.ceil(low / step) + 1


@pytest.mark.parametrize("count", [1, 2, FEW, FEW + 1, MANY + 70])
@pytest.mark.parametrize("law", ["safe", ""])
def test_a_plot_is_high_enough_for_two_ticks_whatever_it_shows(count, law):
    """In a window of 1400 x 800, of numbers that begin at zero."""
    kinds = {f"x{i}": ("rover", "quadcopter", "submarine")[i % 3] for i in range(count)}
    right = layout(stage(kinds, law), ("x0",)).root_container.contents[1]
    found = list(heights(right, HEIGHT_PX))
    assert len(found) > 6
    for view, height in found:
        axis = view.properties.get("ScalarAxis")
        span = axis.range.as_arrow_array().to_pylist()[0] if axis else None
        tops = [span] if span else [(0.0, top) for top in (0.8, 1.04, 5.5, 8.0, 9.9, 650.0)]
        assert min(ticks(*top, height) for top in tops) >= 2, (view.name, height)


def test_tabs_are_named_so_short_that_all_of_them_are_seen():
    for kind in ("rover", "quadcopter", "submarine"):
        right = layout(stage({"x": kind, "y": kind})).root_container.contents[1]
        for piece in parts(right.contents[1]):
            if isinstance(piece, rrb.Tabs):  # 7 points a letter, an icon each, three buttons
                names = [tab.name for tab in piece.contents]
                assert sum(7 * len(name) + 30 for name in names) < 0.38 * WIDTH_PX - 80, names
