"""What a recording shows: the world, plots, modes and events of a run, from what is told of it.

Everything may come in any order and at any time; what belongs together waits for its other half.
All of it is ENU over the timeline `sim_time`.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ...transport.wire import Target, VehicleState
from ..report.truth import Track
from .colours import next_colour, stage_colours
from .layout import layout
from .plots import Plots
from .stage import Stage, StagedRobot
from .stream import Stream
from .timeline import Timeline
from .world import World

Layout = Callable[[Stage, Sequence[str]], Any]


class Scene:
    """Turns what is told of a run into one recording.

    `lay_out` makes the blueprint, again whenever a robot turns up. Of a crowd, only `selected`
    robots have plots of their own; of others the plots of those are shown first.
    """

    def __init__(
        self,
        stream: Stream,
        stage: Stage,
        selected: Sequence[str] = (),
        *,
        lay_out: Layout = layout,
    ) -> None:
        self.stream = stream
        self.stage = stage
        self._selected = tuple(selected)
        self._layout = lay_out
        self._is_laid_out = False
        self._colours = stage_colours(stage)
        self._world = World(stream, stage, self._colours)
        self._plots = Plots(stream, stage, self._colours, selected)
        self._timeline = Timeline(stream, stage)
        stream.name(stage.title)
        self._lay_out()

    def add_robot(self, robot: StagedRobot) -> None:
        """Make room for a robot that turns up late; one of a known name changes nothing."""
        if robot.name in self._colours:
            return
        colour = self._colours[robot.name] = next_colour(robot, self._colours)
        self.stage = self.stage._replace(robots=(*self.stage.robots, robot))
        self._is_laid_out = False
        self._world.add_robot(robot, colour)
        self._plots.add_robot(robot)
        self._timeline.add_robot(robot)

    def add_truth(self, track: Track) -> None:
        """Record the rows of `track`, which follow those given before."""
        self._world.add_truth(track)
        self._plots.add_truth(track)

    def add_states(self, states: Sequence[VehicleState], now: float) -> None:
        """Record what the coordinator believed at `now` of fleet time."""
        self._world.add_states(states, now)
        self._plots.add_states(states, now)
        self._timeline.add_states(states)

    def add_targets(self, targets: Sequence[Target]) -> None:
        """Record where robots should be; how far off they are follows when their truth is here."""
        self._world.add_targets(targets)
        self._plots.add_targets(targets)

    def add_event(self, event: Mapping[str, Any]) -> None:
        """Record a line of `events.jsonl`: t, vehicle (or None), kind, text, perhaps severity."""
        self._timeline.add_event(event)

    def add_clock(self, now: float, factor: float) -> None:
        """Record that at `now` the run goes `factor` times as fast as real time."""
        self._plots.add_clock(now, factor)

    def add_mode(self, name: str, time: float, mode: str) -> None:
        """Record the flight mode of a robot, in words, where it is another than before."""
        self._timeline.add_mode(name, time, mode)

    def flush(self, *, everything: bool = False) -> None:
        """Write what has gathered; `everything`: also what still waits for its other half."""
        self._lay_out()
        aligned, near = self._world.flush(everything=everything)
        self._plots.add_places(aligned, self._world.names, near)
        for contact in near.contacts:
            text = f"{' and '.join(contact.names)} touch"
            self.add_event({"t": contact.time, "kind": "collision", "text": text})
        self._plots.flush(everything=everything)
        self._timeline.flush()

    def _lay_out(self) -> None:
        if not self._is_laid_out:
            self._is_laid_out = True
            self.stream.blueprint(self._layout(self.stage, self._selected))
