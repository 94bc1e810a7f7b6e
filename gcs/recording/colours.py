"""The colours of a recording, all on dark ground, and told apart by colour-blind readers too.

Robots have those of the figures; what is no robot's differs in lightness, thickness or form too.
"""

from collections.abc import Mapping

from ..report.figure_style import COLOURS, KIND_COLOUR, on_dark, robot_colours
from .stage import Stage, StagedRobot

Rgb = tuple[int, int, int]
Rgba = tuple[int, int, int, int]

GROUND: Rgb = (44, 50, 59)  # behind everything
GRID: Rgba = (255, 255, 255, 26)
VELOCITY: Rgba = (255, 255, 255, 255)
FEED_FORWARD: Rgba = (240, 228, 66, 255)
PLAN: Rgba = (150, 160, 172, 255)
FENCE: Rgba = (86, 180, 233, 255)
STALE: Rgba = (230, 159, 0, 255)  # a belief that is too old to count
COLLISION: Rgba = (255, 64, 180, 255)
CLEARANCE: tuple[Rgba, Rgba, Rgba] = (  # calm, near, contact
    (150, 160, 172, 160),
    (240, 160, 0, 255),
    COLLISION,
)
CLEARANCE_POINTS = (1.2, 2.5, 5.0)  # thickness of a circle in points of the screen
_OTHER = on_dark(COLOURS[6])  # of a kind that is none of ours: grey


def stage_colours(stage: Stage) -> dict[str, str]:
    """Return `#rrggbb` by robot."""
    ours = {name: kind for name, kind in stage.kinds.items() if kind in KIND_COLOUR}
    known = robot_colours(ours if len(ours) == len(stage.robots) else {})
    colours: dict[str, str] = {}
    for robot in stage.robots:
        paint = known.get(robot.name)
        colours[robot.name] = on_dark(paint) if paint else next_colour(robot, colours)
    return colours


def next_colour(robot: StagedRobot, colours: Mapping[str, str]) -> str:
    """Return the colour of one more robot: one that is free, or that of its kind."""
    taken = set(colours.values())
    free = (seen for seen in map(on_dark, COLOURS) if seen not in taken)
    kind = KIND_COLOUR.get(robot.kind)
    return next(free, on_dark(kind) if kind else _OTHER)


def tint(colour: Rgb, white: float = 0.67) -> Rgb:
    """Return a colour mixed with white: pale enough that text in it is read on dark ground."""
    red, green, blue = (round(part + white * (255 - part)) for part in colour)
    return red, green, blue
