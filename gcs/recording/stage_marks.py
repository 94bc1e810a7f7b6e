"""What stands still in the world: pads, planned ways, goals and the fence."""

from collections.abc import Sequence
from math import ceil

import numpy as np
from numpy.typing import NDArray

from ...scenarios.schema import Fence
from ...transport.frames import Triple
from .colours import FENCE, PLAN, Rgb
from .shapes import bottom_of
from .stage import StagedRobot
from .stream import Stream

_DASH_M = 0.25
_DASHES = 100  # at most, of one way
_CROSS_M = 0.22
_PAD_M = 0.3


def mark_robots(stream: Stream, entity: str, robots: Sequence[tuple[StagedRobot, Rgb]]) -> None:
    """Draw the pads, ways and goals of `robots` with their colours, on one entity of each."""
    import rerun as rr

    pads, goals, goal_paints, ways = [], [], [], []
    for robot, colour in robots:
        east, north, up = robot.start
        pads.append([east, north, up + bottom_of(robot.kind) - 0.006])
        ways += dashes(robot.path)
        if robot.target is not None and robot.target != robot.start:
            goals += _cross(robot.target)
            goal_paints += [(*colour, 255 if len(robots) == 1 else 90)] * 2
    count = len(robots)
    pad = rr.Cylinders3D(
        lengths=[0.01] * count,
        radii=[_PAD_M] * count,
        centers=pads,
        colors=[(*colour, 110 if count == 1 else 35) for _, colour in robots],
        fill_mode="solid",
    )
    stream.static(f"world/pads/{entity}", pad)
    if ways:
        thin = rr.Radius.ui_points(1)
        stream.static(f"world/paths/{entity}", rr.LineStrips3D(ways, colors=[PLAN], radii=thin))
    if goals:
        thick = rr.Radius.ui_points(2 if count == 1 else 0.6)
        crosses = rr.LineStrips3D(goals, colors=goal_paints, radii=thick)
        stream.static(f"world/goals/{entity}", crosses)


def mark_fence(stream: Stream, fence: Fence) -> None:
    """Draw the edges of the box that no robot may be sent out of."""
    import rerun as rr

    (west, east), (south, north) = fence.east, fence.north
    corners = [(west, south), (east, south), (east, north), (west, north)]
    levels = [[(*corner, up) for corner in (*corners, corners[0])] for up in (0.0, fence.up)]
    posts = [[(*corner, 0.0), (*corner, fence.up)] for corner in corners]
    lines = rr.LineStrips3D([*levels, *posts], colors=[FENCE], radii=rr.Radius.ui_points(1.5))
    stream.static("world/fence", lines)


def dashes(way: Sequence[Triple]) -> list[NDArray[np.float32]]:
    """Return a dashed polyline: strips of one length with gaps as long, bent where the way is."""
    if len(way) < 2:
        return []
    points = np.array(way, dtype=float)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    length = float(along[-1])
    if length == 0.0:
        return []
    count = min(_DASHES, max(1, ceil((length / _DASH_M + 1) / 2)))
    dash = length / (2 * count - 1)
    strips = []
    for k in range(count):
        begin, end = 2 * k * dash, (2 * k + 1) * dash
        bends = along[(along > begin) & (along < end)]
        at = np.concatenate([[begin], bends, [end]])
        strip = np.stack([np.interp(at, along, points[:, axis]) for axis in range(3)], axis=1)
        strips.append(strip.astype(np.float32))
    return strips


def _cross(place: Triple) -> list[NDArray[np.float32]]:
    arms = _CROSS_M * np.array([[[-1, -1, 0], [1, 1, 0]], [[-1, 1, 0], [1, -1, 0]]])
    return list((arms + np.array(place)).astype(np.float32))
