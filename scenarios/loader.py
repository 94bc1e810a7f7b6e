"""From a file or the name of a shipped scenario to a checked `Scenario`."""

import os
import re
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

from ..transport.frames import Origin
from ..vehicles.config import AUTOPILOTS, SLICE_US
from .checks import check_robots
from .dump import scenario_to_yaml
from .errors import ScenarioError, did_you_mean, show
from .external import check_external
from .fence import check_fence, read_fence
from .groups import expand_groups, name_robots
from .overrides import override
from .reader import LONG, Fields
from .robots import MIN_UP, read_disturbance, read_robots
from .schema import Expect, RobotSpec, Scenario, Team
from .source import parse, read_text
from .starts import TOO_CLOSE, TOO_CLOSE_HINT, draw_starts, starts_within

__all__ = [
    "draw_starts",
    "is_shipped",
    "load_scenario",
    "scenario_text",
    "scenario_to_yaml",
    "shipped",
]

MAX_SEED = 2**63 - 1
SLICE_RATE = 1e6 / SLICE_US  # Hz; a coordination period is a whole number of these
SUFFIXES = (".yaml", ".yml")
AT_END = ("land", "hold", "return")

_KEYS = (
    "name",
    "description",
    "duration",
    "seed",
    "origin",
    "team",
    "disturbance",
    "robots",
    "expect",
    "fence",
)


def load_scenario(
    source: str | Path, overrides: Sequence[str] = (), seed: int | None = None
) -> Scenario:
    """Return the scenario in a file, or the shipped one of that name, checked as a whole.

    `overrides` are `key=value` with dotted keys, robots by name or index, values in YAML; they and
    `seed` win over the file. Raise ScenarioError for anything that cannot be run.
    """
    root = parse(*scenario_text(source))
    name_robots(root)
    later = [text for text in overrides if not override(root, text, last=False)]
    if seed is not None:
        override(root, f"seed={seed}", last=True, option="--seed")
    name_robots(root)
    paths = expand_groups(root)
    for text in later:
        override(root, text, last=True)
    return _scenario(Fields(root, "", _KEYS), paths)


def shipped() -> list[tuple[str, str]]:
    """Return name and description of every scenario that comes with mavherd."""
    scenarios = (load_scenario(name) for name in _shipped_names())
    return [(scenario.name, scenario.description) for scenario in scenarios]


def is_shipped(source: str | Path) -> bool:
    """Return whether this names a shipped scenario rather than a file."""
    text = str(source)
    return isinstance(source, str) and not (text.endswith(SUFFIXES) or {"/", os.sep} & set(text))


def scenario_text(source: str | Path) -> tuple[str, str]:
    """Return the YAML text of a path or a shipped scenario's name, and what errors call it."""
    names = _shipped_names()
    text = str(source)
    if is_shipped(source):
        if text not in names:
            hint = did_you_mean(text, names)
            listed = f"shipped: {', '.join(names)}; a file's name ends in .yaml"
            hint = listed if hint.startswith("known") else f"{hint} {listed}"
            raise ScenarioError(show(text), "no shipped scenario has this name", hint)
        file = resources.files(__package__) / "shipped" / f"{text}.yaml"
        return file.read_text("utf-8"), file.name
    path = Path(source)
    shipped_too = f"the shipped scenario is called {path.stem!r}" if path.stem in names else ""
    return read_text(path, shipped_too), text


def _shipped_names() -> list[str]:
    folder = resources.files(__package__) / "shipped"
    return sorted(
        f.name.removesuffix(".yaml") for f in folder.iterdir() if f.name.endswith(".yaml")
    )


def _scenario(root: Fields, paths: list[str]) -> Scenario:
    name = root.text("name")
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", name, re.ASCII):
        raise root.error(
            "name", f"{show(name)} is no name", "1 to 64 of the letters a-z A-Z 0-9 . _ -"
        )
    team = _team(root.mapping("team", _TEAM_KEYS))
    autopilot = root.mapping("team", _TEAM_KEYS).choice("autopilot", AUTOPILOTS, "ardupilot")
    read = read_robots(root, paths, autopilot)
    check_robots(read, team)
    check_external(read, team)
    fence = read_fence(root)
    if fence is not None:
        check_fence(fence, read, team)
    robots = tuple(spec for spec, _ in read)
    default = Scenario(name=name, robots=robots)
    scenario = Scenario(
        name=name,
        robots=robots,
        description=root.text("description", ""),
        duration=root.positive("duration", default.duration, high=LONG),
        seed=root.integer("seed", default.seed, low=0, high=MAX_SEED),
        origin=_origin(root.mapping("origin", ("lat", "lon", "alt"))),
        team=team,
        disturbance=read_disturbance(root),
        expect=_expect(root.mapping("expect", _EXPECT_KEYS), robots),
        fence=fence,
    )
    if starts_within(scenario) is None:
        raise root.error("robots", TOO_CLOSE, TOO_CLOSE_HINT)
    return scenario


def _origin(fields: Fields) -> Origin:
    default = Origin()
    return Origin(
        lat_deg=fields.number("lat", default.lat_deg, low=-89.0, high=89.0),
        lon_deg=fields.number("lon", default.lon_deg, low=-180.0, high=180.0),
        alt_m=fields.number("alt", default.alt_m, low=-500.0, high=10_000.0),
    )


_TEAM_KEYS = (
    "law",
    "rate_hz",
    "start_sigma_m",
    "takeoff_up",
    "setpoint_timeout_s",
    "state_timeout_s",
    "coordinators",
    "autopilot",
    "ready_timeout_s",
    "at_end",
    "law_params",
)


def _team(fields: Fields) -> Team:
    default = Team()
    law = fields.text("law", default.law)
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_-]{0,31}", law, re.ASCII):
        raise fields.error("law", f"{show(law)} is no name of a law", "as in `law: safe`")
    constants = fields.mapping("law_params", None)
    rate = _rate(fields, default.rate_hz)
    timeout = fields.positive("setpoint_timeout_s", default.setpoint_timeout_s)
    if timeout * rate <= 1:
        raise fields.error(
            "setpoint_timeout_s",
            f"{timeout:g} s is over before the next setpoint comes, at {rate:g} Hz",
            f"{2 / rate:g} or more",
        )
    return Team(
        law=law,
        rate_hz=rate,
        start_sigma_m=fields.number("start_sigma_m", default.start_sigma_m, low=0.0, high=100.0),
        takeoff_up=fields.number("takeoff_up", default.takeoff_up, low=MIN_UP),
        setpoint_timeout_s=timeout,
        state_timeout_s=fields.positive("state_timeout_s", default.state_timeout_s),
        coordinators=fields.choice("coordinators", ("central", "per-robot"), default.coordinators),
        ready_timeout_s=fields.positive("ready_timeout_s", default.ready_timeout_s, high=LONG),
        at_end=fields.choice("at_end", AT_END, default.at_end),
        law_params={key: constants.number(key, low=-1e9, high=1e9) for key in constants},
        law_at=fields.place("law"),
        law_params_at=fields.place("law_params"),
    )


def _rate(fields: Fields, default: float) -> float:
    """Return the coordination rate, whose period is a whole number of a vehicle's slices."""
    rate = fields.number("rate_hz", default, low=1.0, high=100.0)
    steps = SLICE_RATE / rate
    nearest = SLICE_RATE / round(steps)
    if abs(steps - round(steps)) > 1e-3:
        raise fields.error(
            "rate_hz",
            f"{rate:g} Hz has a period of {1000 / rate:g} ms, not a multiple of 10 ms",
            f"the nearest that fits is {nearest:.6g}",
        )
    return nearest


_EXPECT_KEYS = ("collisions", "all_arrive_within_s", "tracking_rmse_m", "min_separation_m")


def _expect(fields: Fields, robots: Sequence[RobotSpec]) -> Expect:
    names = [spec.name for spec in robots]
    limits = fields.mapping("tracking_rmse_m", None)
    for name in limits:
        if name not in names:
            raise limits.error(name, "no robot has this name", did_you_mean(name, names))

    def given(key: str) -> bool:
        return fields.raw(key) is not None

    within, apart = "all_arrive_within_s", "min_separation_m"
    return Expect(
        collisions=fields.integer("collisions", low=0, high=10**6) if given("collisions") else None,
        all_arrive_within_s=fields.positive(within, high=LONG) if given(within) else None,
        tracking_rmse_m={name: limits.positive(name) for name in limits},
        min_separation_m=fields.number(apart, low=0.0) if given(apart) else None,
    )
