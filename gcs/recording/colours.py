"""A colour for each robot: those of the figures, as they can be seen on a dark ground."""

from collections.abc import Mapping

from ..report.figure_style import COLOURS, KIND_COLOUR, robot_colours
from .stage import Stage, StagedRobot

_ON_DARK = {"#444444": "#C9CED4", "#0072B2": "#1F83CC"}  # too dark there; all others are read well
_OTHER = "#C9CED4"  # of a kind that is none of ours


def stage_colours(stage: Stage) -> dict[str, str]:
    """Return `#rrggbb` by robot."""
    ours = {name: kind for name, kind in stage.kinds.items() if kind in KIND_COLOUR}
    known = robot_colours(ours if len(ours) == len(stage.robots) else {})
    colours: dict[str, str] = {}
    for robot in stage.robots:
        paint = known.get(robot.name)
        colours[robot.name] = _ON_DARK.get(paint, paint) if paint else next_colour(robot, colours)
    return colours


def next_colour(robot: StagedRobot, colours: Mapping[str, str]) -> str:
    """Return the colour of one more robot: one that is free, or that of its kind."""
    taken = set(colours.values())
    for colour in COLOURS:
        seen = _ON_DARK.get(colour, colour)
        if seen not in taken:
            return seen
    return KIND_COLOUR.get(robot.kind, _OTHER)
