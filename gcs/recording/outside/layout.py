"""The layout for outside vehicles: the world as ever, and how their links and batteries do."""

from collections.abc import Sequence
from typing import Any

from ..colours import stage_colours
from ..layout import space_views, step_views
from ..panels import HEIGHT, OTHER_PANELS, PANELS, ROTORS, TURN, WHEELS, Line, Panel, drawn
from ..stage import FEW, Stage, StagedRobot
from .instruments import ROOT

_UNKNOWN = (ROTORS, WHEELS, TURN)  # a vehicle does not tell what turns how fast


def outside_layout(stage: Stage, selected: Sequence[str] = ()) -> Any:
    """Return the blueprint (rrb.Blueprint) for vehicles that have turned up so far."""
    import rerun.blueprint as rrb

    shown = [robot for robot in stage.robots if robot.name in selected or len(stage.robots) <= FEW]
    numbers = rrb.Tabs(_team(stage), _links(), _power(), *map(_robot, shown), active_tab=0)
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(space_views(stage), step_views(stage), row_shares=[5, 2]),
            numbers,
            column_shares=[3, 2],
        ),
        rrb.TimePanel(timeline="sim_time", state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        auto_views=False,
    )


def _team(stage: Stage) -> Any:
    import rerun.blueprint as rrb

    colours = stage_colours(stage)

    def of_each(component: str, robots: Sequence[StagedRobot], *asked: str) -> dict[str, Any]:
        def lines(name: str) -> list[Line]:
            thin = [Line(f"{name} {what}", colours[name], 0.7) for what in asked]
            return [Line(name, colours[name], 1.8), *thin]

        return {f"/plots/{r.name}": drawn(component, lines(r.name)) for r in robots}

    aloft = [robot for robot in stage.robots if HEIGHT in _panels(robot)]
    heights = of_each("height", aloft, "asked")

    return rrb.Vertical(
        _series("Speed, m/s", "/plots", of_each("speed", stage.robots)),
        *([_series("Height, m (thin: asked)", "/plots", heights, named=False)] if aloft else []),
        _series("Smallest separation, m (thin: contact)", "/fleet/separation"),
        name="Team",
    )


def _links() -> Any:
    import rerun.blueprint as rrb

    return rrb.Vertical(
        _series("Silent for, s", f"/{ROOT}/ages"),
        _series("Messages, 1/s", f"/{ROOT}/rates"),
        _series("Radio control signal, %", f"/{ROOT}/signal"),
        name="Links",
    )


def _power() -> Any:
    import rerun.blueprint as rrb

    return rrb.Vertical(
        _series("Battery, V", f"/{ROOT}/battery"),
        _series("Charge left, %", f"/{ROOT}/charge"),
        _series("Throttle, %", f"/{ROOT}/throttle"),
        name="Power",
    )


def _robot(robot: StagedRobot) -> Any:
    import rerun.blueprint as rrb

    entity = f"/plots/{robot.name}"
    plots = [
        _series(panel.title, entity, {entity: [drawn(*part) for part in panel.parts]}, named=False)
        for panel in _panels(robot)
    ]
    servos = _series("Servo outputs 1 to 4, us", f"/{ROOT}/servos/{robot.name}")
    return rrb.Vertical(*plots, servos, name=robot.name)


def _panels(robot: StagedRobot) -> list[Panel]:
    return [p for p in PANELS.get(robot.kind, OTHER_PANELS) if p not in _UNKNOWN]


def _series(name: str, origin: str, drawn_as: Any = None, *, named: bool = True) -> Any:
    import rerun.blueprint as rrb

    return rrb.TimeSeriesView(
        name=name,
        origin=origin,
        contents=list(drawn_as) if drawn_as else "$origin/**",
        overrides=drawn_as,
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=named),
        axis_x=rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal),
    )
