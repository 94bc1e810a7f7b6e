"""The views in space show all robots, as large as they can, and who is who."""

import numpy as np
import pytest

pytest.importorskip("rerun")

from mavherd.gcs.recording.stage import FEW, Stage, StagedRobot
from mavherd.gcs.recording.views import follow_view, map_view, top_view, world_view
from mavherd.transport.frames import Origin

ORIGIN = Origin()


def in_picture(view, places, aspect):
    """Return where places are in a view: 1 is the frame, to the right and up."""
    eye = view.properties["EyeControls3D"]
    place, target, up = (
        np.array(part.as_arrow_array().to_pylist()[0])
        for part in (eye.position, eye.look_target, eye.eye_up)
    )
    ahead = (target - place) / np.linalg.norm(target - place)
    right = np.cross(ahead, up)
    right /= np.linalg.norm(right)
    seen = np.array(places, dtype=float) - place
    field = np.tan(np.radians(55 / 2))  # the viewer's
    depth = seen @ ahead
    assert (depth > 0).all()
    return seen @ right / depth / field / aspect, seen @ np.cross(right, ahead) / depth / field


@pytest.mark.parametrize("aspect", [1.15, 2.1])
@pytest.mark.parametrize("count", [0, 1, 6, 100])
def test_all_robots_are_in_sight_and_fill_the_picture(count, aspect):
    ends = [((2.0 * i, i, 0), (i, 9, 4)) for i in range(count)]
    robots = tuple(StagedRobot(f"x{i}", "rover", i + 1, *pair) for i, pair in enumerate(ends))
    stage = Stage("x", "safe", robots, ORIGIN)
    for view in (world_view(stage, aspect), top_view(stage, aspect)):
        places = [place for pair in ends for place in pair] or [(0, 0, 0)]
        across, high = in_picture(view, places, aspect)
        assert max(abs(across).max(), abs(high).max()) < 0.95
        if count > 1:
            assert max(np.ptp(across), np.ptp(high)) > 1.4
    assert map_view(stage).name == "Map"


@pytest.mark.parametrize(("count", "named"), [(6, True), (FEW + 1, False)])
def test_names_stand_over_robots_and_from_above_beside_them(count, named):
    robots = tuple(StagedRobot(f"x{i}", "rover", i + 1, (i, 0, 0)) for i in range(count))
    stage = Stage("x", "safe", robots, ORIGIN)
    off = {
        view.name: set(view.visualizer_overrides)
        for view in (world_view(stage, 2.0), top_view(stage, 2.0))
    }
    label, flag = "/world/labels", "/world/flags"
    assert flag in off["World"]
    assert label not in off["World"]
    assert label in off["From above"]
    assert (flag not in off["From above"]) == named


def test_a_close_view_goes_along_with_its_robot():
    robot = StagedRobot("q7", "quadcopter", 7, (0, 0, 0))
    view = follow_view(Stage("x", "safe", (robot,), ORIGIN), robot)
    frame = view.properties["SpatialInformation"].target_frame.as_arrow_array().to_pylist()
    assert frame == ["tf#/world/robots/q7"]
