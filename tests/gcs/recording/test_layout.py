"""The layout shows what is recorded, for one robot as for a hundred."""

from itertools import count

import numpy as np
import pytest

pytest.importorskip("rerun")

import rerun.blueprint as rrb

from mavherd.gcs.recording.layout import layout
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
