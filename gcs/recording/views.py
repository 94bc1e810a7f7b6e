"""The views in space: the world, the world from above, the map."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...transport.frames import Triple
from .palette import GRID, GROUND
from .stage import Stage, StagedRobot

TRAIL_S = 20.0
CROWD_TRAIL_S = 4.0
_LEAST_M = 4.0  # around each place, that is in sight too
_OVER_M = 1.0  # above each place
_SIDE = np.array([0.25, -0.86, 0.62])  # the direction of the eye where nothing says better
_HEIGHT = 0.7  # of the eye's direction, over its length in the plane
_LONG = 2.0  # times as long as wide, and the eye looks from the broad side
_SLANT = 0.2  # of the distance aside: so far towards one end, from where robots look larger
_UP = 0.46  # tangent of half the field of view: most of the picture
_WIDE, _NARROW = 2.0, 1.4  # the shape of the view, with and without many timelines below
_SEVERAL = 5  # robots, whose timelines make it wide
_COARSE_M = 40.0  # across: the grid's lines are further apart then
_FAR_M = 2000.0
_CLOSE = np.array([1.0, -1.2, 0.9])  # from a robot to the eye that follows it, m
_UPWARD = np.array([0.0, 0.0, 1.0])

Floats = NDArray[np.float64]


def world_view(stage: Stage) -> Any:
    """Return the view of the world from beside and above, with all of the stage in sight."""
    places = _places(stage)
    return _spatial("World", stage, *_stand(stage, _side_of(places), _UPWARD), _UPWARD)


def top_view(stage: Stage) -> Any:
    """Return the view of the world from straight above, north up."""
    above, north = np.array([0.0, -1e-4, 1.0]), np.array([0.0, 1.0, 0.0])
    return _spatial("From above", stage, *_stand(stage, above, north), north)


def follow_view(stage: Stage, robot: StagedRobot) -> Any:
    """Return a close view that goes along with a robot; of a crowd, no robot can be followed."""
    middle = np.array([0.0, 0.0, 0.35 if robot.kind == "rover" else 0.0])
    frame = f"/world/robots/{robot.name}"
    eye = middle + _CLOSE * (1.0 if robot.kind == "rover" else 0.55)
    return _spatial("Close", stage, eye, middle, _UPWARD, frame)


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
    name: str, stage: Stage, eye: Floats, target: Floats, up: Floats, frame: str = "/world"
) -> Any:
    import rerun.blueprint as rrb

    trail = _last(CROWD_TRAIL_S if stage.crowded else TRAIL_S)
    shown: dict[str | Any, Any] = {f"/world/trails/{who}": trail for who in _drawn(stage)}
    shown["/world/collisions"] = _last(None)
    if stage.crowded:  # all ways at once hide the robots; the viewer can show them
        shown["/world/paths"] = rrb.EntityBehavior(visible=False)
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


def _side_of(places: Floats) -> Floats:
    """Return the direction of the eye: slantwise along what is long, and rather from the south."""
    level = places[:, :2] - places[:, :2].mean(axis=0)
    sizes, axes = np.linalg.eigh(level.T @ level)
    if sizes[1] < _LONG**2 * sizes[0]:
        return _SIDE
    across = axes[:, 0] * (-1 if axes[1, 0] > 0 else 1)
    along = np.array([across[1], -across[0]])  # to the left, seen from `across`
    east, north = across + _SLANT * along
    return np.array([east, north, _HEIGHT * np.hypot(east, north)])


def _stand(stage: Stage, toward: Floats, up: Floats) -> tuple[Floats, Floats]:
    """Return eye and target for a direction, so that what is known fills the middle."""
    places, toward = _places(stage), toward / np.linalg.norm(toward)
    field = _UP * (_WIDE if len(stage.robots) >= _SEVERAL else _NARROW), _UP
    right = np.cross(up, toward)
    right /= np.linalg.norm(right)
    over = np.cross(toward, right)
    target = (places.min(axis=0) + places.max(axis=0)) / 2
    far = 1.0
    for _ in range(5):  # the nearer ones look larger, so the middle moves with the distance
        seen = places - target
        nearer, across, high = seen @ toward, seen @ right, seen @ over
        far = float((np.maximum(abs(across) / field[0], abs(high) / field[1]) + nearer).max())
        depth = far - nearer
        for axis, offset in ((right, across / depth), (over, high / depth)):
            target = target + axis * (offset.min() + offset.max()) / 2 * far
    return target + toward * min(far, _FAR_M), target


def _triple(v: Floats) -> Triple:
    return (float(v[0]), float(v[1]), float(v[2]))
