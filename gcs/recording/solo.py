"""One robot drawn in full: how it moves and turns, its trail, target, arrows, circle and ghost."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...transport.frames import Triple
from ...transport.wire import Target, VehicleState
from ..report.truth import Floats, Track
from .colours import CLEARANCE, CLEARANCE_POINTS, FEED_FORWARD, STALE, VELOCITY, tint
from .nearness import NEAR_M
from .shapes import mesh3d, radius_of, ring, shape_of
from .spin import Spin
from .stage import StagedRobot
from .stream import Stream

POSE_HZ = 25
ARROW_HZ = 10
TRAIL_HZ = 4
BELIEF_HZ = 10
AHEAD_S = 0.5  # arrows end where the robot would be after this time
_AXES_M = 0.3
_STILL_M = 0.02  # less than this is no new piece of trail


class Solo:
    """Writes what moves of one robot; batches of truth follow one another.

    Its name stands `lift` m over it, and for a view from above `flag` m to its north.
    """

    def __init__(
        self,
        stream: Stream,
        robot: StagedRobot,
        colour: tuple[int, int, int],
        stale_s: float,
        lift: float,
        flag: float,
    ) -> None:
        import rerun as rr

        self._rr = rr
        self._stream = stream
        self._name = robot.name
        self._stale_s = stale_s
        self._shape = shape_of(robot.kind, colour)
        self._spin = Spin(robot.kind)
        self._newest: dict[int, int] = {}  # step last drawn, by rate
        self._trail_end: Floats | None = None
        self._level: int | None = None  # of the clearance
        self._pushed = False  # by feed-forward
        self._beliefs: list[tuple[float, VehicleState]] = []
        self._was_stale: bool | None = None
        self._targets: list[Target] = []
        self._last_target: Triple | None = None
        self._kind = robot.kind
        self._colour = colour
        self._put: set[str] = set()
        self._log_static(robot, lift, flag)

    def add_truth(self, track: Track) -> None:
        """Record the rows of `track`."""
        rr, name = self._rr, self._name
        pose = self._rows(track.time, POSE_HZ)
        time = track.time[pose]
        here = rr.Transform3D.columns(translation=_f32(track.position[pose]))
        self._stream.columns(f"world/robots/{name}", time, here)
        xyzw = _f32(track.quaternion[pose][:, [1, 2, 3, 0]])
        self._stream.columns(
            f"world/robots/{name}/body", time, rr.Transform3D.columns(quaternion=xyzw)
        )
        spun, turns = self._spin.advance(track, pose)
        if len(spun):
            places = np.tile(_f32(self._shape.places), (len(spun), 1))
            columns = rr.InstancePoses3D.columns(
                translations=places, quaternions=_f32(turns).reshape(-1, 4)
            ).partition([turns.shape[1]] * len(spun))
            self._stream.columns(f"world/robots/{name}/body/{self._spin.entity}", spun, columns)
        arrow = self._rows(track.time, ARROW_HZ)
        vectors = np.nan_to_num(track.velocity[arrow]) * AHEAD_S
        columns = rr.Arrows3D.columns(vectors=_f32(vectors))
        self._send("arrows/velocity", track.time[arrow], columns)
        self._add_trail(track)

    def add_state(self, state: VehicleState, now: float) -> None:
        """Record where the coordinator believes it to be at `now`."""
        if not self._beliefs or now >= self._beliefs[-1][0] + 0.99 / BELIEF_HZ:
            self._beliefs.append((now, state))

    def add_target(self, target: Target) -> None:
        """Record where it should be and how it is pushed off its way."""
        self._targets.append(target)

    def add_clearance(self, time: Floats, clearance: Floats) -> None:
        """Record how near others are; NaN counts as far."""
        near, contact = clearance < NEAR_M, clearance < 0
        level = near.astype(int) + contact
        before = np.concatenate([[-1 if self._level is None else self._level], level[:-1]])
        changes = np.flatnonzero(level != before)
        if not len(changes):
            return
        self._level = int(level[-1])
        columns = self._rr.LineStrips3D.columns(
            colors=[CLEARANCE[k] for k in level[changes]],
            radii=self._rr.Radius.ui_points([CLEARANCE_POINTS[k] for k in level[changes]]),
        )
        self._send("circles", time[changes], columns)

    def flush(self) -> None:
        """Write what has gathered."""
        self._flush_beliefs()
        self._flush_targets()

    def _send(self, thing: str, time: Floats, columns: Any) -> None:
        if len(time):
            self._put_once(thing)
            self._stream.columns(f"world/{thing}/{self._name}", time, columns)

    def _rows(self, time: Floats, rate: int) -> NDArray[np.int_]:
        """Return the rows that are the first at or after a step of `rate`."""
        step = np.floor(time * rate + 1e-3).astype(int)
        before = np.concatenate([[self._newest.get(rate, -1)], step[:-1]])
        if len(step):
            self._newest[rate] = int(step[-1])
        return np.flatnonzero(step != before)

    def _add_trail(self, track: Track) -> None:
        pieces, times = [], []
        for row in self._rows(track.time, TRAIL_HZ).tolist():
            place = track.position[row]
            last = self._trail_end
            if last is not None and not np.linalg.norm(place - last) >= _STILL_M:
                continue
            self._trail_end = place
            if last is not None:
                pieces.append([last, place])
                times.append(track.time[row])
        if pieces:
            columns = self._rr.LineStrips3D.columns(strips=_f32(np.array(pieces)))
            self._send("trails", np.array(times), columns)

    def _flush_beliefs(self) -> None:
        rr, beliefs = self._rr, self._beliefs
        if not beliefs:
            return
        self._beliefs = []
        entity = f"world/believed/{self._name}"
        time = np.array([now for now, _ in beliefs])
        turned = np.array([state.quaternion for _, state in beliefs])[:, [1, 2, 3, 0]]
        places = np.array([state.position for _, state in beliefs])
        columns = rr.Transform3D.columns(translation=_f32(places), quaternion=_f32(turned))
        self._send("believed", time, columns)
        for now, state in beliefs:
            age = now - state.time
            stale = age > self._stale_s
            if stale or stale != self._was_stale:
                text = f"{self._name}: {age:.1f} s old" if stale else ""
                colour = STALE if stale else (*self._colour, 255)
                note = rr.LineStrips3D.from_fields(colors=[colour], labels=[text])
                self._stream.log(f"{entity}/ghost", now, note)
            self._was_stale = stale

    def _flush_targets(self) -> None:
        rr, targets = self._rr, self._targets
        self._targets = []
        moved = []
        for target in targets:
            if target.nominal_position != self._last_target:
                self._last_target = target.nominal_position
                moved.append(target)
        if moved:
            places = _f32([target.nominal_position for target in moved])
            time = np.array([target.time for target in moved])
            known = np.isfinite(places).all(axis=1)
            columns = rr.Points3D.columns(positions=places[known]).partition(known.astype(int))
            if known.any() or "targets" in self._put:
                self._send("targets", time, columns)
        pushes = []
        for target in targets:
            pushed = any(target.feed_forward)
            if pushed or self._pushed:
                pushes.append((target.time, target.feed_forward))
            self._pushed = pushed
        if pushes:
            vectors = np.nan_to_num(_f32([push for _, push in pushes])) * np.float32(AHEAD_S)
            columns = rr.Arrows3D.columns(vectors=vectors)
            time = np.array([when for when, _ in pushes])
            self._send("arrows/feed_forward", time, columns)

    def _log_static(self, robot: StagedRobot, lift: float, flag: float) -> None:
        """Record what there is of a robot from the beginning: its shape, name and axes."""
        rr, name, shape, put = self._rr, self._name, self._shape, self._stream.static
        here, body = f"world/robots/{name}", f"world/robots/{name}/body"
        put(body, mesh3d(shape.body))
        if shape.spinner is not None:
            put(f"{body}/{self._spin.entity}", mesh3d(shape.spinner))
        paint, up = tint(self._colour), shape.top
        level, thin = rr.CoordinateFrame(f"tf#/{here}"), rr.Radius.ui_points(0.7)
        names = ("labels", [0, 0, up + lift]), ("flags", [0, flag, up])
        for what, head in names:
            pole = rr.LineStrips3D([[[0, 0, up], head]], colors=[(*paint, 70)], radii=thin)
            text = rr.Points3D([head], radii=0.001, colors=[paint], labels=[name], show_labels=True)
            put(f"world/{what}/{name}", level, text, pole)
        put(f"world/axes/{name}", rr.CoordinateFrame(f"tf#/{body}"), rr.TransformAxes3D(_AXES_M))

    def _put_once(self, thing: str) -> None:
        """Record the look of a thing before its first row: without rows it must not be there."""
        if thing in self._put:
            return
        self._put.add(thing)
        rr, colour, shape, points = self._rr, self._colour, self._shape, self._rr.Radius.ui_points
        level = rr.CoordinateFrame(f"tf#/world/robots/{self._name}")
        up = 0.36 if self._spin.entity == "wheels" else shape.top + 0.02
        look: tuple[Any, ...]
        match thing:
            case "circles":
                strips = [ring(radius_of(self._kind))]
                look = (level, rr.LineStrips3D.from_fields(strips=strips))
            case "trails":
                look = (rr.LineStrips3D.from_fields(colors=[colour], radii=points(1.5)),)
            case "targets":
                look = (rr.Points3D.from_fields(colors=[colour], radii=points(5)),)
            case "believed":
                wire = rr.LineStrips3D.from_fields(strips=list(shape.wire), radii=points(1))
                self._stream.static(f"world/believed/{self._name}/ghost", wire)
                return
            case _:
                paint = VELOCITY if thing == "arrows/velocity" else FEED_FORWARD
                origin = [[0, 0, up if thing == "arrows/velocity" else up + 0.05]]
                look = (level, rr.Arrows3D.from_fields(origins=origin, colors=[paint], radii=0.011))
        self._stream.static(f"world/{thing}/{self._name}", *look)


def _f32(values: Any) -> NDArray[np.float32]:
    return np.asarray(values, dtype=np.float32)
