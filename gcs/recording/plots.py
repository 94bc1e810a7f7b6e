"""Numbers over time: of each robot, and of the team."""

import time
from collections.abc import Mapping, Sequence

from ...transport.wire import Target, VehicleState
from ..report.truth import Track
from .fleet_plots import FleetPlots
from .grid import Aligned
from .nearness import Near
from .robot_plot import RobotPlot
from .stage import Stage, StagedRobot
from .stream import Stream

PERIOD_S = 0.7  # of wall time, between two pieces of the recording: each has a price in bytes


class Plots:
    """Writes the time series of a recording. Of a crowd, only `selected` robots have their own."""

    def __init__(
        self,
        stream: Stream,
        stage: Stage,
        colours: Mapping[str, str],
        selected: Sequence[str] = (),
    ) -> None:
        self._stream = stream
        self._fleet = FleetPlots(stream, stage, colours)
        self._robots = {
            robot.name: RobotPlot(stream, robot.name, robot.kind)
            for robot in stage.robots
            if not stage.crowded or robot.name in selected
        }
        self._due = 0.0

    def add_robot(self, robot: StagedRobot) -> None:
        """Plot one more robot."""
        self._fleet.add_robot(robot)
        self._robots[robot.name] = RobotPlot(self._stream, robot.name, robot.kind)

    def add_truth(self, track: Track) -> None:
        """Record the rows of `track`, which follow those given before."""
        if robot := self._robots.get(track.name):
            robot.add_truth(track)

    def add_states(self, states: Sequence[VehicleState], now: float) -> None:
        """Record how old what the coordinator knows is at `now`."""
        self._fleet.add_states(states, now)

    def add_targets(self, targets: Sequence[Target]) -> None:
        """Record where robots should be."""
        self._fleet.add_targets(targets)
        for target in targets:
            if robot := self._robots.get(target.name):
                robot.add_target(target)

    def add_clock(self, now: float, factor: float) -> None:
        """Record how many times as fast as real time the run goes."""
        self._fleet.add_clock(now, factor)

    def add_places(self, aligned: Aligned, names: Sequence[str], near: Near) -> None:
        """Record where all robots were, in the order of `names`, and how near they came."""
        self._fleet.add_poses(aligned, names)
        self._fleet.add_separation(near.time, near.smallest)

    def flush(self, *, everything: bool = False) -> None:
        """Write what has gathered, now and then or `everything`."""
        if not everything and time.monotonic() < self._due:
            return
        self._due = time.monotonic() + PERIOD_S
        self._fleet.flush(everything=everything)
        for robot in self._robots.values():
            robot.flush(everything=everything)
