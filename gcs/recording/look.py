"""How the recording looks: the robots' shapes to the size of the paper's Table 1, the layout."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...transport.frames import Triple
from .robots import RecordedRobot

ROVER_LENGTH, ROVER_WIDTH, ROVER_HEIGHT = 0.65, 0.45, 0.9  # m
WHEEL_RADIUS, WHEEL_WIDTH = 0.0975, 0.05
QUAD_RADIUS, QUAD_HEIGHT = 0.20, 0.2  # m, to the rotor tips
ROTOR_RADIUS = 0.075
FEW = 12  # robots whose legend does not hide the plot
NAMED = 30  # robots whose names do not hide the world
Colour = tuple[int, int, int]
_DARK = (45, 50, 56)


def log_robot(rec: Any, robot: RecordedRobot, rgb: Colour, *, named: bool) -> None:
    """Log what does not change: the shape, the pad, the place where the path ends."""
    import rerun as rr

    name, kind, _, start, target = robot
    (_log_rover if kind == "rover" else _log_quadcopter)(rec, f"world/{name}", rgb)
    top = ROVER_HEIGHT + 0.3 if kind == "rover" else 0.5
    label = rr.Points3D([[0, 0, top]], radii=0.001, colors=[rgb], labels=[name], show_labels=named)
    rec.log(f"world/{name}/label", label, static=True)
    pad = rr.Cylinders3D(
        lengths=[0.01],
        radii=[0.3],
        centers=[[start[0], start[1], start[2] + 0.005]],
        colors=[(*rgb, 90)],
        fill_mode="solid",
    )
    rec.log(f"world/pads/{name}", pad, static=True)
    cross = [[[-0.25, -0.25, 0], [0.25, 0.25, 0]], [[-0.25, 0.25, 0], [0.25, -0.25, 0]]]
    strips = (np.array(cross) + np.array(target)).tolist()
    goal = rr.LineStrips3D(strips, colors=[rgb], radii=rr.Radius.ui_points(2))
    rec.log(f"world/goals/{name}", goal, static=True)
    dots = rr.Points3D.from_fields(colors=[rgb], radii=rr.Radius.ui_points(4))
    rec.log(f"world/targets/{name}", dots, static=True)
    trail = rr.LineStrips3D.from_fields(colors=[(*rgb, 200)], radii=rr.Radius.ui_points(1.5))
    rec.log(f"trails/{name}", trail, static=True)


def _log_rover(rec: Any, entity: str, rgb: Colour) -> None:
    """Draw a chassis on two driven wheels and a castor, and a mast with a head."""
    import rerun as rr

    low, deck = 0.06, 0.34  # m, under- and upperside of the chassis
    boxes = rr.Boxes3D(
        centers=[
            [0, 0, (low + deck) / 2],
            [-0.08, 0, (deck + ROVER_HEIGHT) / 2],
            [-0.02, 0, ROVER_HEIGHT - 0.06],
            [ROVER_LENGTH / 2 - 0.015, 0, 0.2],
        ],
        half_sizes=[
            [ROVER_LENGTH / 2, ROVER_WIDTH / 2 - WHEEL_WIDTH, (deck - low) / 2],
            [0.03, 0.03, (ROVER_HEIGHT - deck) / 2],
            [0.07, 0.12, 0.06],
            [0.015, 0.12, 0.05],
        ],
        colors=[rgb, _DARK, rgb, (250, 240, 200)],
        fill_mode="solid",
    )
    rec.log(f"{entity}/body", boxes, static=True)
    side = ROVER_WIDTH / 2 - WHEEL_WIDTH / 2
    wheels = rr.Cylinders3D(
        lengths=[WHEEL_WIDTH, WHEEL_WIDTH, 0.03],
        radii=[WHEEL_RADIUS, WHEEL_RADIUS, 0.05],
        centers=[[0, side, WHEEL_RADIUS], [0, -side, WHEEL_RADIUS], [-0.25, 0, 0.05]],
        rotation_axis_angles=[rr.RotationAxisAngle(axis=(1, 0, 0), degrees=90)] * 3,
        colors=[_DARK] * 3,
        fill_mode="solid",
    )
    rec.log(f"{entity}/wheels", wheels, static=True)


def _log_quadcopter(rec: Any, entity: str, rgb: Colour) -> None:
    """Draw a hub with four arms and a rotor on each; the front one is white."""
    import rerun as rr

    hub = QUAD_RADIUS - ROTOR_RADIUS
    frame = rr.Boxes3D(
        centers=[(0, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, -QUAD_HEIGHT / 4), (0.06, 0, 0)],
        half_sizes=[
            [0.055, 0.055, 0.035],
            [hub, 0.011, 0.009],
            [0.011, hub, 0.009],
            [0.03, 0.03, QUAD_HEIGHT / 4],
            [0.012, 0.02, 0.015],
        ],
        colors=[rgb, _DARK, _DARK, _DARK, (250, 240, 200)],
        fill_mode="solid",
    )
    rec.log(f"{entity}/body", frame, static=True)
    rotors = rr.Cylinders3D(
        lengths=[0.006] * 4,
        radii=[ROTOR_RADIUS] * 4,
        centers=[[hub, 0, 0.05], [0, -hub, 0.05], [-hub, 0, 0.05], [0, hub, 0.05]],
        colors=[(250, 250, 250, 190), (*rgb, 190), (*rgb, 190), (*rgb, 190)],
        fill_mode="solid",
    )
    rec.log(f"{entity}/rotors", rotors, static=True)


def blueprint(robots: Sequence[RecordedRobot]) -> Any:
    """Return the layout: the world on the left; plots, phases and events on the right."""
    import rerun.blueprint as rrb

    places = np.array([place for r in robots for place in (r.start, r.target)] or [(0, 0, 0)])
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    reach = max(5.0, float(np.ptp(places[:, :2], axis=0).max()))
    eye = middle + reach * np.array([0.2, -1.1, 0.75])
    world = rrb.Spatial3DView(
        name="World",
        origin="/",
        contents=["/world/**", "/trails/**"],
        line_grid=rrb.LineGrid3D(visible=True, spacing=1.0 if reach < 30 else 10.0),
        eye_controls=rrb.EyeControls3D(position=_triple(eye), look_target=_triple(middle)),
    )
    legend = rrb.PlotLegend(visible=len(robots) <= FEW, corner=rrb.Corner2D.RightTop)
    separation = rrb.TimeSeriesView(
        name="Smallest separation, m", origin="/plots/separation", plot_legend=legend
    )
    motion = rrb.Tabs(
        rrb.TimeSeriesView(
            name="Distance from target, m", origin="/plots/error", plot_legend=legend
        ),
        rrb.TimeSeriesView(name="Speed, m/s", origin="/plots/speed", plot_legend=legend),
    )
    states = rrb.Tabs(
        rrb.StateTimelineView(name="Phase", origin="/phase"),
        rrb.StateTimelineView(name="Mode", origin="/mode"),
    )
    events = rrb.TextLogView(name="Events", origin="/events")
    return rrb.Blueprint(
        rrb.Horizontal(
            world,
            rrb.Vertical(separation, motion, states, events, row_shares=[3, 3, 3, 2]),
            column_shares=[3, 2],
        ),
        rrb.TimePanel(timeline="sim_time", state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
    )


def _triple(v: NDArray[np.float64]) -> Triple:
    return (float(v[0]), float(v[1]), float(v[2]))
