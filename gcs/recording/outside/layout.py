"""The layout for outside vehicles: the world as ever, and how their links and batteries do."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from ..colours import stage_colours
from ..layout import space_views, step_views
from ..panels import HEIGHT, OTHER_PANELS, PANELS, ROTORS, TURN, WHEELS, Line, Panel, drawn
from ..stage import FEW, Stage, StagedRobot
from .instruments import PLOTS, ROOT

PLACED = {"speed", "height"}  # what is plotted of a vehicle that tells where it is,
TURNED = {"attitude", "heading"}  # of one that tells how it is turned,
AIMED = {"distance", "offset"}  # and of one of which is told, too, where it should be
_ASPECT = 1.7  # of the views in space, width over height
_UNKNOWN = (ROTORS, WHEELS, TURN)  # a vehicle does not tell what turns how fast
_LINKS = {
    "ages": "Silent for, s",
    "rates": "Messages, 1/s",
    "signal": "Radio control signal, %",
}
_POWER = {"battery": "Battery, V", "charge": "Charge left, %", "throttle": "Throttle, %"}

_ALL = {*PLACED, *TURNED, *AIMED, *PLOTS}

Told = Mapping[str, Collection[str]]
"""What is recorded of each robot: first components of its panels, and plots of instruments."""


def outside_layout(stage: Stage, selected: Sequence[str] = (), told: Told | None = None) -> Any:
    """Return the blueprint (rrb.Blueprint) for vehicles that have turned up so far.

    What none has `told` has no plot; None: all may still come.
    """
    import rerun.blueprint as rrb

    if told is None:
        told = {robot.name: _ALL for robot in stage.robots}
    shown = [robot for robot in stage.robots if robot.name in selected or len(stage.robots) <= FEW]
    tabs = (
        _team(stage, told),
        _instruments("Links", _LINKS, told),
        _instruments("Power", _POWER, told),
        *(_robot(robot, told[robot.name]) for robot in shown),
    )
    found = [tab for tab in tabs if tab is not None]
    numbers = [rrb.Tabs(*found, active_tab=0)] if found else []
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(space_views(stage, _ASPECT), step_views(stage), row_shares=[5, 2]),
            *numbers,
            column_shares=[3, 2][: 1 + len(numbers)],
        ),
        rrb.TimePanel(timeline="sim_time", state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        auto_views=False,
    )


def _team(stage: Stage, told: Told) -> Any:
    """Return the plots of the team; None when there would be none."""
    import rerun.blueprint as rrb

    colours = stage_colours(stage)

    def of_each(component: str, robots: Sequence[StagedRobot], *asked: str) -> dict[str, Any]:
        def lines(name: str) -> list[Line]:
            thin = [Line(f"{name} {what}", colours[name], 0.7) for what in asked]
            return [Line(name, colours[name], 1.8), *thin]

        return {f"/plots/{r.name}": drawn(component, lines(r.name)) for r in robots}

    placed = [robot for robot in stage.robots if "speed" in told[robot.name]]
    aloft = [robot for robot in placed if HEIGHT in _panels(robot, told[robot.name])]
    plots = []
    if placed:
        plots.append(_series("Speed, m/s", "/plots", of_each("speed", placed)))
    if aloft:
        heights = of_each("height", aloft, "asked")
        plots.append(_series("Height, m (thin: asked)", "/plots", heights, named=False))
    if len(placed) > 1:
        plots.append(_series("Smallest separation, m (thin: contact)", "/fleet/separation"))
    return rrb.Vertical(*plots, name="Team") if plots else None


def _instruments(name: str, titles: Mapping[str, str], told: Told) -> Any:
    """Return the plots of some instruments of all vehicles; None when there would be none."""
    import rerun.blueprint as rrb

    recorded = set().union(*told.values())
    plots = [_series(title, f"/{ROOT}/{it}") for it, title in titles.items() if it in recorded]
    return rrb.Vertical(*plots, name=name) if plots else None


def _robot(robot: StagedRobot, told: Collection[str]) -> Any:
    """Return the plots of one vehicle; None when there would be none."""
    import rerun.blueprint as rrb

    entity = f"/plots/{robot.name}"
    plots = [
        _series(panel.title, entity, {entity: [drawn(*part) for part in panel.parts]}, named=False)
        for panel in _panels(robot, told)
    ]
    if "servos" in told:
        plots.append(_series("Servo outputs 1 to 4, us", f"/{ROOT}/servos/{robot.name}"))
    return rrb.Vertical(*plots, name=robot.name) if plots else None


def _panels(robot: StagedRobot, told: Collection[str]) -> list[Panel]:
    panels = PANELS.get(robot.kind, OTHER_PANELS)
    return [p for p in panels if p not in _UNKNOWN and p.parts[0][0] in told]


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
