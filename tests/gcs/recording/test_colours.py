"""A robot, a run and a class of pairs have one colour on dark ground, here and on the page."""

from mavherd.gcs.compare.figures import look
from mavherd.gcs.recording.colours import next_colour, stage_colours
from mavherd.gcs.recording.comparison import colour_of
from mavherd.gcs.recording.stage import stage_of
from mavherd.gcs.report.figure_style import CLASS_COLOUR, COLOURS, on_dark, robot_colours
from mavherd.gcs.report.page_style import COLOURS as THEMES
from mavherd.scenarios.loader import load_scenario


def test_every_colour_of_the_figures_has_one_for_dark_ground_and_no_two_are_alike():
    known = dict(THEMES.values())
    for colour in (*COLOURS, *CLASS_COLOUR.values()):
        assert on_dark(colour) == known[colour.lower()]
    assert len({on_dark(colour) for colour in COLOURS}) == len(COLOURS)


def test_robots_and_runs_have_the_colours_of_their_figures():
    stage = stage_of(load_scenario("crossing-targets"))
    drawn = robot_colours(stage.kinds)
    assert stage_colours(stage) == {name: on_dark(colour) for name, colour in drawn.items()}
    assert [colour_of(k) for k in range(8)] == [on_dark(look(k, 8).colour) for k in range(8)]


def test_one_more_robot_has_a_colour_that_is_free_and_then_that_of_its_kind():
    stage = stage_of(load_scenario("crossing-targets"))
    quad = next(robot for robot in stage.robots if robot.kind == "quadcopter")
    given = {}
    for k in range(len(COLOURS)):
        given[f"r{k}"] = next_colour(quad, given)
    assert set(given.values()) == set(map(on_dark, COLOURS))
    assert next_colour(quad, given) == on_dark("#0072B2")
