"""The layout of the views: the world, below it what changes in steps; numbers on the right."""

from collections.abc import Mapping, Sequence
from typing import Any

from .colours import stage_colours
from .panels import (
    DISTANCE,
    FEED_FORWARD,
    OTHER_PANELS,
    PANELS,
    Line,
    drawn,
)
from .stage import FEW, Stage, StagedRobot
from .views import follow_view, map_view, top_view, world_view

# What a state timeline takes of a window 800 points high, without the bars above and below.
_WINDOW_PX, _FRAME_PX, _LANE_PX = 735, 54, 40
_CLOSE = 1.7  # times as high as a plot is the view of its robot
_LANES = 6  # at most; others are scrolled to
_SEPARATIONS = "Separation, m (rovers orange, quads blue, both green; thin: touch)"

_NEAR_M = 4.0  # separations above are of no interest


def layout(stage: Stage, selected: Sequence[str] = ()) -> Any:
    """Return the blueprint (rrb.Blueprint) for a stage; plots of `selected` robots come first."""
    import rerun.blueprint as rrb

    lanes = min(max(len(stage.robots), 2), _LANES)
    steps = (_FRAME_PX + lanes * _LANE_PX) / _WINDOW_PX
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(space_views(stage), step_views(stage), row_shares=[1 - steps, steps]),
            number_views(stage, selected),
            column_shares=[62, 38],
        ),
        rrb.TimePanel(timeline="sim_time", state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        auto_views=False,
    )


def space_views(stage: Stage) -> Any:
    """Return tabs of the world, the world from above, and the map."""
    import rerun.blueprint as rrb

    return rrb.Tabs(world_view(stage), top_view(stage), map_view(stage))


def step_views(stage: Stage) -> Any:
    """Return tabs of events, phases and modes."""
    import rerun.blueprint as rrb

    kinds = rrb.encodings.TextLogColumnKind
    columns = rrb.TextLogColumns(text_log_columns=[kinds.LogLevel, kinds.Body])
    events = rrb.TextLogView(name="Events", origin="/events", columns=columns)
    phases = rrb.StateTimelineView(name="Phases", origin="/phase", time_view=_whole_run())
    modes = rrb.StateTimelineView(name="Modes", origin="/mode", time_view=_whole_run())
    if stage.crowded:
        legend = rrb.PlotLegend(rrb.Corner2D.RightTop)
        counts = _series("Robots by phase", "/fleet/phases", legend)
        return rrb.Tabs(counts, events, phases, modes)
    return rrb.Tabs(*([phases] if stage.law else []), modes, events, active_tab=0)


def number_views(stage: Stage, selected: Sequence[str] = ()) -> Any:
    """Return tabs of the team's plots and of each robot's; `selected` robots come first."""
    import rerun.blueprint as rrb

    shown = {robot.name: robot for robot in stage.robots}
    chosen = [shown[name] for name in dict.fromkeys(selected) if name in shown]
    if len(shown) <= FEW:
        chosen += [robot for robot in stage.robots if robot not in chosen]
    tabs = [robot_view(stage, robot) for robot in chosen]
    first = tabs and (selected or len(shown) == 1)
    return rrb.Tabs(team_view(stage), *tabs, active_tab=1 if first else 0)


def team_view(stage: Stage) -> Any:
    """Return the plots of the team."""
    import rerun.blueprint as rrb

    colours = stage_colours(stage)
    few = len(stage.robots) <= FEW
    hidden = rrb.PlotLegend(visible=False)
    key = "" if few else " (orange: most, blue: nine tenths, white: median)"

    def quantity(title: str, component: str) -> Any:
        if not few:
            return _series(title, f"/fleet/{component}", hidden)
        lines = {
            f"/plots/{robot.name}": drawn(component, [Line(robot.name, colours[robot.name], 1.5)])
            for robot in stage.robots
        }
        return _series(title, "/plots", hidden, lines)

    near = _series(_SEPARATIONS, "/fleet/separation", hidden, high=_NEAR_M)
    push = quantity("Feed-forward, m/s", FEED_FORWARD)
    ages = _series("Age of what is known, s", "/fleet/ages", hidden)
    pace = _series("Times real time", "/fleet/factor", hidden)
    return rrb.Vertical(
        *([near] if len(stage.robots) != 1 else []),
        quantity(f"Off target, m{key}", DISTANCE[0]),
        quantity(f"Speed, m/s{key}", "speed"),
        rrb.Tabs(*([push, ages] if stage.law else []), pace),
        name="Team",
    )


def robot_view(stage: Stage, robot: StagedRobot) -> Any:
    """Return the plots of one robot.

    Of a crowd's, distance and speed are always recorded, the rest if it was selected then.
    """
    import rerun.blueprint as rrb

    entity = f"/plots/{robot.name}"
    hidden = rrb.PlotLegend(visible=False)
    plots = [
        _series(panel.title, entity, hidden, {entity: [drawn(*part) for part in panel.parts]})
        for panel in PANELS.get(robot.kind, OTHER_PANELS)
    ]
    if stage.crowded:
        plots[:2] = [
            _of_crowd(stage, robot, "Off target, m", DISTANCE[0]),
            _of_crowd(stage, robot, "Speed, m/s", "speed"),
        ]
    rows = [*plots[:3], rrb.Tabs(*plots[3:])]
    if stage.crowded:
        return rrb.Vertical(*rows, name=robot.name)
    return rrb.Vertical(
        follow_view(stage, robot), *rows, row_shares=[_CLOSE, 1, 1, 1, 1], name=robot.name
    )


def _of_crowd(stage: Stage, robot: StagedRobot, title: str, component: str) -> Any:
    import rerun.blueprint as rrb

    lines = [Line(other.name, "#56B4E9") for other in stage.robots]
    mine = [other == robot for other in stage.robots]
    how = {"/fleet/each": drawn(component, lines, mine)}
    return _series(title, "/fleet/each", rrb.PlotLegend(visible=False), how)


def _series(
    name: str,
    origin: str,
    legend: Any,
    drawn_as: Mapping[Any, Any] | None = None,
    high: float | None = None,
) -> Any:
    import rerun.blueprint as rrb

    return rrb.TimeSeriesView(
        name=name,
        origin=origin,
        contents=list(drawn_as) if drawn_as else "$origin/**",
        overrides=drawn_as,
        plot_legend=legend,
        axis_x=_whole_run(),
        axis_y=rrb.ScalarAxis(range=(0.0, high)) if high else None,
    )


def _whole_run() -> Any:
    """Return a time axis from begin to end, where the viewer would show a minute around now."""
    import rerun.blueprint as rrb

    ever = rrb.TimeRangeBoundary.infinite()
    return rrb.TimeAxis(view_range=rrb.TimeRange(start=ever, end=ever))
