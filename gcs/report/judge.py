"""Judges a run by what the robots truly did: contact, arrival, tracking, and what was expected.

Of external vehicles nobody knows the truth: they are judged by what they say themselves.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import hypot
from typing import NamedTuple

import numpy as np

from ...scenarios.paths import end_point, path_duration
from ...scenarios.route import Route
from ...scenarios.schema import Expect, Goto, Hold, RobotSpec, Scenario, Team
from ...vehicles.truth import RATE_HZ
from .contact import CLASSES, Collision, Pair, examine
from .truth import Floats, Trail

ARRIVAL_M = 0.2  # from the target
AWAY_M = 0.5  # a post farther than this from the start has to be reached
PATH_END_M = 0.5  # from the last point of a path when it ends: robots follow with a lag
SETTLE_S = 5.0  # after all were ready, before tracking counts
TRACKING_HZ = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotResult:
    """How one robot did; distances in the plane for rovers, in space for quadcopters."""

    name: str
    kind: str
    system_id: int
    goal: str  # goto | path | hold
    arrived: bool | None = None  # at its target or the end of its path; None: it had none
    arrival: float | None = None  # s after all were ready (goto only)
    miss: float | None = None  # m, closest to the target, or from the path's end when it ended
    path_ratio: float | None = None  # way driven to the target / straight way (goto only)
    rmse: float | None = None  # m, from its timed path or its place (path, hold)
    nearest: str | None = None  # the robot that came nearest, and its separation in m
    nearest_separation: float | None = None
    source: str = "physics"  # of its track; telemetry: what it says itself, not truth


class ClassResult(NamedTuple):
    """All pairs of one class together."""

    pair_class: str
    contact: float  # m
    pairs: int
    collisions: int
    nearest: Pair | None  # of those with a separation


class Assertion(NamedTuple):
    """One thing the scenario expected."""

    name: str
    expected: float
    actual: float | None
    passed: bool
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """The whole judgement; times in s of run time."""

    passed: bool
    assertions: tuple[Assertion, ...]
    ready_at: float | None
    ended_at: float
    robots: tuple[RobotResult, ...]
    pairs: tuple[Pair, ...]
    classes: tuple[ClassResult, ...]
    collisions: tuple[Collision, ...]
    min_separation: float | None
    all_arrived: bool


def judge(
    scenario: Scenario,
    starts: tuple[RobotSpec, ...],
    tracks: Sequence[Trail],
    ready_at: float | None,
    ended_at: float,
) -> Verdict:
    """Return the verdict on a run of `scenario` whose robots began as `starts`."""
    pairs, collisions = examine(tracks, ready_at, ended_at)
    robots = _robots(scenario.team, starts, tracks, ready_at, ended_at, pairs)
    separations = [p.min_separation for p in pairs if p.min_separation is not None]
    all_arrived = ready_at is not None and all(r.arrived is not False for r in robots)
    assertions = [
        *_collision_assertion(scenario.expect, len(collisions)),
        *_arrival_assertion(scenario.expect, starts, robots, ready_at),
        *_tracking_assertions(scenario.expect, robots),
        *_separation_assertion(scenario.expect, min(separations, default=None), ready_at),
    ]
    return Verdict(
        passed=all(a.passed for a in assertions),
        assertions=tuple(assertions),
        ready_at=ready_at,
        ended_at=ended_at,
        robots=tuple(robots),
        pairs=tuple(pairs),
        classes=tuple(_classes(pairs, collisions)),
        collisions=tuple(collisions),
        min_separation=min(separations, default=None),
        all_arrived=all_arrived,
    )


def _robots(
    team: Team,
    starts: Sequence[RobotSpec],
    tracks: Sequence[Trail],
    ready_at: float | None,
    ended_at: float,
    pairs: Sequence[Pair],
) -> list[RobotResult]:
    nearest: dict[str, tuple[float, str]] = {}
    for pair in pairs:
        for me, other in (pair.names, pair.names[::-1]):
            if pair.min_separation is not None:
                best = (pair.min_separation, other)
                nearest[me] = min(best, nearest.get(me, best))
    since_ready = (
        {}
        if ready_at is None
        else {track.name: _cut(track, ready_at, ended_at) for track in tracks}
    )
    sources = {track.name: track.source for track in tracks}
    results = []
    for spec in starts:
        result = _reached(spec, team, since_ready.get(spec.name))
        result = replace(result, source=sources.get(spec.name, result.source))
        if near := nearest.get(spec.name):
            result = replace(result, nearest=near[1], nearest_separation=near[0])
        results.append(result)
    # Who holds a place holds it until the others are through.
    ends = [*(path_duration(spec.path) for spec in starts), *(r.arrival for r in results)]
    work_end = max((end for end in ends if end is not None), default=0.0)
    for k, spec in enumerate(starts):
        if not isinstance(spec.path, Goto):
            duration = path_duration(spec.path)
            end = work_end if duration is None else duration
            rmse = _rmse(spec, team, since_ready.get(spec.name), end)
            results[k] = replace(results[k], rmse=rmse)
    return results


class _Way(NamedTuple):
    """A track from the moment when all were ready."""

    time: Floats  # s since then
    position: Floats


def _cut(track: Trail, ready_at: float, ended_at: float) -> _Way:
    first = np.searchsorted(track.time, ready_at - 1e-6, "left")
    last = np.searchsorted(track.time, ended_at + 1e-6, "right")
    return _Way(track.time[first:last] - ready_at, track.position[first:last])


def _reached(spec: RobotSpec, team: Team, way: _Way | None) -> RobotResult:
    """Return whether and when a robot got where it should."""
    result = partial(RobotResult, name=spec.name, kind=spec.kind, system_id=spec.system_id)
    goal = "goto" if isinstance(spec.path, Goto) else "hold"
    if isinstance(spec.path, Hold) and not _is_sent_away(spec):
        return result(goal="hold")
    if isinstance(spec.path, Goto | Hold):
        if way is None or not len(way.time):
            return result(goal=goal, arrived=False)
        distance = _distance(spec.kind, way.position, np.array(end_point(spec, team)))
        within = np.flatnonzero(distance <= ARRIVAL_M)
        if not len(within):
            return result(goal=goal, arrived=False, miss=float(distance.min()))
        first = int(within[0])
        return result(
            goal=goal,
            arrived=True,
            arrival=float(way.time[first]),
            miss=float(distance.min()),
            path_ratio=_path_ratio(spec.kind, way.position[: first + 1], distance),
        )
    duration = path_duration(spec.path)
    if way is None or duration is None or not len(way.time) or way.time[-1] < duration - 0.02:
        return result(goal="path", arrived=False)
    place = np.array(end_point(spec, team))
    at_end = int(np.searchsorted(way.time, duration - 1e-6).clip(max=len(way.time) - 1))
    miss = float(_distance(spec.kind, way.position[at_end : at_end + 1], place)[0])
    return result(goal="path", arrived=miss <= PATH_END_M, miss=miss)


def _is_sent_away(spec: RobotSpec) -> bool:
    """Return whether a robot that holds shall do so elsewhere than at its start."""
    at = spec.path.at if isinstance(spec.path, Hold) else None
    start = spec.start
    return at is not None and hypot(at.east - start.east, at.north - start.north) > AWAY_M


def _path_ratio(kind: str, position: Floats, distance: Floats) -> float | None:
    """Return the way to arrival, plus what was left of it, over the straight way."""
    straight = float(distance[0])
    if straight < 2 * ARRIVAL_M:
        return None
    steps = _distance(kind, np.diff(position, axis=0), np.zeros(3))
    return (float(steps.sum()) + float(distance[len(position) - 1])) / straight


def _rmse(spec: RobotSpec, team: Team, way: _Way | None, end: float) -> float | None:
    """Return the RMS distance from the reference, SETTLE_S to `end` s after all were ready."""
    if way is None:
        return None
    inside = np.flatnonzero((way.time >= SETTLE_S - 1e-6) & (way.time <= end + 1e-6))
    inside = inside[:: RATE_HZ // TRACKING_HZ]
    if not len(inside):
        return None
    route = Route(spec.path, spec, team)
    wanted = [route.at(t).position for t in way.time[inside].tolist()]
    error = _distance(spec.kind, way.position[inside], np.array(wanted))
    return float(np.sqrt(np.mean(error**2)))


def _distance(kind: str, position: Floats, target: Floats) -> Floats:
    east, north, up = (position[:, axis] - target[..., axis] for axis in range(3))
    squared = east * east + north * north
    distance: Floats = np.sqrt(squared if kind == "rover" else squared + up * up)
    return distance


def _classes(pairs: Sequence[Pair], collisions: Sequence[Collision]) -> Iterator[ClassResult]:
    for label in CLASSES:
        mine = [p for p in pairs if p.pair_class == label]
        near = [(p.min_separation, p) for p in mine if p.min_separation is not None]
        hits = sum(c.pair_class == label for c in collisions)
        if mine:
            nearest = min(near, key=lambda item: item[0])[1] if near else None
            yield ClassResult(label, mine[0].contact, len(mine), hits, nearest)


def _collision_assertion(expect: Expect, collisions: int) -> Iterator[Assertion]:
    if expect.collisions is not None:
        limit = expect.collisions
        wanted = f"at most {limit} collisions" if limit else "no collision"
        yield Assertion(
            "collisions",
            limit,
            collisions,
            collisions <= limit,
            f"{wanted}: {collisions or 'none'}",
        )


def _arrival_assertion(
    expect: Expect,
    starts: Sequence[RobotSpec],
    robots: Sequence[RobotResult],
    ready_at: float | None,
) -> Iterator[Assertion]:
    limit = expect.all_arrive_within_s
    if limit is None:
        return
    name, wanted = "all_arrive_within_s", f"all arrive within {limit:g} s"
    if ready_at is None:
        yield Assertion(name, limit, None, False, f"{wanted}: the team was never ready")
        return
    if late := [r for r in robots if r.arrived is False]:
        miss = "" if late[0].miss is None else f" (nearest {late[0].miss:.2f} m)"
        more = f" and {len(late) - 1} more" if len(late) > 1 else ""
        text = f"{wanted}: {late[0].name}{miss}{more} did not"
        yield Assertion(name, limit, None, False, text)
        return
    paths = {spec.name: path_duration(spec.path) for spec in starts}
    times = [(r.arrival if r.goal == "goto" else paths[r.name], r.name) for r in robots]
    last, who = max(((t, n) for t, n in times if t is not None), default=(0.0, "nobody had to"))
    yield Assertion(name, limit, last, last <= limit, f"{wanted}: {who}, {last:.1f} s")


def _tracking_assertions(expect: Expect, robots: Sequence[RobotResult]) -> Iterator[Assertion]:
    measured = {r.name: r.rmse for r in robots}
    for robot, limit in expect.tracking_rmse_m.items():
        rmse = measured.get(robot)
        text = "not measured" if rmse is None else f"{rmse:.3f} m"
        passed = rmse is not None and rmse <= limit
        wanted = f"{robot} tracks within {limit:g} m RMS"
        yield Assertion(f"tracking_rmse_m.{robot}", limit, rmse, passed, f"{wanted}: {text}")


def _separation_assertion(
    expect: Expect, separation: float | None, ready_at: float | None
) -> Iterator[Assertion]:
    limit = expect.min_separation_m
    if limit is None:
        return
    wanted = f"all stay {limit:g} m apart (centres)"
    if separation is None:
        passed = ready_at is not None
        text = "no two were ever at one level" if passed else "the team was never ready"
    else:
        passed, text = separation >= limit, f"{separation:.3f} m"
    yield Assertion("min_separation_m", limit, separation, passed, f"{wanted}: {text}")
