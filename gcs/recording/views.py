"""The views in space: the world, the world from above, the map."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...transport.frames import Triple
from .colours import GRID, GROUND
from .stage import FEW, Stage, StagedRobot

TRAIL_S = 20.0
CROWD_TRAIL_S = 4.0
_LEAST_M = 4.0  # around each place, that is in sight too
_OVER_M = 1.0  # above each place
_SLOPE = 0.85  # of the eye's direction, up over level
_SOUTHERLY = np.radians([-20, -5, 10, 25, 40, 55, -35, -50])  # where the eye may stand, from south
_HALF_FIELD = 0.5206  # tangent of half the viewer's field of view, upright
_FILL = 0.93  # of the picture: the rest is for names and the frame
_COARSE_M = 40.0  # across: the grid's lines are further apart then
_FAR_M = 2000.0
_ROUNDS = 8  # until the middle of the picture has settled
_CLOSE = np.array([1.0, -1.2, 0.9])  # from a robot to the eye that follows it, m
_UPWARD = np.array([0.0, 0.0, 1.0])

Floats = NDArray[np.float64]


def world_view(stage: Stage, aspect: float) -> Any:
    """Return the view of the world from beside and above, with all of the stage in sight.

    The eye stands where robots look largest in a picture that is `aspect` as wide as high.
    """
    places = _places(stage)
    level = [np.array([np.sin(way), -np.cos(way), _SLOPE]) for way in _SOUTHERLY]
    stands = [_stand(places, toward, _UPWARD, aspect) for toward in level]
    nearest = max(stands, key=lambda stand: stand.size)
    return _spatial("World", stage, nearest.eye, nearest.target, _UPWARD, ["flags"])


def top_view(stage: Stage, aspect: float) -> Any:
    """Return the view of the world from straight above, north up; `aspect` as of `world_view`."""
    above, north = np.array([0.0, -1e-4, 1.0]), np.array([0.0, 1.0, 0.0])
    stand = _stand(_places(stage), above, north, aspect)
    hidden = ["labels"] if len(stage.robots) <= FEW else ["labels", "flags"]
    return _spatial("From above", stage, stand.eye, stand.target, north, hidden)


def follow_view(stage: Stage, robot: StagedRobot) -> Any:
    """Return a close view that goes along with a robot; of a crowd, no robot can be followed."""
    middle = np.array([0.0, 0.0, 0.35 if robot.kind == "rover" else 0.0])
    frame = f"/world/robots/{robot.name}"
    eye = middle + _CLOSE * (1.0 if robot.kind == "rover" else 0.55)
    return _spatial("Close", stage, eye, middle, _UPWARD, ["flags"], frame)


def map_view(stage: Stage) -> Any:
    """Return the map, near enough to tell the robots apart."""
    import rerun.blueprint as rrb

    zoom = float(np.clip(np.log2(4e7 / reach_of(stage)), 1, 19))  # 4e7 m round the equator: zoom 0
    trail = _last(CROWD_TRAIL_S if stage.crowded else TRAIL_S)
    tails: dict[str | Any, Any] = {f"/map/trails/{name}": trail for name in _drawn(stage)}
    return rrb.MapView(name="Map", origin="/map", zoom=zoom, overrides=tails)


def reach_of(stage: Stage) -> float:
    """Return how far it is across all that is known beforehand, m."""
    return float(np.ptp(_places(stage)[:, :2], axis=0).max())


def _spatial(
    name: str,
    stage: Stage,
    eye: Floats,
    target: Floats,
    up: Floats,
    hidden: Sequence[str],
    frame: str = "/world",
) -> Any:
    import rerun.blueprint as rrb

    trail = _last(CROWD_TRAIL_S if stage.crowded else TRAIL_S)
    shown: dict[str | Any, Any] = {f"/world/trails/{who}": trail for who in _drawn(stage)}
    shown["/world/collisions"] = _last(None)
    if stage.crowded:  # all ways at once hide the robots; the viewer can show them
        hidden = ["paths"]
    shown |= {f"/world/{thing}": rrb.EntityBehavior(visible=False) for thing in hidden}
    return rrb.Spatial3DView(
        name=name,
        origin="/world",
        spatial_information=rrb.SpatialInformation(target_frame=f"tf#{frame}"),
        background=rrb.Background(kind=rrb.BackgroundKind.SolidColor, color=GROUND),
        line_grid=rrb.LineGrid3D(
            visible=frame == "/world",  # it would go along with a robot
            spacing=10.0 if reach_of(stage) > _COARSE_M else 1.0,
            color=GRID,
            stroke_width=1.0,
        ),
        eye_controls=rrb.EyeControls3D(
            position=_triple(eye),
            look_target=_triple(target),
            eye_up=_triple(up),
        ),
        overrides=shown,
    )


def _drawn(stage: Stage) -> list[str]:
    """Return whose trails there may be: robots' by name, crowds' by kind."""
    return [*stage.kinds, *dict.fromkeys(stage.kinds.values())]


def _last(seconds: float | None) -> Any:
    """Return what shows all that came in the last `seconds`, or ever."""
    import rerun.blueprint as rrb

    edge = rrb.TimeRangeBoundary
    start = edge.infinite() if seconds is None else edge.cursor_relative(seconds=-seconds)
    return rrb.VisibleTimeRanges(timeline="sim_time", start=start, end=edge.cursor_relative())


def _places(stage: Stage) -> Floats:
    """Return the corners of boxes round all that is known beforehand."""
    known = [
        place
        for robot in stage.robots
        for place in (robot.start, robot.target, *robot.path)
        if place is not None
    ]
    places = np.array(known or [(0.0, 0.0, 0.0)])
    across = np.ptp(places[:, :2], axis=0).max()
    room = max(0.5, (_LEAST_M - across) / 2)
    offsets = [[x, y, z] for x in (-room, room) for y in (-room, room) for z in (0.0, _OVER_M)]
    corners: Floats = (places[:, None] + np.array(offsets)).reshape(-1, 3)
    return corners


class _Stand(NamedTuple):
    """Where the eye stands, what it looks at, and how large the furthest looks from there."""

    eye: Floats
    target: Floats
    size: float


def _stand(places: Floats, toward: Floats, up: Floats, aspect: float) -> _Stand:
    """Return the stand in a direction, so near that all places just fit in the picture."""
    toward = toward / np.linalg.norm(toward)
    high_field = _HALF_FIELD * _FILL
    right = np.cross(up, toward)
    right /= np.linalg.norm(right)
    over = np.cross(toward, right)
    target = (places.min(axis=0) + places.max(axis=0)) / 2
    far, size = 1.0, 0.0
    for _ in range(_ROUNDS):  # the nearer ones look larger, so the middle moves with the distance
        seen = places - target
        nearer, across, high = seen @ toward, seen @ right, seen @ over
        needed = np.maximum(abs(across) / aspect, abs(high)) / high_field
        far = float((needed + nearer).max())
        depth = far - nearer
        size = float(1 / depth.max())
        for axis, offset in ((right, across / depth), (over, high / depth)):
            target = target + axis * (offset.min() + offset.max()) / 2 * far
    return _Stand(target + toward * min(far, _FAR_M), target, size)


def _triple(v: Floats) -> Triple:
    return (float(v[0]), float(v[1]), float(v[2]))
