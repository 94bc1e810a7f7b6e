"""A resolved scenario as YAML that people can read and that loads to the same scenario."""

import re
from math import degrees, inf, nextafter, radians
from typing import Any

import yaml

from ..vehicles.config import Disturbance
from .schema import (
    Circle,
    Fence,
    Goto,
    Hold,
    Path,
    Point,
    Rectangle,
    RobotSpec,
    Scenario,
    Waypoints,
)
from .source import CORE_SCALARS


def scenario_to_yaml(scenario: Scenario) -> str:
    """Return `scenario` with everything spelt out, as YAML."""
    origin, team, expect = scenario.origin, scenario.team, scenario.expect
    tree = {
        "name": scenario.name,
        "description": scenario.description or None,
        "duration": scenario.duration,
        "seed": scenario.seed,
        "origin": {"lat": origin.lat_deg, "lon": origin.lon_deg, "alt": origin.alt_m},
        "team": {
            "law": team.law,
            "rate_hz": team.rate_hz,
            "start_sigma_m": team.start_sigma_m,
            "takeoff_up": team.takeoff_up,
            "setpoint_timeout_s": team.setpoint_timeout_s,
            "state_timeout_s": team.state_timeout_s,
            "coordinators": team.coordinators,
            "ready_timeout_s": team.ready_timeout_s,
            "at_end": team.at_end,
            "law_params": team.law_params or None,
        },
        "disturbance": _disturbance(scenario.disturbance),
        "fence": _fence(scenario.fence) if scenario.fence else None,
        "robots": [_robot(spec) for spec in scenario.robots],
        "expect": {
            "collisions": expect.collisions,
            "all_arrive_within_s": expect.all_arrive_within_s,
            "tracking_rmse_m": expect.tracking_rmse_m or None,
            "min_separation_m": expect.min_separation_m,
        },
    }
    return yaml.dump(
        _tidy(tree),
        Dumper=_Dumper,
        sort_keys=False,
        default_flow_style=None,
        allow_unicode=True,
        width=110,
    )


class _Dumper(yaml.SafeDumper):
    """Quotes what either YAML 1.1 (other tools) or YAML 1.2 (we) would not read as text."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


for _kind, _pattern, _first in CORE_SCALARS:
    _Dumper.add_implicit_resolver(
        f"tag:yaml.org,2002:{_kind}", re.compile(f"(?:{_pattern})$"), list(_first)
    )


def _robot(spec: RobotSpec) -> dict[str, Any]:
    heading = {"heading_deg": _degrees(spec.heading)}
    own = None if spec.disturbance is None else _disturbance(spec.disturbance)
    return {
        "name": spec.name,
        "kind": spec.kind,
        "system_id": spec.system_id,
        "start": _point(spec.start) | heading,
        **_path(spec.path),
        "dwell_s": spec.dwell_s,
        "then": spec.then,
        "connect": spec.connect,
        "autopilot": spec.autopilot,
        "max_speed": spec.max_speed,
        "profile": None if spec.external else spec.profile,
        "params": spec.params or None,
        "disturbance": own,
    }


def _path(path: Path) -> dict[str, Any]:
    match path:
        case Hold():
            return {"hold": _point(path.at) if path.at else {}}
        case Goto():
            return {"goto": _point(path.target)}
        case Circle():
            circle = {
                "centre": _point(path.centre),
                "radius": path.radius,
                "speed": path.speed,
                "clockwise": path.clockwise,
                "start_angle_deg": _degrees(path.start_angle),
                "laps": path.laps,
            }
            return {"circle": circle}
        case Rectangle():
            rectangle = {
                "corner": _point(path.corner),
                "width": path.width,
                "height": path.height,
                "speed": path.speed,
                "clockwise": path.clockwise,
                "laps": path.laps,
            }
            return {"rectangle": rectangle}
        case Waypoints():
            points = [_point(point) for point in path.points]
            return {"waypoints": {"points": points, "speed": path.speed}}


def _point(point: Point) -> dict[str, Any]:
    return {"east": point.east, "north": point.north, "up": point.up}


def _disturbance(disturbance: Disturbance) -> dict[str, Any]:
    return {
        "form": disturbance.form,
        "amplitude": disturbance.amplitude,
        "hold_s": disturbance.hold_s,
    }


def _fence(fence: Fence) -> dict[str, Any]:
    return {"east": list(fence.east), "north": list(fence.north), "up": fence.up}


def _degrees(angle: float) -> float:
    """Return the shortest number of degrees that reads back as exactly `angle`."""
    near = degrees(angle)
    candidates = [round(near, digits) for digits in range(17)]
    above = below = near
    for _ in range(4):
        above, below = nextafter(above, inf), nextafter(below, -inf)
        candidates += [above, below]
    return next((c for c in candidates if radians(c) == angle), near)


def _tidy(value: Any) -> Any:
    """Return `value` without what is not given, and with 4 for 4.0."""
    match value:
        case dict():
            return {k: _tidy(v) for k, v in value.items() if v is not None}
        case list():
            return [_tidy(v) for v in value]
        case float() if value.is_integer() and abs(value) < 1e15:
            return int(value)
    return value
