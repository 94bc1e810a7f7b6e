"""Overrides of gains and constants: their names, their units, and whether a robot can be so."""

from collections.abc import Collection, Mapping
from dataclasses import fields, replace
from difflib import get_close_matches
from functools import cache
from typing import Any, TypeVar

from ..quadcopter import QuadcopterParams
from ..quadcopter_tuning import QuadcopterTuning
from ..rover import RoverParams
from ..rover_control import RoverTuning
from .profile import Body, Tuning, body_and_tuning, numbers
from .tables import RANGE, facts, table

PHYSICS_DT = 0.002  # s; measured against 2 kHz in the tests

_MAX_RATE_STEP = 10.0  # rad/s in one physics step

P = TypeVar("P", QuadcopterParams, QuadcopterTuning, RoverParams, RoverTuning)


def control_every(profile: str) -> int:
    """Return how many physics steps there are to one of the controllers."""
    return 1 if profile == "paper" else 2


@cache
def accepted_names(kind: str, profile: str, autopilot: str = "ardupilot") -> tuple[str, ...]:
    """Return every name that an override may have: ours first, then MAVLink's."""
    settable = [p.name for p in table(autopilot, kind, profile) if not p.read_only]
    return (*numbers(kind, profile), *settable)


def in_our_units(
    kind: str, autopilot: str, profile: str, overrides: Mapping[str, float]
) -> dict[str, float]:
    """Return the gains and constants among `overrides` under our names in SI units.

    Where two names mean the same, the later one counts. Raises ValueError for a name that does
    not exist, for a value that is no number or far from anything usual, and for a robot that
    cannot be.
    """
    values = plain(overrides, accepted_names(kind, profile, autopilot), kind)
    known = facts(autopilot, kind, profile)
    ours: dict[str, float] = {}
    for name, value in values.items():
        if name not in known.places:
            ours[name] = value
            continue
        parameter = known.table[known.places[name]]
        stored = parameter.stored(value)
        if parameter.is_robots:
            ours[parameter.robot_name] = stored * parameter.scale
    built(kind, profile, ours)
    return ours


def plain(values: Mapping[str, float], known: Collection[str], kind: str) -> dict[str, float]:
    """Return `values` as floats; raise ValueError for unknown names and for no numbers."""
    for name, value in values.items():
        if name not in known:
            close = get_close_matches(name, known, n=1)
            ours = ", ".join(each for each in known if each.islower())
            hint = f"did you mean {close[0]!r}?" if close else f"known: {ours}"
            raise ValueError(f"unknown {kind} parameter {name!r} ({hint})")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError(f"{name} must be a number, got {value!r}")
    return {name: float(value) for name, value in values.items()}


def built(kind: str, profile: str, ours: Mapping[str, float]) -> tuple[Body, Tuning]:
    """Return the constants and gains of a robot with overrides in SI units; raise ValueError."""
    check_range(kind, profile, ours)
    body, tuning = body_and_tuning(kind, profile)
    if isinstance(body, QuadcopterParams) and isinstance(tuning, QuadcopterTuning):
        body, tuning = with_changes(body, ours), with_changes(tuning, ours)
        _check_quadcopter(body)
    elif isinstance(body, RoverParams) and isinstance(tuning, RoverTuning):
        body, tuning = with_changes(body, ours), with_changes(tuning, ours)
        check_rover(body, tuning, control_every(profile) * PHYSICS_DT)
    return body, tuning


def check_range(kind: str, profile: str, ours: Mapping[str, float]) -> None:
    """Raise ValueError for values far from the usual ones, whatever else the robot has."""
    known = numbers(kind, profile)
    for name, value in ours.items():
        usual = abs(known[name])
        if value and usual and not usual / RANGE <= abs(value) <= usual * RANGE:
            raise ValueError(
                f"{name} = {value:g} is not within {usual / RANGE:g} to {usual * RANGE:g}"
            )


def with_changes(parameters: P, values: Mapping[str, float]) -> P:
    """Return `parameters` with those of `values` that it has; it checks itself."""
    own = {field.name for field in fields(parameters)}
    changes: dict[str, Any] = {name: value for name, value in values.items() if name in own}
    return replace(parameters, **changes)


def _check_quadcopter(p: QuadcopterParams) -> None:
    """Raise ValueError for a body that full torque would spin up beyond reason in one step."""
    torque = p.max_rotor_thrust * p.arm_length
    for name, inertia in (("inertia_x", p.inertia_x), ("inertia_y", p.inertia_y)):
        if torque / inertia * PHYSICS_DT > _MAX_RATE_STEP:
            raise ValueError(
                f"{name} {inertia} kg m^2 is too small for steps of {PHYSICS_DT} s "
                f"under {torque:.2g} N m: raise it, or lower arm_length or max_rotor_speed"
            )


def check_rover(p: RoverParams, t: RoverTuning, control_dt: float) -> None:
    """Raise ValueError for wheel loops too fast for the control rate (they would oscillate)."""
    per_speed = 2 * t.wheel_p / p.wheel_radius**2
    forward = (per_speed + p.drag_linear) / p.mass
    turning = (per_speed * p.half_track**2 + p.drag_angular) / p.inertia_b
    for name, rate in (("mass", forward), ("inertia", turning)):
        if rate * control_dt > 1:
            raise ValueError(
                f"{name} is too small for steps of {control_dt} s: "
                f"raise it (or wheel_radius), or lower wheel_p or the drag"
            )
