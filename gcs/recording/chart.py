"""The map: where the robots are in degrees of latitude and longitude (WGS-84).

The viewer fetches the picture of the ground from the network; without one the ground is empty.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...transport.frames import Origin
from ..report.truth import Floats
from .colours import Rgb
from .grid import RATE_HZ, Aligned
from .stage import StagedRobot
from .stream import Stream

MAP_HZ = 2
_SPAN_M = 1000.0


class Chart:
    """Writes what is seen on the map: the robots of one group are the points of one entity."""

    def __init__(self, stream: Stream, origin: Origin) -> None:
        import rerun as rr

        self._rr = rr
        self._stream = stream
        lat_deg, lon_deg = origin.to_geodetic(_SPAN_M, _SPAN_M)
        turn = (lon_deg - origin.lon_deg + 180) % 360 - 180
        self._origin = np.array([origin.lat_deg, origin.lon_deg])
        # degrees are proportional to metres from the origin: see Origin
        self._deg_per_m = np.array([lat_deg - origin.lat_deg, turn]) / _SPAN_M
        self._groups: dict[str, list[str]] = {}
        self._ends: dict[str, Floats] = {}
        self._looks: dict[str, Any] = {}  # of trails that are not there yet

    def add_robots(self, group: str, robots: Sequence[StagedRobot], colour: Rgb) -> None:
        """Show some more, in the `colour` of their group."""
        rr, put = self._rr, self._stream.static
        self._groups.setdefault(group, []).extend(robot.name for robot in robots)
        self._ends.pop(group, None)
        big = rr.Radius.ui_points(6 if len(self._groups[group]) == 1 else 3)
        thin = rr.Radius.ui_points(1.5)
        put(f"map/robots/{group}", rr.GeoPoints.from_fields(colors=[colour], radii=big))
        self._looks[group] = rr.GeoLineStrings.from_fields(colors=[colour], radii=thin)
        ways = [self.degrees(np.array(robot.path)) for robot in robots if robot.path]
        if ways and len(self._groups[group]) == 1:
            faint = (*colour, 90)
            lines = rr.GeoLineStrings(lat_lon=ways, colors=[faint], radii=rr.Radius.ui_points(3))
            put(f"map/paths/{group}", lines)

    def add_poses(self, aligned: Aligned, rows: Mapping[str, int]) -> None:
        """Record places and trails; `rows` says which of `aligned` is whose."""
        steps = np.rint(aligned.time * RATE_HZ).astype(int)
        shown = np.flatnonzero(steps % round(RATE_HZ / MAP_HZ) == 0)
        if not len(shown):
            return
        time = aligned.time[shown]
        for group, names in self._groups.items():
            place = aligned.position[[rows[name] for name in names]][:, shown].swapaxes(0, 1)
            spot = self.degrees(place)
            known = np.isfinite(spot[..., 0])
            points = self._rr.GeoPoints.columns(positions=spot[known])
            counts = known.sum(axis=1)
            self._stream.columns(f"map/robots/{group}", time, points.partition(counts))
            if len(names) > 1:
                continue  # the trails of many would cost more than all the rest
            before = self._ends.get(group, np.full_like(spot[0], np.nan))
            pieces = np.stack([np.concatenate([before[None], spot[:-1]]), spot], axis=2)
            whole = np.isfinite(pieces).all(axis=(2, 3))
            self._ends[group] = spot[-1]
            if whole.any():
                if look := self._looks.pop(group, None):
                    self._stream.static(f"map/trails/{group}", look)
                lines = self._rr.GeoLineStrings.columns(line_strings=list(pieces[whole]))
                counts = whole.sum(axis=1)
                self._stream.columns(f"map/trails/{group}", time, lines.partition(counts))

    def degrees(self, place: Floats) -> Floats:
        """Return latitude and longitude in degrees of places (..., 3) in ENU."""
        found: Floats = self._origin + place[..., [1, 0]] * self._deg_per_m
        found[..., 1] = (found[..., 1] + 180) % 360 - 180
        return found
