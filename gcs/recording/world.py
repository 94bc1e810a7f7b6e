"""The world: where the robots are, what they look like, where they go and how near they come.

A small team is drawn robot by robot (`Solo`), a large one kind by kind (`Crowd`); robots that
turn up late join a crowd once there are many. Entities are `world/<thing>/<robot or kind>`.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from ...transport.wire import Target, VehicleState
from ..report.truth import Track
from .chart import Chart
from .colours import COLLISION
from .crowd import Crowd
from .grid import Aligned, Grid
from .nearness import Contact, Near, Nearness
from .solo import Solo
from .stage import MANY, Stage, StagedRobot
from .stage_marks import mark_fence, mark_robots
from .stream import Stream, rgb
from .views import reach_of

_NAMED_COLLISIONS = 20  # more names would hide the world
_MARK_M = 0.3
_FAR_M = 50.0  # across: names are not further away in a larger world
_LIFT, _FLAG = 0.035, 0.06  # between one name and the next, by how far it is across the world
_NAMES = 3  # robots whose names are at different heights


class World:
    """Writes the part of a recording that is seen in space; `colours` is #rrggbb by robot."""

    def __init__(self, stream: Stream, stage: Stage, colours: Mapping[str, str]) -> None:
        import rerun as rr

        self._rr = rr
        self._stream = stream
        self._stale_s = stage.stale_s
        self._across = min(reach_of(stage), _FAR_M)
        self._grid = Grid()
        self._nearness = Nearness()
        self._chart = Chart(stream, stage.origin)
        self._solos: dict[str, Solo] = {}
        self._crowds: dict[str, Crowd] = {}
        self._collisions = 0
        stream.static("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        if stage.fence is not None:
            mark_fence(stream, stage.fence)
        if stage.crowded:
            for robot in stage.robots:
                self._watch(robot)
            for kind in dict.fromkeys(stage.kinds.values()):
                alike = [robot for robot in stage.robots if robot.kind == kind]
                self._add_crowd(kind, alike, colours[alike[0].name])
        else:
            for robot in stage.robots:
                self.add_robot(robot, colours[robot.name])

    def add_robot(self, robot: StagedRobot, colour: str) -> None:
        """Draw one more robot."""
        self._watch(robot)
        if self._crowds or len(self._solos) >= MANY:
            self._add_crowd(robot.kind, [robot], colour)
            return
        paint = rgb(colour)
        row, place = divmod(len(self._solos), _NAMES)
        lift = _LIFT * self._across * (1.7 + place)
        flag = _FLAG * self._across * (1 + place) * (1 if row % 2 else -1)
        solo = Solo(self._stream, robot, paint, self._stale_s, lift, flag)
        self._solos[robot.name] = solo
        mark_robots(self._stream, robot.name, [(robot, paint)])
        self._chart.add_robots(robot.name, [robot], paint)

    def add_truth(self, track: Track) -> None:
        """Record the rows of `track`, which follow those given before."""
        if not len(track):
            return
        self._grid.add(track)
        if solo := self._solos.get(track.name):
            solo.add_truth(track)

    def add_states(self, states: Sequence[VehicleState], now: float) -> None:
        """Record where the coordinator believes the robots to be at `now`."""
        for crowd in self._crowds.values():
            crowd.add_states(states, now)
        for state in states:
            if solo := self._solos.get(state.name):
                solo.add_state(state, now)

    def add_targets(self, targets: Sequence[Target]) -> None:
        """Record where robots should be and how they are pushed off their ways."""
        for crowd in self._crowds.values():
            crowd.add_targets(targets)
        for target in targets:
            if solo := self._solos.get(target.name):
                solo.add_target(target)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the robots in the order of the rows that `flush` returns."""
        return self._grid.names

    def flush(self, *, everything: bool = False) -> tuple[Aligned, Near]:
        """Write what has gathered; return where all were meanwhile, and how near they came."""
        aligned = self._grid.take(everything=everything)
        rows = {name: row for row, name in enumerate(self._grid.names)}
        near = self._nearness.examine(aligned.time, rows, aligned.position)
        self._chart.add_poses(aligned, rows)
        for name, solo in self._solos.items():
            if name in near.clearance:
                solo.add_clearance(near.time, near.clearance[name])
            solo.flush()
        for crowd in self._crowds.values():
            crowd.add_poses(aligned, rows)
            crowd.add_clearance(aligned, rows, near.clearance)
            crowd.flush()
        for contact in near.contacts:
            self._mark(contact)
        return aligned, near

    def _watch(self, robot: StagedRobot) -> None:
        self._grid.add_robot(robot.name)
        self._nearness.add_robot(robot.name, robot.kind)

    def _add_crowd(self, kind: str, robots: Sequence[StagedRobot], colour: str) -> None:
        if kind not in self._crowds:
            self._crowds[kind] = Crowd(self._stream, kind, rgb(colour))
        self._crowds[kind].add_robots(robots)
        self._chart.add_robots(kind, robots, rgb(colour))

    def _mark(self, contact: Contact) -> None:
        """Put a mark where two robots touched; the view shows all that came so far."""
        rr = self._rr
        if not self._collisions:
            look = rr.LineStrips3D.from_fields(colors=[COLLISION], radii=rr.Radius.ui_points(3))
            self._stream.static("world/collisions", look)
        self._collisions += 1
        arms = np.array([[1, 1, 1], [1, -1, 1], [-1, 1, 1], [-1, -1, 1]]) * _MARK_M / 2
        strips = [np.array([arm, -arm]) + contact.place for arm in arms]
        text = f"{' and '.join(contact.names)} at {contact.time:.1f} s"
        labels = [text] if self._collisions <= _NAMED_COLLISIONS else []
        marks = np.array(strips, dtype=np.float32)
        mark = rr.LineStrips3D.from_fields(strips=marks, labels=[*labels, *[""] * len(labels) * 3])
        self._stream.log("world/collisions", contact.time, mark)
