"""Where the robots really start: the nominal places, moved a little by the seed."""

from dataclasses import replace
from math import hypot
from random import Random

from .errors import ScenarioError
from .schema import Hold, Point, RobotSpec, Scenario

CONTACT_RADIUS = {"rover": 0.395, "quadcopter": 0.2}  # m, the circle round each body (Table 1)
MARGIN = 0.1  # m, left between the bodies of any two drawn starts

_TRIES = 200  # of one robot, before all are drawn again
_ROUNDS = 20

TOO_CLOSE = "robots start too close together for the start offsets that the seed draws"
TOO_CLOSE_HINT = "move them apart, or lower team.start_sigma_m"


def contact_distance(one: RobotSpec, other: RobotSpec) -> float:
    """Return the distance between centres at which two bodies touch, seen from above."""
    return CONTACT_RADIUS[one.kind] + CONTACT_RADIUS[other.kind]


def draw_starts(scenario: Scenario) -> tuple[RobotSpec, ...]:
    """Return the robots at the starts which the scenario's seed draws; nothing else changes.

    East and north of each get a Gaussian offset, drawn again while bodies would come nearer than
    the margin, or outside the fence. Paths stay, and so do the pads that `then: return` flies to:
    those of the scenario. External robots stand where they stand.
    """
    drawn = starts_within(scenario)
    if drawn is None:
        raise ScenarioError(scenario.name, TOO_CLOSE, TOO_CLOSE_HINT)
    return drawn


def starts_within(scenario: Scenario) -> tuple[RobotSpec, ...] | None:
    """Return what `draw_starts` does, or None when the offsets leave no room."""
    sigma = scenario.team.start_sigma_m
    if sigma == 0:
        return scenario.robots
    random = Random(f"mavherd starts {scenario.seed}")  # noqa: S311 - repeatable on purpose
    for _ in range(_ROUNDS):
        drawn = _draw(scenario, sigma, random)
        if drawn is not None:
            return drawn
    return None


def _draw(scenario: Scenario, sigma: float, random: Random) -> tuple[RobotSpec, ...] | None:
    """Return one draw of all robots, or None when one found no room among those before it."""
    taken = [spec for spec in scenario.robots if spec.external]
    drawn: list[RobotSpec] = []
    for spec in scenario.robots:
        if spec.external:
            drawn.append(spec)
            continue
        for _ in range(_TRIES):
            east = spec.start.east + random.gauss(0.0, sigma)
            north = spec.start.north + random.gauss(0.0, sigma)
            path = Hold(at=spec.start) if spec.path == Hold() else spec.path
            moved = replace(spec, start=Point(east, north), path=path)
            inside = scenario.fence is None or scenario.fence.holds((east, north, 0.0))
            if inside and all(_apart(moved, other) for other in taken):
                taken.append(moved)
                drawn.append(moved)
                break
        else:
            return None
    return tuple(drawn)


def _apart(one: RobotSpec, other: RobotSpec) -> bool:
    gap = hypot(one.start.east - other.start.east, one.start.north - other.start.north)
    return gap >= contact_distance(one, other) + MARGIN
