"""Judges a run by what the robots truly did: contact, arrival, tracking, and what was expected.

Of external vehicles nobody knows the truth: they are judged by what they say themselves.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ...scenarios.schema import Expect, RobotSpec, Scenario
from .contact import CLASSES, Collision, Pair, examine
from .robots import RobotResult, Standstill, results
from .truth import Trail


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
    passed: bool | None  # None: not decided when the run was broken off
    text: str

    def open_at(self, moment: str) -> "Assertion":
        """Return the same, not decided by a run that broke off at `moment`."""
        text = f"{self.text} by the time it broke off, {moment}"
        return self._replace(passed=None, text=text)


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
    standstill: Standstill | None  # None: not known of all


def judge(
    scenario: Scenario,
    starts: tuple[RobotSpec, ...],
    tracks: Sequence[Trail],
    ready_at: float | None,
    ended_at: float,
    *,
    broken_off: bool = False,
) -> Verdict:
    """Return the verdict on a run of `scenario` whose robots began as `starts`.

    Of a run that was `broken_off` only that is decided which no later moment could have changed.
    """
    pairs, collisions = examine(tracks, ready_at, ended_at)
    robots, standstill = results(scenario.team, starts, tracks, pairs, ready_at, ended_at)
    separations = [p.min_separation for p in pairs if p.min_separation is not None]
    all_arrived = ready_at is not None and all(r.arrived is not False for r in robots)
    assertions = [
        *_collision_assertion(scenario.expect, len(collisions)),
        *_arrival_assertion(scenario.expect, robots, ready_at),
        *_tracking_assertions(scenario.expect, robots),
        *_separation_assertion(scenario.expect, min(separations, default=None), ready_at),
    ]
    if broken_off:
        assertions = list(_still_open(assertions, robots, ready_at, ended_at))
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
        standstill=standstill,
    )


def _classes(pairs: Sequence[Pair], collisions: Sequence[Collision]) -> Iterator[ClassResult]:
    for label in CLASSES:
        mine = [p for p in pairs if p.pair_class == label]
        near = [(p.min_separation, p) for p in mine if p.min_separation is not None]
        hits = sum(c.pair_class == label for c in collisions)
        if mine:
            nearest = min(near, key=lambda item: item[0])[1] if near else None
            yield ClassResult(label, mine[0].contact, len(mine), hits, nearest)


def _still_open(
    assertions: Sequence[Assertion],
    robots: Sequence[RobotResult],
    ready_at: float | None,
    ended_at: float,
) -> Iterator[Assertion]:
    """Yield the assertions on a run that was broken off, those open that it has not decided."""
    ran = 0.0 if ready_at is None else ended_at - ready_at
    moment = "before all were ready" if ready_at is None else f"{ran:.1f} s after all were ready"
    through = {f"tracking_rmse_m.{r.name}" for r in robots if r.goal == "path" and r.arrived}
    for a in assertions:
        match a.name:
            case "all_arrive_within_s":
                decided = a.actual is not None or ran > a.expected
            case "collisions" | "min_separation_m":
                decided = a.actual is not None and not a.passed
            case tracking:
                decided = tracking in through
        yield a if decided else a.open_at(moment)


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
    times = [(r.arrival, r.name) for r in robots if r.arrival is not None]
    last, who = max(times, default=(0.0, "nobody had to"))
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
