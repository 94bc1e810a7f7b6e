"""Draw the step responses of both vehicles: `python docs/step_response.py [FOLDER]`."""

import sys
from collections.abc import Callable
from math import atan2
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mavherd.gcs.report.figure_style import save
from mavherd.vehicles.build import make_robot
from mavherd.vehicles.config import Disturbance, VehicleConfig
from mavherd.vehicles.robot import Kinematics, Setpoint, Vec3

PICTURES = Path(__file__).parent / "pictures"
SECONDS = 8.0
PUSH = Disturbance(form="held", amplitude=0.4, hold_s=0.1)
TARGETS = {
    "quadcopter": Setpoint(position=Vec3(2.0, 1.0, -3.0), yaw=0.5),
    "rover": Setpoint(position=Vec3(2.0, 1.0)),
}
INK, MUTED, GRID = "#1f2933", "#7b8794", "#e4e7eb"
STYLES = {  # profile, disturbance: colour, width, label
    ("paper", Disturbance()): ("#d97706", 1.5, "gains of the paper's Table 2"),
    ("default", Disturbance()): ("#8fc3ea", 4.0, "default gains"),
    ("default", PUSH): ("#0b3d66", 1.0, "default gains, pushed by ±0.4 N"),
}


def fly(kind: str, profile: str, disturbance: Disturbance) -> list[tuple[float, Kinematics]]:
    """Return time and state at 50 Hz of one step response from standstill."""
    robot = make_robot(
        VehicleConfig(kind=kind, system_id=1, seed=1, profile=profile, disturbance=disturbance)
    )
    robot.motors_on = True
    robot.reset_control()
    track = []
    for i in range(round(SECONDS / robot.dt)):
        if i % round(0.02 / robot.dt) == 0:
            track.append((i * robot.dt, robot.kinematics()))
        if i % robot.control_every == 0:
            robot.control(TARGETS[kind])
        robot.advance()
    return track


def yaw_of(k: Kinematics) -> float:
    """Return the yaw in rad."""
    return atan2(2 * (k.qw * k.qz + k.qx * k.qy), 1 - 2 * (k.qy**2 + k.qz**2))


PANELS: tuple[tuple[str, str, Callable[[Kinematics], float], float], ...] = (
    ("quadcopter", "Quadcopter, north (m)", lambda k: k.north, 2.0),
    ("quadcopter", "Quadcopter, height (m)", lambda k: -k.down, 3.0),
    ("quadcopter", "Quadcopter, yaw (rad)", yaw_of, 0.5),
    ("rover", "Rover, north (m)", lambda k: k.north, 2.0),
)


def draw(axes: Axes, title: str, target: float) -> None:
    """Give one panel its title, target line and quiet frame."""
    axes.axhline(target, color=MUTED, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1)
    axes.set_title(title, loc="left", fontsize=10, color=INK)
    axes.set_xlim(0, SECONDS)
    axes.set_ylim(-0.04 * target, 1.45 * target)
    axes.set_xlabel("time (s)", fontsize=8.5, color=MUTED)
    axes.grid(color=GRID, linewidth=0.7)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=8.5, colors=MUTED, length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)


def main(folder: Path = PICTURES) -> None:
    """Fly every response and write the picture."""
    figure = Figure(figsize=(12.0, 3.1), layout="constrained")
    grid = figure.subplots(1, 4)
    for axes, (kind, title, value, target) in zip(grid, PANELS, strict=True):
        draw(axes, title, target)
        for (profile, disturbance), (colour, width, label) in STYLES.items():
            track = fly(kind, profile, disturbance)
            axes.plot(
                [t for t, _ in track],
                [value(k) for _, k in track],
                color=colour,
                linewidth=width,
                label=label,
            )
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc="outside lower center",
        ncols=len(labels),
        frameon=False,
        fontsize=9,
        labelcolor=INK,
    )
    folder.mkdir(parents=True, exist_ok=True)
    path = save(folder / "step-response.png", figure)
    print(f"{path}: {path.stat().st_size // 1024} kB")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
