"""Figures are small pictures of what happened, for two robots as for a hundred."""

import re
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from PIL import Image

from mavherd.gcs.report.figure_conflicts import conflicts
from mavherd.gcs.report.figure_plan import plan
from mavherd.gcs.report.figure_ridges import errors, speeds
from mavherd.gcs.report.figure_separation import separation
from mavherd.gcs.report.figure_space import space
from mavherd.gcs.report.figure_style import COLOURS, KIND_COLOUR, robot_colours
from mavherd.gcs.report.figure_svg import inline
from mavherd.gcs.report.figures import draw
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


@pytest.mark.parametrize("count", [1, 2, 6, 100])
def test_figures_are_small_pictures_of_what_there_is(track, tmp_path, count):
    pictures = draw(tmp_path, *swap(track, count, 5.0))
    names = [p.stem for p in pictures]
    if count <= 2:  # one alone, or a rover and a quadcopter that are never at one level
        assert names == ["plan", "space", "speeds", "errors"]
    else:
        assert names == ["plan", "space", "separation", "conflicts", "speeds", "errors"]
    for picture in pictures:
        assert picture.stat().st_size < 150_000
        with Image.open(picture) as image:
            assert min(image.size) > 120
        assert picture.with_suffix(".svg").stat().st_size < (150_000 if count < 10 else 600_000)
    assert not list(tmp_path.glob("*.part"))


def test_a_run_in_which_nobody_was_ever_ready_has_a_plan_only(track, tmp_path):
    scenario, specs, tracks, _ = swap(track, 2, 1.0)
    verdict = judge(scenario, tuple(specs), tracks, None, 1.0)
    assert [p.name for p in draw(tmp_path, scenario, specs, tracks, verdict)] == ["plan.png"]
    assert draw(tmp_path, scenario, specs, [], verdict) == []
    late = [track("rover0", "rover", 1, lambda t: (t, 0, 0), 0.1, start=1.0)]  # than the end
    verdict = judge(scenario, tuple(specs), late, None, 0.0)
    assert [p.name for p in draw(tmp_path, scenario, specs, late, verdict)] == ["plan.png"]


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
    _, specs, tracks, verdict = swap(track, 4, kinds=("rover",))
    (axes,) = separation(specs, tracks, verdict).axes
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


def pass_by(track, gap):
    """Return a rover that goes east, and one that crosses its way northwards `gap` s later."""
    specs = [
        RobotSpec(name=n, kind="rover", system_id=i, start=Point(0, 0), path=Goto(target=Point(*p)))
        for i, (n, p) in enumerate({"first": (5, 0), "second": (0, 5)}.items(), 1)
    ]
    tracks = [
        track("first", "rover", 1, lambda t: (-5 + t, 0, 0), 10.0),
        track("second", "rover", 2, lambda t: (0, -5 + t - gap, 0), 10.0),
    ]
    scenario = Scenario(name="cross", robots=tuple(specs))
    return scenario, specs, tracks, judge(scenario, tuple(specs), tracks, 0.0, 10.0)


@pytest.mark.parametrize("gap", [0.0, 2.0])
def test_a_way_leads_through_the_region_of_another_only_in_a_collision(track, gap):
    _, specs, tracks, verdict = pass_by(track, gap)
    assert len(verdict.collisions) == (gap == 0)
    axes = conflicts(specs, tracks, verdict).axes[0]
    assert axes.get_title("left") == "In the way of first"
    touching = axes.collections[1]  # after the paler one round it
    way = max(axes.lines, key=lambda line: len(line.get_xdata())).get_xydata()
    inside = [path.contains_points(way).any() for path in touching.get_paths()]
    assert any(inside) == (gap == 0)
    # `second` is at the crossing, 5 m along the way of `first`, when it has gone 5 m itself
    extent = np.concatenate([path.vertices for path in touching.get_paths()])
    assert (extent.min(axis=0) + extent.max(axis=0)) / 2 == pytest.approx([5 + gap, 5], abs=0.15)


def test_who_never_comes_into_anybodys_way_has_no_diagram(track):
    _, specs, tracks, verdict = swap(track, 2)
    assert conflicts(specs, tracks, verdict) is None


def test_speed_and_distance_are_drawn_per_robot_until_it_has_arrived(track):
    scenario, specs, tracks, verdict = pass_by(track, 2.0)
    (axes,) = speeds(specs, tracks, verdict).axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["second", "first"]
    top = max(line.get_ydata().max() for line in axes.lines)
    assert top == pytest.approx(1.86, abs=0.01)  # 1 m/s fills the upper row
    (axes,) = errors(scenario, specs, tracks, verdict).axes
    curve = max(axes.lines, key=lambda line: line.get_ydata().max())
    assert np.diff(curve.get_ydata()).max() < 0  # nearer all the time


def test_many_robots_are_drawn_as_their_spread(track):
    _, specs, tracks, verdict = swap(track, 30, 5.0)
    ground, air = speeds(specs, tracks, verdict).axes
    assert [text.get_text() for text in ground.get_legend().get_texts()] == ["15 rovers"]
    assert len(ground.lines) == len(air.lines) == 1


def test_space_is_drawn_so_that_up_is_up_and_equal_lengths_are_equal(track):
    scenario, specs, tracks, verdict = swap(track, 2)
    (axes,) = space(scenario, specs, tracks, verdict).axes
    wide, high = np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())
    box = axes.get_position()
    inches = axes.figure.get_size_inches() * (box.width, box.height)
    assert inches[0] / inches[1] == pytest.approx(wide / high)
    starts = [line.get_xydata()[0] for line in axes.lines if line.get_marker() == "s"]
    goals = [line.get_xydata()[0] for line in axes.lines if line.get_marker() == "x"]
    (rover, quad), (rover_goal, quad_goal) = starts, goals
    assert (rover + rover_goal)[1] < (quad + quad_goal)[1]  # it flies 2 m above


def test_an_svg_in_a_page_has_the_pages_colours_and_ids_of_its_own(track, tmp_path):
    pictures = draw(tmp_path, *swap(track, 6, 5.0))
    svg = pictures[0].with_suffix(".svg").read_text()
    assert "#0072b2" in svg  # a file of its own
    assert ">rover0</text>" in svg  # text is text
    assert "DejaVu" not in svg
    here = inline(svg, "plan", "All <tracks>")
    assert 'aria-label="All &lt;tracks&gt;"' in here
    assert "#0072b2" not in here
    assert "var(--blue)" in here
    ids = re.findall(r'\bid="([^"]*)"', here)
    assert len(ids) == len(set(ids))
    assert all(i.startswith("plan-") for i in ids)
    assert set(re.findall(r'(?:href="#|url\(#)([^")]*)', here)) <= set(ids)
    for forbidden in ("<style", "metadata", "xlink", "http", "patch_1"):
        assert forbidden not in here


def test_small_teams_get_a_colour_each_and_large_ones_a_colour_by_kind():
    small = robot_colours({f"r{i}": "rover" for i in range(8)})
    assert sorted(small.values()) == sorted(COLOURS)
    large = robot_colours({f"r{i}": "rover" for i in range(30)} | {"q": "quadcopter"})
    assert {large[f"r{i}"] for i in range(30)} == {KIND_COLOUR["rover"]}


def test_colours_of_the_palette_differ_in_lightness_or_hue_enough():
    rgb = np.array([tuple(bytes.fromhex(c[1:])) for c in COLOURS], float)
    for a, b in pairwise(sorted(map(tuple, rgb))):
        assert np.linalg.norm(np.subtract(a, b)) > 60


def test_seconds_stand_beside_a_way_until_its_robot_has_arrived(track):
    specs = [
        RobotSpec(name=name, kind="rover", system_id=i, start=Point(0, i), path=goal)
        for i, (name, goal) in enumerate(
            [("early", Goto(target=Point(4, 1))), ("late", Goto(target=Point(19, 2)))], 1
        )
    ]
    tracks = [  # the one that is early goes on, as if home
        track("early", "rover", 1, lambda t: (t, 1, 0), 20.0),
        track("late", "rover", 2, lambda t: (t, 2, 0), 20.0),
    ]
    scenario = Scenario(name="two", robots=tuple(specs))
    verdict = judge(scenario, tuple(specs), tracks, 0.0, 20.0)
    (axes,) = plan(scenario, specs, tracks, verdict).axes
    seconds = [text.xy for text in axes.texts if text.get_text() == "10"]
    assert seconds == [(pytest.approx(10), pytest.approx(2))]
