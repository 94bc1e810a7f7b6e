"""What is known of a run before anything moves: who takes part, from where to where.

All of it ENU, in metres from the fleet origin.
"""

from math import ceil, pi
from pathlib import Path
from typing import NamedTuple

from ...scenarios.loader import draw_starts, load_scenario
from ...scenarios.paths import end_point, reference, takeoff_up
from ...scenarios.route import corners, place
from ...scenarios.schema import Circle, Fence, Goto, Hold, Rectangle, RobotSpec, Scenario, Team
from ...transport.frames import Origin, Triple
from ...transport.wire import CROWD

FEW = 12  # robots whose lines can be told apart in one plot
MANY = CROWD  # robots
WAY_POINTS = 200  # at most, of a planned way
_CIRCLE_LEGS = 96


class StagedRobot(NamedTuple):
    """A robot as it is known beforehand; `kind` is ours, or what an outside vehicle says it is."""

    name: str
    kind: str
    system_id: int
    start: Triple
    target: Triple | None = None  # where its path ends; None: nobody knows
    path: tuple[Triple, ...] = ()  # the planned way, a polyline; () where there is none
    external: bool = False


class Stage(NamedTuple):
    """What is known of a run beforehand."""

    title: str
    law: str  # "" where nobody coordinates
    robots: tuple[StagedRobot, ...]
    origin: Origin
    fence: Fence | None = None
    stale_s: float = 1.0  # a state older than this counts as unknown

    @property
    def crowded(self) -> bool:
        """Whether robots are so many that they are shown as a crowd, not one by one."""
        return len(self.robots) > MANY

    @property
    def kinds(self) -> dict[str, str]:
        """Return the kind of each robot by its name."""
        return {robot.name: robot.kind for robot in self.robots}


def read_stage(folder: Path) -> Stage:
    """Return the stage of the run in `folder`; its seed gives the same starts again.

    Raise ScenarioError when `scenario.yaml` there cannot be read.
    """
    return stage_of(load_scenario(folder / "scenario.yaml"))


def stage_of(scenario: Scenario) -> Stage:
    """Return the stage on which a scenario plays."""
    team = scenario.team
    robots = tuple(_staged(spec, team) for spec in draw_starts(scenario))
    law, stale = team.law, team.state_timeout_s
    return Stage(scenario.name, law, robots, scenario.origin, scenario.fence, stale)


def _staged(spec: RobotSpec, team: Team) -> StagedRobot:
    start = (spec.start.east, spec.start.north, spec.start.up or 0.0)
    end, way = end_point(spec, team), _way(spec, team)
    return StagedRobot(spec.name, spec.kind, spec.system_id, start, end, way, spec.external)


def _way(spec: RobotSpec, team: Team) -> tuple[Triple, ...]:
    """Return the path as a polyline, from above the start where it has no beginning of its own."""
    match path := spec.path:
        case Hold():
            return ()
        case Goto():
            above = (spec.start.east, spec.start.north, takeoff_up(spec, team))
            return (above, end_point(spec, team))
        case Rectangle():
            return tuple(corners(path, place(path.corner, spec, team)))
        case Circle():
            lap = min(1.0, path.laps) * 2 * pi * path.radius / path.speed
            times = [lap * k / _CIRCLE_LEGS for k in range(_CIRCLE_LEGS + 1)]
            return tuple(reference(path, spec, team, t).position for t in times)
    places = [place(point, spec, team) for point in path.points]
    every = ceil(len(places) / (WAY_POINTS - 1))
    return (*places[:-1:every], places[-1])
