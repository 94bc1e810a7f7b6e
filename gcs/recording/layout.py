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

# Of a window of 1400 x 800, without the bars above and below; what views and lanes take of it.
WIDTH_PX, HEIGHT_PX, TAB_PX = 1400, 735, 28
_FRAME_PX, _LANE_PX = 54, 40
_LEFT = 0.62  # of the width
_CLOSE, _FLAT = 0.65, 0.7  # height of a robot's view, and of separations, over that of a plot
_LANES = 6  # at most; others are scrolled to
_SEPARATIONS = "Separation, m (rovers orange, quads blue, both green; thin: touch)"

_NEAR_M = 4.0  # separations above are of no interest
_AGES = 1.5  # of the age at which a state no longer counts: so much is seen


def layout(stage: Stage, selected: Sequence[str] = (), *, afterwards: bool = False) -> Any:
    """Return the blueprint (rrb.Blueprint) for a stage; plots of `selected` robots come first.

    `afterwards`: of a recording made of logs, which hold neither feed-forward nor pace.
    """
    import rerun.blueprint as rrb

    lanes = min(max(len(stage.robots), 2), _LANES)
    steps = (_FRAME_PX + lanes * _LANE_PX) / HEIGHT_PX
    aspect = _LEFT * WIDTH_PX / ((1 - steps) * HEIGHT_PX - TAB_PX)
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                space_views(stage, aspect), step_views(stage), row_shares=[1 - steps, steps]
            ),
            number_views(stage, selected, afterwards=afterwards),
            column_shares=[_LEFT, 1 - _LEFT],
        ),
        rrb.TimePanel(timeline="sim_time", state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        auto_views=False,
    )


def space_views(stage: Stage, aspect: float) -> Any:
    """Return tabs of the world, the world from above, and the map: `aspect` as wide as high."""
    import rerun.blueprint as rrb

    return rrb.Tabs(world_view(stage, aspect), top_view(stage, aspect), map_view(stage))


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


def number_views(stage: Stage, selected: Sequence[str] = (), *, afterwards: bool = False) -> Any:
    """Return tabs of the team's plots and of each robot's; `selected` robots come first."""
    import rerun.blueprint as rrb

    shown = {robot.name: robot for robot in stage.robots}
    chosen = [shown[name] for name in dict.fromkeys(selected) if name in shown]
    if len(shown) <= FEW:
        chosen += [robot for robot in stage.robots if robot not in chosen]
    tabs = [robot_view(stage, robot) for robot in chosen]
    first = tabs and (selected or len(shown) == 1)
    team = team_view(stage, afterwards=afterwards)
    return rrb.Tabs(team, *tabs, active_tab=1 if first else 0)


def team_view(stage: Stage, *, afterwards: bool = False) -> Any:
    """Return the plots of the team."""
    import rerun.blueprint as rrb

    colours = stage_colours(stage)
    few = len(stage.robots) <= FEW
    hidden = rrb.PlotLegend(visible=False)
    key = hidden if few else rrb.PlotLegend(rrb.Corner2D.RightTop)

    def quantity(title: str, component: str) -> Any:
        if not few:
            return _series(title, f"/fleet/{component}", key)
        lines = {
            f"/plots/{robot.name}": drawn(component, [Line(robot.name, colours[robot.name], 1.5)])
            for robot in stage.robots
        }
        return _series(title, "/plots", hidden, lines)

    near = _series(_SEPARATIONS, "/fleet/separation", hidden, span=(0.0, _NEAR_M))
    ages = _series("Age of what is known, s", "/fleet/ages", key, span=(0.0, _AGES * stage.stale_s))
    of_law = [ages] if stage.law else []
    others = of_law
    if not afterwards:
        push = [quantity("Feed-forward, m/s", FEED_FORWARD)] if stage.law else []
        others = [*push, *of_law, _series("Times real time", "/fleet/factor", hidden)]
    rows = [rrb.Tabs(quantity("Off target, m", DISTANCE[0]), quantity("Speed, m/s", "speed"))]
    if others:
        rows.append(rrb.Tabs(*others, active_tab=0))
    shares = [1.0] * len(rows)
    if len(stage.robots) != 1:
        rows, shares = [near, *rows], [_FLAT, *shares]
    return rrb.Vertical(*rows, row_shares=shares, name="Team")


def robot_view(stage: Stage, robot: StagedRobot) -> Any:
    """Return the plots of one robot.

    Of a crowd's, distance and speed are always recorded, the rest if it was selected then.
    """
    import rerun.blueprint as rrb

    entity = f"/plots/{robot.name}"
    plots = []
    for panel in PANELS.get(robot.kind, OTHER_PANELS):
        legend = rrb.PlotLegend(rrb.Corner2D.RightTop, visible=panel.name != panel.title)
        lines = {entity: [drawn(*part) for part in panel.parts]}
        plots.append(_series(panel.name, entity, legend, lines, panel.span))
    if stage.crowded:
        plots[0] = _of_crowd(stage, robot, "Off target, m", DISTANCE[0])
        plots[2] = _of_crowd(stage, robot, "Speed, m/s", "speed")
    rows = [rrb.Tabs(*plots[:3], active_tab=0), rrb.Tabs(*plots[3:], active_tab=0)]
    if stage.crowded:
        return rrb.Vertical(*rows, name=robot.name)
    close = follow_view(stage, robot)
    return rrb.Vertical(close, *rows, row_shares=[_CLOSE, 1, 1], name=robot.name)


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
    span: tuple[float, float] | None = None,
) -> Any:
    import rerun.blueprint as rrb

    return rrb.TimeSeriesView(
        name=name,
        origin=origin,
        contents=list(drawn_as) if drawn_as else "$origin/**",
        overrides=drawn_as,
        plot_legend=legend,
        axis_x=_whole_run(),
        axis_y=rrb.ScalarAxis(range=span) if span else None,
    )


def _whole_run() -> Any:
    """Return a time axis from begin to end, where the viewer would show a minute around now."""
    import rerun.blueprint as rrb

    ever = rrb.TimeRangeBoundary.infinite()
    return rrb.TimeAxis(view_range=rrb.TimeRange(start=ever, end=ever))
