"""Figures are small pictures of what happened, for two robots as for a hundred."""

from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from PIL import Image

from mavherd.gcs.report.figure_plan import plan
from mavherd.gcs.report.figure_style import COLOURS, KIND_COLOUR, robot_colours
from mavherd.gcs.report.figures import draw, separation
from mavherd.gcs.report.judge import judge
from mavherd.scenarios.schema import Circle, Goto, Point, RobotSpec, Scenario


def swap(track, count, seconds=20.0, kinds=("rover", "quadcopter")):
    """Return a run in which robots on a circle change places straight through the middle."""
    specs, tracks = [], []
    for i in range(count):
        kind, angle, radius = kinds[i % len(kinds)], 2 * np.pi * i / count, 1.5 + count / 4
        up = 2.0 if kind == "quadcopter" else 0.0
        x, y = radius * np.cos(angle), radius * np.sin(angle)

        def way(t, x=x, y=y, up=up):
            return x * (1 - 2 * t / seconds), y * (1 - 2 * t / seconds), up

        name = f"{kind}{i}"
        target = Goto(target=Point(-x, -y, up))
        specs.append(
            RobotSpec(name=name, kind=kind, system_id=i + 1, start=Point(x, y), path=target)
        )
        tracks.append(track(name, kind, i + 1, way, seconds))
    scenario = Scenario(name="swap", robots=tuple(specs))
    return scenario, specs, tracks, judge(scenario, tuple(specs), tracks, 1.0, seconds)


@pytest.mark.parametrize("count", [2, 6, 100])
def test_both_figures_are_pictures_below_150_kb(track, tmp_path, count):
    pictures = draw(tmp_path, *swap(track, count, 5.0))
    if count == 2:  # a rover and a quadcopter that are never at one level
        assert [p.name for p in pictures] == ["plan.png"]
    else:
        assert [p.name for p in pictures] == ["plan.png", "separation.png"]
    for picture in pictures:
        assert picture.stat().st_size < 150_000
        with Image.open(picture) as image:
            assert min(image.size) > 250
    assert not list(tmp_path.glob("*.part"))


def test_the_plan_has_a_panel_for_the_ground_and_one_for_the_air_at_one_scale(track):
    ground, air = plan(*swap(track, 6)).axes
    assert ground.get_title("left") == "Ground: 3 rovers"
    assert air.get_title("left") == "Air: 3 quadcopters"
    assert ground.get_xlim() == air.get_xlim()
    width, height = np.ptp(ground.get_xlim()), np.ptp(ground.get_ylim())
    box = ground.get_window_extent()
    assert width / height == pytest.approx(box.width / box.height)  # circles are round


def test_a_small_team_is_named_and_a_large_one_is_not_littered(track):
    few = {text.get_text() for axes in plan(*swap(track, 6)).axes for text in axes.texts}
    assert {"rover0", "rover2", "quadcopter1"} <= few
    many = [text for axes in plan(*swap(track, 60, 3.0)).axes for text in axes.texts]
    assert len(many) <= 6  # a note and the nearest two, per panel


def test_collisions_are_marked_where_they_happened(track):
    scenario, specs, tracks, verdict = swap(track, 2, kinds=("rover",))
    figure = plan(scenario, specs, tracks, verdict)
    (marks,) = [line for line in figure.axes[0].lines if line.get_marker() == "X"]
    assert len(verdict.collisions) == len(marks.get_xdata()) == 1
    assert marks.get_xdata()[0] == pytest.approx(verdict.collisions[0].position[0])


def test_the_separation_figure_draws_the_contact_distance_and_the_minimum(track):
    _, _, tracks, verdict = swap(track, 4, kinds=("rover",))
    (axes,) = separation(tracks, verdict).axes
    assert "collision" in axes.get_title("left")
    texts = [text.get_text() for text in axes.texts]
    assert "contact 0.79 m" in texts
    curve = max(axes.lines, key=lambda line: len(line.get_xdata()))
    assert np.nanmin(curve.get_ydata()) == pytest.approx(verdict.min_separation, abs=0.1)
    assert curve.get_xdata()[0] == pytest.approx(0)  # when all were ready


def test_a_path_is_drawn_beside_the_track(track):
    path = Circle(centre=Point(0, 0), radius=3)
    spec = RobotSpec(name="r", kind="rover", system_id=1, start=Point(3, 0), path=path)
    scenario = Scenario(name="one", robots=(spec,))
    tracks = [track("r", "rover", 1, lambda t: (3 * np.cos(t / 6), 3 * np.sin(t / 6), 0), 5.0)]
    verdict = judge(scenario, (spec,), tracks, 0.0, 5.0)
    (axes,) = plan(scenario, [spec], tracks, verdict).axes
    (dashed,) = [line for line in axes.lines if line.get_linestyle() == "--"]
    assert np.hypot(dashed.get_xdata(), dashed.get_ydata()) == pytest.approx(3)


def test_small_teams_get_a_colour_each_and_large_ones_a_colour_by_kind():
    small = robot_colours({f"r{i}": "rover" for i in range(8)})
    assert sorted(small.values()) == sorted(COLOURS)
    large = robot_colours({f"r{i}": "rover" for i in range(30)} | {"q": "quadcopter"})
    assert {large[f"r{i}"] for i in range(30)} == {KIND_COLOUR["rover"]}


def test_colours_of_the_palette_differ_in_lightness_or_hue_enough():
    rgb = np.array([tuple(bytes.fromhex(c[1:])) for c in COLOURS], float)
    for a, b in pairwise(sorted(map(tuple, rgb))):
        assert np.linalg.norm(np.subtract(a, b)) > 60
