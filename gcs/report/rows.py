"""The rows of report.json: a robot, a pair, a class, a collision, the fleet, the CPU time."""

from collections.abc import Iterable, Mapping
from typing import Any

from .contact import Collision, Pair
from .costs import Costs
from .judge import ClassResult, Verdict
from .robots import RobotResult
from .traffic import Link, Setpoints, Traffic

Row = dict[str, Any]


def collision_row(c: Collision) -> Row:
    """Return one collision."""
    east, north, up = c.position
    return {
        "time_s": c.time,
        "robots": list(c.names),
        "class": c.pair_class,
        "east_m": east,
        "north_m": north,
        "up_m": up,
    }


def pair_row(p: Pair) -> Row:
    """Return how near two robots came."""
    return {
        "robots": list(p.names),
        "class": p.pair_class,
        "min_separation_m": p.min_separation,
        "contact_m": p.contact,
        "time_s": p.time,
    }


def class_row(c: ClassResult) -> Row:
    """Return all pairs of one class together."""
    return {
        "class": c.pair_class,
        "pairs": c.pairs,
        "collisions": c.collisions,
        "min_separation_m": c.nearest and c.nearest.min_separation,
        "contact_m": c.contact,
        "robots": list(c.nearest.names) if c.nearest else None,
        "time_s": c.nearest and c.nearest.time,
    }


def robot_row(r: RobotResult, traffic: Traffic | None, cpu_s: float | None) -> Row:
    """Return how one robot did, and what went over its link."""
    tracking = r.tracking
    east, north, up = tracking.axes if tracking else (None, None, None)
    return {
        "name": r.name,
        "kind": r.kind,
        "system_id": r.system_id,
        "goal": r.goal,
        "arrived": r.arrived,
        "arrival_s": r.arrival,
        "miss_m": r.miss,
        "planned_m": r.planned,
        "path_length_m": r.length,
        "path_ratio": r.path_ratio,
        "tracking_rmse_m": r.rmse,
        "tracking_max_m": tracking and tracking.greatest,
        "tracking_rmse_east_m": east,
        "tracking_rmse_north_m": north,
        "tracking_rmse_up_m": up,
        "control_effort_m2_s3": r.effort,
        "control_effort_rms_m_s2": r.effort_rms,
        "actuator_rms_rad_s": r.actuator_rms,
        "deadlock_s": r.deadlock,
        "nearest": r.nearest,
        "nearest_separation_m": r.nearest_separation,
        "source": r.source,
        "setpoints": _setpoints(traffic.setpoints) if traffic else None,
        "link": _link(traffic.link) if traffic else None,
        "cpu_s": cpu_s,
    }


def fleet_row(verdict: Verdict, traffic: Mapping[str, Traffic]) -> Row:
    """Return the robots' numbers together; each is of those robots that have it."""
    robots, standstill = verdict.robots, verdict.standstill
    late = max(((r.arrival, r.name) for r in robots if r.arrival is not None), default=None)
    links = [each.link for each in traffic.values()]
    setpoints = [each.setpoints for each in traffic.values()]
    ratios = _known(r.path_ratio for r in robots)
    return {
        "last_arrival_s": late and late[0],
        "last_arrival_robot": late and late[1],
        "path_length_m": _sum(r.length for r in robots),
        "path_ratio_mean": sum(ratios) / len(ratios) if ratios else None,
        "tracking_rmse_max_m": _most(r.rmse for r in robots),
        "control_effort_m2_s3": _sum(r.effort for r in robots),
        "deadlock_any_s": standstill and standstill.any_s,
        "deadlock_all_s": standstill and standstill.all_s,
        "setpoint_rate_min_hz": min(_known(s.rate for s in setpoints), default=None),
        "setpoint_longest_gap_s": _most(s.longest_gap for s in setpoints),
        "lost_frames": sum(link.lost for link in links) if links else None,
        "longest_silence_s": _most(link.longest_silence for link in links),
        "oldest_state_s": _most(link.oldest_position for link in links),
        "link_bytes": sum(link.to_bytes + link.from_bytes for link in links) if links else None,
    }


def cpu_row(costs: Costs) -> Row:
    """Return the processor time of a run's processes."""
    vehicles = list(costs.by_vehicle.values())
    return {
        "total_s": costs.total,
        "launcher_s": costs.launcher,
        "vehicles_s": costs.vehicles,
        "coordinators_s": costs.coordinators,
        "recorder_s": costs.recorder,
        "vehicle_mean_s": sum(vehicles) / len(vehicles) if vehicles else None,
        "vehicle_max_s": max(vehicles, default=None),
    }


def _setpoints(s: Setpoints) -> Row:
    return {
        "count": s.number,
        "window_s": s.window,
        "rate_hz": s.rate,
        "mean_age_s": s.mean_age,
        "longest_gap_s": s.longest_gap,
    }


def _link(link: Link) -> Row:
    return {
        "to_vehicle_frames": link.to_frames,
        "to_vehicle_bytes": link.to_bytes,
        "from_vehicle_frames": link.from_frames,
        "from_vehicle_bytes": link.from_bytes,
        "lost_frames": link.lost,
        "position_rate_hz": link.position_rate,
        "longest_silence_s": link.longest_silence,
        "oldest_state_s": link.oldest_position,
    }


def _known(values: Iterable[float | None]) -> list[float]:
    return [value for value in values if value is not None]


def _most(values: Iterable[float | None]) -> float | None:
    return max(_known(values), default=None)


def _sum(values: Iterable[float | None]) -> float | None:
    known = _known(values)
    return sum(known) if known else None
