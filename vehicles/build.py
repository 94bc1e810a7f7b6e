"""From a vehicle's configuration to its robot; the parameters that a user may set by name."""

from collections.abc import Mapping
from dataclasses import fields, replace
from difflib import get_close_matches
from math import cos, sin
from typing import Any, TypeVar

from . import quadcopter_control, rover_control
from .config import VehicleConfig
from .disturbance import BodyForce
from .quadcopter import QuadcopterParams, QuadcopterState
from .quadcopter_control import QuadcopterControl, QuadcopterTuning
from .quadcopter_robot import Quadcopter
from .robot import Robot
from .rover import RoverParams, RoverState
from .rover_control import RoverControl, RoverTuning
from .rover_robot import Rover

PHYSICS_DT = 0.002  # s; measured against 2 kHz in the tests

_RANGE = 100.0  # a parameter may be so many times its usual value, or less by as much
_MAX_RATE_STEP = 10.0  # rad/s in one physics step

ParameterSet = QuadcopterParams | QuadcopterTuning | RoverParams | RoverTuning
_P = TypeVar("_P", QuadcopterParams, QuadcopterTuning, RoverParams, RoverTuning)


def make_robot(config: VehicleConfig) -> Robot:
    """Return the robot of `config`, standing at its start with motors off."""
    control_every = 1 if config.profile == "paper" else 2
    control_dt = control_every * PHYSICS_DT
    overrides = _checked(config.kind, config.profile, config.params)
    force = BodyForce(config.disturbance, config.seed, config.system_id, PHYSICS_DT)
    if config.kind == "quadcopter":
        params = _override(QuadcopterParams(), overrides)
        tuning = _override(quadcopter_control.PROFILES[config.profile], overrides)
        _check_quadcopter(params)
        return Quadcopter(
            params,
            QuadcopterControl(params, tuning, control_dt),
            QuadcopterState(
                config.north,
                config.east,
                config.down,
                qw=cos(config.yaw / 2),
                qz=sin(config.yaw / 2),
            ),
            force,
            PHYSICS_DT,
            control_every,
        )
    rover_params = _override(RoverParams(), overrides)
    rover_tuning = _override(rover_control.PROFILES[config.profile], overrides)
    _check_rover(rover_params, rover_tuning, control_dt)
    return Rover(
        rover_params,
        RoverControl(rover_params, rover_tuning, control_dt),
        RoverState(config.north, config.east, config.yaw),
        config.down,
        force,
        PHYSICS_DT,
        control_every,
    )


def parameter_names(kind: str, profile: str = "default") -> dict[str, float]:
    """Return every parameter of a kind of vehicle by name, with its value in a gain profile."""
    parts: tuple[ParameterSet, ...]
    if kind == "quadcopter":
        parts = (QuadcopterParams(), quadcopter_control.PROFILES[profile])
    else:
        parts = (RoverParams(), rover_control.PROFILES[profile])
    return {
        field.name: getattr(part, field.name)
        for part in parts
        for field in fields(part)
        if isinstance(getattr(part, field.name), float)
    }


def _checked(kind: str, profile: str, params: Mapping[str, float]) -> dict[str, float]:
    """Return `params` as floats; raise ValueError for a name that does not exist."""
    known = parameter_names(kind, profile)
    checked = {}
    for name, value in params.items():
        if name not in known:
            close = get_close_matches(name, known, n=1)
            hint = f"did you mean {close[0]!r}?" if close else f"known: {', '.join(known)}"
            raise ValueError(f"unknown {kind} parameter {name!r} ({hint})")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError(f"{name} must be a number, got {value!r}")
        usual = abs(known[name])
        if value and usual and not usual / _RANGE <= abs(value) <= usual * _RANGE:
            raise ValueError(
                f"{name} = {value:g} is not within {usual / _RANGE:g} to {usual * _RANGE:g}"
            )
        checked[name] = float(value)
    return checked


def _override(parameters: _P, values: Mapping[str, float]) -> _P:
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


def _check_rover(p: RoverParams, t: RoverTuning, control_dt: float) -> None:
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
