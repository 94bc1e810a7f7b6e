"""How each robot did: arrival, tracking, way, effort, deadlock. Distances in m, times in s.

The robots' own time begins when all were ready. Distances are in the plane for rovers and in space
for quadcopters.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import hypot, sqrt

import numpy as np

from ...scenarios.paths import end_point, path_duration
from ...scenarios.route import Route
from ...scenarios.schema import Goto, Hold, RobotSpec, Team
from ...transport.frames import Triple
from ...vehicles.build import parameter_values
from ...vehicles.physics import GRAVITY
from .contact import Pair
from .motion import MOTION_HZ, Mask, Way, actuator_rms, cut, distance, driven, effort, stuck
from .truth import Floats, Trail

ARRIVAL_M = 0.2  # from the target
AWAY_M = 0.5  # a post farther than this from the start has to be reached
PATH_END_M = 0.5  # from the last point of a path when it ends: robots follow with a lag
SETTLE_S = 5.0  # after all were ready or it came to its place, before tracking counts


@dataclass(frozen=True, slots=True, kw_only=True)
class Tracking:
    """How far a robot was from its timed path or its place."""

    rmse: float  # m
    greatest: float  # m
    axes: Triple  # m, RMS east, north and up


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotResult:
    """How one robot did. What cannot be known of it is None.

    It is under way until it arrives or its path ends, and who holds until the others are through:
    way, effort and deadlock are of that time.
    """

    name: str
    kind: str
    system_id: int
    goal: str  # goto | path | hold
    arrived: bool | None = None  # at its target or the end of its path; None: it had none
    arrival: float | None = None  # s after all were ready
    miss: float | None = None  # m, closest to the target, or from the path's end when it ended
    planned: float | None = None  # m, straight to the target, or along the path
    length: float | None = None  # m, that it went
    path_ratio: float | None = None  # what it went, and was left at arrival, over the planned
    tracking: Tracking | None = None  # path, hold
    effort: float | None = None  # m^2/s^3, integral of its horizontal acceleration squared
    effort_rms: float | None = None  # m/s^2
    actuator_rms: float | None = None  # rad/s asked: of rotors beyond hovering, of wheels
    deadlock: float | None = None  # s that it stood though it had to go; None: it had not
    nearest: str | None = None  # the robot that came nearest, and its separation in m
    nearest_separation: float | None = None
    source: str = "physics"  # of its track; telemetry: what it says itself, not truth

    @property
    def rmse(self) -> float | None:
        """Return the RMS distance from its timed path or its place in m."""
        return self.tracking.rmse if self.tracking else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Standstill:
    """How long robots that had to go stood, after all were ready."""

    any_s: float  # at least one of them
    all_s: float  # every one that was still under way, and one was


def results(
    team: Team,
    starts: Sequence[RobotSpec],
    tracks: Sequence[Trail],
    pairs: Sequence[Pair],
    ready_at: float | None,
    ended_at: float,
) -> tuple[list[RobotResult], Standstill | None]:
    """Return how each of `starts` did, and all together: None when that is not known of all."""
    by_name = {track.name: track for track in tracks}
    ways = (
        {}
        if ready_at is None
        else {name: cut(track, ready_at, ended_at) for name, track in by_name.items()}
    )
    found = [_reached(spec, team, ways.get(spec.name)) for spec in starts]
    # Who holds a place holds it until the others are through.
    ends = [*(path_duration(spec.path) for spec in starts), *(r.arrival for r in found)]
    work_end = max((end for end in ends if end is not None), default=0.0)
    nearest = _nearest(pairs)
    masks: list[tuple[Mask, Mask]] = []  # of those who can be told to stand: had to go, stood
    for k, spec in enumerate(starts):
        near = nearest.get(spec.name, (None, None))
        result = replace(found[k], nearest_separation=near[0], nearest=near[1])
        if (track := by_name.get(spec.name)) is not None:
            result = replace(result, source=track.source)
        if way := ways.get(spec.name):
            result, mask = _measured(result, spec, team, way, work_end)
            masks += [mask] if mask else []
        found[k] = result
    told = sum(result.goal != "hold" or result.arrived is not None for result in found)
    return found, _standstill(masks) if ready_at is not None and len(masks) == told else None


def _nearest(pairs: Sequence[Pair]) -> Mapping[str, tuple[float, str]]:
    nearest: dict[str, tuple[float, str]] = {}
    for pair in pairs:
        for me, other in (pair.names, pair.names[::-1]):
            if pair.min_separation is not None:
                best = (pair.min_separation, other)
                nearest[me] = min(best, nearest.get(me, best))
    return nearest


def _reached(spec: RobotSpec, team: Team, way: Way | None) -> RobotResult:
    """Return whether and when a robot got where it should."""
    result = partial(RobotResult, name=spec.name, kind=spec.kind, system_id=spec.system_id)
    goal = "goto" if isinstance(spec.path, Goto) else "hold"
    if isinstance(spec.path, Hold) and not _is_sent_away(spec):
        return result(goal="hold")
    if isinstance(spec.path, Goto | Hold):
        if way is None or not len(way.time):
            return result(goal=goal, arrived=False)
        to_go = distance(spec.kind, way.position, np.array(end_point(spec, team)))
        within = np.flatnonzero(to_go <= ARRIVAL_M)
        planned, miss = float(to_go[0]), float(to_go.min())
        if not len(within):
            return result(goal=goal, arrived=False, miss=miss, planned=planned)
        first = int(within[0])
        ratio = None
        if planned >= 2 * ARRIVAL_M:
            went = driven(spec.kind, way.until(float(way.time[first])))
            ratio = (went + float(to_go[first])) / planned
        return result(
            goal=goal,
            arrived=True,
            arrival=float(way.time[first]),
            miss=miss,
            planned=planned,
            path_ratio=ratio,
        )
    duration = path_duration(spec.path) or 0.0
    result = partial(result, goal="path", planned=duration * spec.path.speed)
    if way is None or not len(way.time) or way.time[-1] < duration - 0.02:
        return result(arrived=False)
    place = np.array(end_point(spec, team))
    at_end = int(np.searchsorted(way.time, duration - 1e-6).clip(max=len(way.time) - 1))
    miss = float(distance(spec.kind, way.position[at_end : at_end + 1], place)[0])
    went = driven(spec.kind, way.until(duration))
    ratio = went / (duration * spec.path.speed) if duration else None
    arrived = miss <= PATH_END_M
    arrival = duration if arrived else None
    return result(arrived=arrived, arrival=arrival, miss=miss, path_ratio=ratio)


def _is_sent_away(spec: RobotSpec) -> bool:
    """Return whether a robot that holds shall do so elsewhere than at its start."""
    at = spec.path.at if isinstance(spec.path, Hold) else None
    start = spec.start
    return at is not None and hypot(at.east - start.east, at.north - start.north) > AWAY_M


def _measured(
    result: RobotResult, spec: RobotSpec, team: Team, way: Way, work_end: float
) -> tuple[RobotResult, tuple[Mask, Mask] | None]:
    """Return the result with what a way tells, and when the robot had to go and when it stood."""
    duration = path_duration(spec.path)
    if isinstance(spec.path, Goto):
        end = result.arrival
    else:
        end = work_end if duration is None else duration
    under_way = way if end is None else way.until(end)
    thin = under_way.thinned()
    error: Floats | None = None
    if not isinstance(spec.path, Goto) and len(thin.time):
        route = Route(spec.path, spec, team)
        error = thin.position - np.array([route.at(t).position for t in thin.time.tolist()])
        result = replace(result, tracking=_tracking(result, thin, error))
    result = replace(
        result,
        length=driven(spec.kind, under_way),
        actuator_rms=actuator_rms(under_way, _rest(spec)),
    )
    if result.source == "physics":  # telemetry is joined by straight lines: all is in the corners
        done = effort(under_way)
        result = replace(result, effort=done and done.integral, effort_rms=done and done.rms)
    if result.goal == "hold" and result.arrived is None:
        return result, None
    if result.goal == "path" and error is not None:
        to_go = distance(spec.kind, error, np.zeros(3)) > PATH_END_M
    else:
        to_go = thin.time < (np.inf if result.arrival is None else result.arrival)
    stood = stuck(spec.kind, thin, to_go)
    if stood is None:
        return result, None
    return replace(result, deadlock=float(stood.sum()) / MOTION_HZ), (to_go, stood)


def _tracking(result: RobotResult, thin: Way, error: Floats) -> Tracking | None:
    """Return how far off it was once settled; who is sent to its place is not on its way there."""
    begin = SETTLE_S
    if result.goal == "hold" and result.arrived is not None:
        begin += np.inf if result.arrival is None else result.arrival
    settled = error[thin.time >= begin - 1e-6]
    if not len(settled):
        return None
    east, north, up = np.sqrt(np.mean(settled**2, axis=0)).tolist()
    away = distance(result.kind, settled, np.zeros(3))
    rmse = sqrt(float(np.mean(away**2)))
    return Tracking(rmse=rmse, greatest=float(away.max()), axes=(east, north, up))


def _rest(spec: RobotSpec) -> float:
    """Return the speed in rad/s at which a robot's actuators do nothing but bear it."""
    if spec.kind == "rover" or spec.external:
        return 0.0
    p = parameter_values(spec.kind, spec.profile, spec.params, spec.autopilot)
    return sqrt(p["mass"] * GRAVITY / (4 * p["thrust_coefficient"]))


def _standstill(masks: Sequence[tuple[Mask, Mask]]) -> Standstill:
    length = max((len(to_go) for to_go, _ in masks), default=0)
    going, standing = (np.zeros((len(masks), length), dtype=bool) for _ in range(2))
    for row, (to_go, stood) in enumerate(masks):
        going[row, : len(to_go)], standing[row, : len(stood)] = to_go, stood
    all_stand = going.any(axis=0) & (standing | ~going).all(axis=0)
    return Standstill(
        any_s=float(standing.any(axis=0).sum()) / MOTION_HZ,
        all_s=float(all_stand.sum()) / MOTION_HZ,
    )
