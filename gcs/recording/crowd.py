"""Many robots drawn together: an entity for each kind and thing, a row for all at a time."""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...transport.wire import Target, VehicleState
from ..report.truth import Floats
from .colours import CLEARANCE, FEED_FORWARD, VELOCITY, Rgb, tint
from .grid import RATE_HZ, Aligned
from .nearness import NEAR_M
from .shapes import mesh3d, radius_of, shape_of, whole
from .solo import AHEAD_S
from .stage import StagedRobot
from .stage_marks import mark_robots
from .stream import Stream

SLOW_HZ = 4  # arrows, circles and trails
BELIEF_HZ = 5
_LEAST_PUSH_M = 0.01  # shorter arrows are not drawn
_DISC_M = 0.08  # that a disc stands out from under its robot


class Crowd:
    """Writes what moves of the robots of one kind."""

    def __init__(self, stream: Stream, kind: str, colour: Rgb) -> None:
        import rerun as rr

        self._rr = rr
        self._stream = stream
        self._kind = kind
        self._colour = colour
        self._robots: dict[str, StagedRobot] = {}
        self._row: list[int] = []
        self._trail_end: Floats | None = None
        self._targets: dict[str, Target] = {}
        self._wants: list[tuple[float, list[Target]]] = []
        self._pushes: list[tuple[float, Floats]] = []  # by robot, waiting for truth
        self._beliefs: list[tuple[float, list[VehicleState]]] = []
        shape = shape_of(kind, colour, fine=False)
        self._arrow_up = np.array([0.0, 0.0, 0.36 if kind == "rover" else shape.top])
        dot = rr.Points3D([[0, 0, 0]], colors=[tint(colour, 0.5)], radii=rr.Radius.ui_points(4))
        self._put("robots", mesh3d(whole(shape)), dot)  # the dot is what is seen from afar
        self._looks: dict[str, Any] = {  # of what is there with its first row only
            "arrows/velocity": rr.Arrows3D.from_fields(colors=[VELOCITY], radii=0.02),
            "arrows/feed_forward": rr.Arrows3D.from_fields(colors=[FEED_FORWARD], radii=0.025),
            "trails": rr.LineStrips3D.from_fields(
                colors=[(*colour, 110)], radii=rr.Radius.ui_points(0.6)
            ),
            "targets": rr.Points3D.from_fields(
                colors=[(*colour, 110)], radii=rr.Radius.ui_points(1.5)
            ),
            "believed": rr.Points3D.from_fields(
                colors=[(*colour, 130)], radii=rr.Radius.ui_points(1.5)
            ),
        }

    def add_robots(self, robots: Sequence[StagedRobot]) -> None:
        """Draw some more."""
        self._robots |= {robot.name: robot for robot in robots}
        marked = [(robot, self._colour) for robot in self._robots.values()]
        mark_robots(self._stream, self._kind, marked)
        self._trail_end = None

    def add_poses(self, aligned: Aligned, rows: Mapping[str, int]) -> None:
        """Record poses, arrows and trails; `rows` says which of `aligned` is whose."""
        which = [rows[name] for name in self._robots]
        seen = np.isfinite(aligned.position[which, :, 0]).any(axis=0)
        time = aligned.time[seen]
        place, velocity, turned = (
            table[which][:, seen].swapaxes(0, 1)
            for table in (aligned.position, aligned.velocity, aligned.quaternion)
        )
        known = np.isfinite(place[..., 0])
        poses = self._rr.InstancePoses3D.columns(
            translations=_f32(place[known]), quaternions=_f32(turned[known][:, [1, 2, 3, 0]])
        )
        self._send("robots", time, poses, known.sum(axis=1))
        slow = _slow(time)
        time, known, place = time[slow], known[slow], place[slow]
        arrows = self._rr.Arrows3D.columns(
            origins=_f32(place[known] + self._arrow_up),
            vectors=_f32(np.nan_to_num(velocity[slow][known]) * AHEAD_S),
        )
        self._send("arrows/velocity", time, arrows, known.sum(axis=1))
        self._add_pushes(time, known, place)
        self._add_trails(time, place)

    def add_clearance(
        self, aligned: Aligned, rows: Mapping[str, int], clearance: Mapping[str, Floats]
    ) -> None:
        """Record a disc under each robot to which others are near, or which they touch."""
        names = [name for name in self._robots if name in clearance]
        slow = _slow(aligned.time)
        if not names or not len(slow):
            return
        place = aligned.position[[rows[name] for name in names]][:, slow].swapaxes(0, 1)
        gap = np.array([clearance[name] for name in names]).T[slow]
        shown = np.isfinite(place[..., 0]) & (gap < NEAR_M)
        count = int(shown.sum())
        discs = self._rr.Cylinders3D.columns(
            centers=_f32(place[shown]),
            lengths=np.full(count, 0.02, np.float32),
            radii=np.full(count, radius_of(self._kind) + _DISC_M, np.float32),
            colors=np.array(CLEARANCE, dtype=np.uint8)[1 + (gap[shown] < 0)],
        )
        self._send("circles", aligned.time[slow], discs, shown.sum(axis=1))

    def add_states(self, states: Sequence[VehicleState], now: float) -> None:
        """Record where the coordinator believes these robots to be at `now`."""
        if not self._beliefs or now >= self._beliefs[-1][0] + 0.99 / BELIEF_HZ:
            self._beliefs.append((now, [s for s in states if s.name in self._robots]))

    def add_targets(self, targets: Sequence[Target]) -> None:
        """Record where these robots should be and how they are pushed off their ways."""
        mine = {target.name: target for target in targets if target.name in self._robots}
        if not mine:
            return
        self._targets |= mine
        now = max(target.time for target in mine.values())
        if not self._wants or now >= self._wants[-1][0] + 0.99 / SLOW_HZ:
            self._wants.append((now, list(self._targets.values())))
            still = (0.0, 0.0, 0.0)
            pushes = [t.feed_forward if (t := mine.get(n)) else still for n in self._robots]
            self._pushes.append((now, np.nan_to_num(np.array(pushes)) * AHEAD_S))

    def flush(self) -> None:
        """Write what has gathered."""
        rr = self._rr
        beliefs, self._beliefs = [(t, s) for t, s in self._beliefs if s], []
        if beliefs:
            places = _f32([state.position for _, states in beliefs for state in states])
            counts = [len(states) for _, states in beliefs]
            time = np.array([now for now, _ in beliefs])
            self._send("believed", time, rr.Points3D.columns(positions=places), counts)
        wants, self._wants = self._wants, []
        if wants:
            known = [
                [t.nominal_position for t in targets if isfinite(sum(t.nominal_position))]
                for _, targets in wants
            ]
            places = _f32([place for row in known for place in row]).reshape(-1, 3)
            time = np.array([now for now, _ in wants])
            points = rr.Points3D.columns(positions=places)
            self._send("targets", time, points, [len(row) for row in known])

    def _add_pushes(self, time: Floats, known: NDArray[np.bool_], place: Floats) -> None:
        """Record what the coordination law added at each time, as far as that was told."""
        robots = len(self._robots)
        said = [(when, pushes) for when, pushes in self._pushes if len(pushes) == robots]
        if not said or not len(time):
            return
        latest = np.searchsorted([when for when, _ in said], time + 1e-6) - 1
        vectors = np.array([pushes for _, pushes in said])[np.maximum(latest, 0)]
        shown = known & (latest >= 0)[:, None] & (np.abs(vectors).max(axis=2) > _LEAST_PUSH_M)
        arrows = self._rr.Arrows3D.columns(
            origins=_f32(place[shown] + self._arrow_up), vectors=_f32(vectors[shown])
        )
        self._send("arrows/feed_forward", time, arrows, shown.sum(axis=1))
        self._pushes = said[max(0, int(latest[-1])) :]

    def _add_trails(self, time: Floats, place: Floats) -> None:
        """Record a piece for every robot from where its last one ended."""
        if not len(time):
            return
        before = self._trail_end if self._trail_end is not None else np.full_like(place[0], np.nan)
        begins = np.concatenate([before[None], place[:-1]])
        pieces = np.stack([begins, place], axis=2)  # (t, robots, 2, 3)
        known = np.isfinite(pieces).all(axis=(2, 3))
        columns = self._rr.LineStrips3D.columns(strips=_f32(pieces[known]))
        if known.any():
            self._send("trails", time, columns, known.sum(axis=1))
        self._trail_end = place[-1]

    def _send(self, what: str, time: Floats, columns: Any, counts: Any) -> None:
        if len(time):
            if look := self._looks.pop(what, None):
                self._put(what, look)
            entity = f"world/{what}/{self._kind}"
            self._stream.columns(entity, time, columns.partition(counts))

    def _put(self, what: str, *parts: Any) -> None:
        self._stream.static(f"world/{what}/{self._kind}", *parts)


def _slow(time: Floats) -> NDArray[np.int_]:
    return np.flatnonzero(np.rint(time * RATE_HZ).astype(int) % round(RATE_HZ / SLOW_HZ) == 0)


def _f32(values: Any) -> NDArray[np.float32]:
    return np.asarray(values, dtype=np.float32)
