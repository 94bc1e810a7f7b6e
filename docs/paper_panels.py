"""The panels of the paper's figures: tracks in space and from above, distances over time.

All matplotlib, laid out by hand like the figures of a report.
"""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from missions import Flight

from mavherd.gcs.report.contact import BODIES, align, contact_distance, separations
from mavherd.gcs.report.figure_plan import asked_for
from mavherd.gcs.report.figure_style import (
    GRID,
    INK,
    PATH,
    RATE_HZ,
    SOFT,
    Box,
    collision_mark,
    robot_colours,
)
from mavherd.gcs.report.truth import Floats, Track
from mavherd.scenarios.route import Route
from mavherd.transport.frames import yaw_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROOM_M = 0.6  # around all that is drawn
STEEP = 1.5  # heights in space are drawn so much taller
ELEVATION, AZIMUTH, ZOOM = 30, -62, 1.3
FAR_M = 3.2  # separations beyond this are not shown
KIND_COLOURS = {"rover": INK, "quadcopter": "#8A6FBF"}  # no robot of six has one of these


class Extent(NamedTuple):
    """What a panel shows: two corners, and up to which height."""

    low: Floats
    high: Floats
    top: float


def extent(flights: Iterable[Flight]) -> Extent:
    """Return the room that all flights need."""
    ways = np.concatenate([flight.way(track) for flight in flights for track in flight.tracks])
    low, high = ways.min(axis=0), ways.max(axis=0)
    return Extent(low[:2] - ROOM_M, high[:2] + ROOM_M, float(high[2]) + 0.3)


def colours_of(flight: Flight) -> dict[str, str]:
    """Return the colour of each robot, the same in every panel."""
    return robot_colours({track.name: track.kind for track in flight.tracks})


def in_space(figure: "Figure", box: Box, title: str, flight: Flight, room: Extent) -> None:
    """Draw the tracks from the ground up to when all have arrived, as the paper does."""
    wide, high = figure.get_size_inches()
    corner = (box.left / wide, box.bottom / high, box.width / wide, box.height / high)
    axes: Any = figure.add_axes(corner, projection="3d", computed_zorder=False)
    heading: dict[str, Any] = {"fontsize": 12, "weight": "bold", "color": INK}
    figure.text(corner[0], corner[1] + corner[3], title, **heading)
    for spec, track in zip(flight.starts, flight.tracks, strict=True):
        colour = colours_of(flight)[track.name]
        asked, way = asked_for(spec, flight.scenario), flight.way(track)
        foot = np.array([way[-1], [*way[-1, :2], 0.0]])
        if len(asked) > 1:
            axes.plot(*asked.T, "--", color=PATH, lw=1.2, zorder=2)
        else:
            axes.plot(*asked.T, "x", color=colour, ms=8, mew=1.8, zorder=5)
        axes.plot(*way.T, color=colour, lw=1.5, zorder=4)
        axes.plot(*way[:1].T, "s", ms=5, mfc="white", mec=colour, mew=1.3, zorder=5)
        axes.plot(*way[-1:].T, "o", ms=5, color=colour, zorder=6)
        axes.plot(*foot.T, ":", color=colour, lw=0.9, zorder=3)
    if hits := flight.collisions:
        places = [[e[axis] for e in hits] for axis in ("east_m", "north_m", "up_m")]
        axes.plot(*places, zorder=9, **collision_mark(len(hits)))
    for line in axes.lines:
        line.set_clip_on(False)
    _frame(axes, room)


def _frame(axes: Any, room: Extent) -> None:
    """Give a panel in space quiet axes to scale."""
    from matplotlib.ticker import MaxNLocator

    axes.patch.set_visible(False)
    low, high, top = room
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(0, top))
    axes.set_box_aspect((*(high - low), STEEP * top), zoom=ZOOM)
    axes.view_init(elev=ELEVATION, azim=AZIMUTH)
    for axis, name, ticks in zip(
        (axes.xaxis, axes.yaxis, axes.zaxis), ("east", "north", "up"), (6, 6, 3), strict=True
    ):
        axis.set_pane_color((1, 1, 1, 0))
        axis.line.set_color(SOFT)
        axis._axinfo["grid"].update(color=GRID, linewidth=0.8)
        axis.set_major_locator(MaxNLocator(ticks, integer=True))
        axis.set_tick_params(labelsize=8, colors=SOFT, pad=-2)
        axis.set_label_text(f"{name}, m", color=SOFT, fontsize=8.5)
        axis.labelpad = -11 if name == "up" else -5  # its ticks are short


def from_above(axes: "Axes", flight: Flight, room: Extent) -> None:
    """Draw the tracks from above, and the robots to size where they end."""
    count = len(flight.collisions)
    text = f"{count} collision{'s' * (count > 1)}" if count else "no collision"
    style: dict[str, Any] = {"ha": "right", "fontsize": 11, "weight": "bold"}
    colour = "#B3261E" if count else "#00664B"
    axes.text(0.98, 0.03, text, transform=axes.transAxes, color=colour, **style)
    axes.set(xlim=(room.low[0], room.high[0]), ylim=(room.low[1], room.high[1]))
    for spec, track in zip(flight.starts, flight.tracks, strict=True):
        colour = colours_of(flight)[track.name]
        asked, way = asked_for(spec, flight.scenario), flight.way(track)
        if len(asked) > 1:
            axes.plot(asked[:, 0], asked[:, 1], "--", color=PATH, lw=1.0, zorder=2)
        else:
            axes.plot(*asked[0, :2], "x", color=colour, ms=8, mew=1.8, zorder=5)
        axes.plot(way[:, 0], way[:, 1], color=colour, lw=1.3, zorder=3)
        axes.plot(*way[0, :2], "s", ms=5, mfc="white", mec=colour, mew=1.3, zorder=5)
        _robot(axes, track, flight.last_row(track), colour)
    hits = flight.collisions
    places = [e["east_m"] for e in hits], [e["north_m"] for e in hits]
    axes.plot(*places, zorder=9, **collision_mark(len(hits)))


def _robot(axes: "Axes", track: Track, row: int, colour: str) -> None:
    """Draw the circle in which others touch it, and a nose."""
    from matplotlib.patches import Circle

    east, north = track.position[row, :2].tolist()
    w, x, y, z = track.quaternion[row].tolist()
    yaw, radius = yaw_of((w, x, y, z)), BODIES[track.kind].radius
    axes.add_patch(Circle((east, north), radius, fc=colour, ec="none", alpha=0.3, zorder=4))
    axes.add_patch(Circle((east, north), radius, fill=False, ec=colour, lw=1.4, zorder=6))
    reach = 1.25 * radius
    nose = (east, east + reach * np.cos(yaw)), (north, north + reach * np.sin(yaw))
    axes.plot(*nose, color=colour, lw=1.6, zorder=6)


def how_near(axes: "Axes", flight: Flight) -> None:
    """Draw the smallest separation of rovers and of quadcopters, and where they would touch."""
    end = flight.done - flight.ready
    time, position = align(flight.tracks, flight.ready, flight.done, RATE_HZ)
    kinds = [track.kind for track in flight.tracks]
    for kind, colour in KIND_COLOURS.items():
        contact = contact_distance(kind, kind)
        mine = [k for k, other in enumerate(kinds) if other == kind]
        smallest = np.full(len(time), np.inf)
        for k in mine[:-1]:
            _, squared = separations(kinds, position, k, slice(k + 1, mine[-1] + 1))
            smallest = np.minimum(smallest, squared.min(axis=0))
        axes.plot(time - flight.ready, np.sqrt(smallest), color=colour, lw=1.7, zorder=4)
        axes.axhline(contact, color=colour, lw=1.2, ls="--", zorder=3)
    if hits := flight.collisions:
        contacts = [contact_distance(*e["class"].split("-")) for e in hits]
        times = [e["time_s"] - flight.ready for e in hits]
        axes.plot(times, contacts, zorder=9, **collision_mark(len(hits)))
    axes.set(xlim=(0, end), ylim=(0, FAR_M), yticks=(0, 1, 2, 3))


def how_far_off(axes: "Axes", flight: Flight, most: float) -> None:
    """Draw how far each robot is from where its path leads at the moment, up to `most` metres."""
    results = {robot["name"]: robot for robot in flight.report["robots"]}
    for track in flight.tracks:
        text = f"{track.name}: RMSE {results[track.name]['tracking_rmse_m']:.2f} m"
        axes.plot(*_error(flight, track), color=colours_of(flight)[track.name], lw=1.4, label=text)
    axes.set(xlim=(0, flight.done - flight.ready), ylim=(0, most))
    axes.legend(loc="upper right", ncols=2, frameon=False, fontsize=9, labelcolor=INK)


def _error(flight: Flight, track: Track) -> tuple[Floats, Floats]:
    """Return time since all were ready, and the distance from where the robot should be."""
    spec = next(spec for spec in flight.starts if spec.name == track.name)
    route = Route(spec.path, spec, flight.scenario.team)
    first = int(np.searchsorted(track.time, flight.ready - 1e-6))
    rows = slice(first, flight.last_row(track), 10)
    time = track.time[rows] - flight.ready
    asked = np.array([route.at(t).position for t in time.tolist()])
    axes = 2 if track.kind == "rover" else 3
    return time, np.hypot.reduce((track.position[rows] - asked)[:, :axes], axis=1)
