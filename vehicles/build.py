"""From a vehicle's configuration to its robot; the parameters that a user may set by name."""

from collections.abc import Callable, Mapping
from dataclasses import fields
from math import cos, sin

from .config import VehicleConfig
from .disturbance import BodyForce
from .parameters.overrides import (
    PHYSICS_DT,
    P,
    accepted_names,
    built,
    check_range,
    check_rover,
    control_every,
    in_our_units,
    plain,
    with_changes,
)
from .parameters.profile import numbers
from .quadcopter import QuadcopterParams, QuadcopterState
from .quadcopter_control import QuadcopterControl
from .quadcopter_robot import Quadcopter
from .quadcopter_tuning import QuadcopterTuning
from .robot import Robot
from .rover import RoverParams, RoverState
from .rover_control import RoverControl, RoverTuning
from .rover_robot import Rover

__all__ = ["PHYSICS_DT", "accepted_names", "make_robot", "parameter_names", "parameter_values"]


def make_robot(config: VehicleConfig) -> Robot:
    """Return the robot of `config`, standing at its start with motors off."""
    ours = in_our_units(config.kind, config.autopilot, config.profile, config.params)
    body, tuning = built(config.kind, config.profile, ours)
    if isinstance(body, QuadcopterParams) and isinstance(tuning, QuadcopterTuning):
        return _quadcopter(config, body, tuning)
    if isinstance(body, RoverParams) and isinstance(tuning, RoverTuning):
        return _rover(config, body, tuning)
    raise TypeError(f"{body} does not go with {tuning}")


def parameter_names(kind: str, profile: str = "default") -> dict[str, float]:
    """Return every constant and gain of a kind of vehicle by name, with its value in a profile."""
    return dict(numbers(kind, profile))


def parameter_values(
    kind: str, profile: str, params: Mapping[str, float], autopilot: str = "ardupilot"
) -> dict[str, float]:
    """Return the constants and gains of a vehicle with overrides, SI; raise ValueError."""
    return {**numbers(kind, profile), **in_our_units(kind, autopilot, profile, params)}


def _quadcopter(
    config: VehicleConfig, body: QuadcopterParams, tuning: QuadcopterTuning
) -> Quadcopter:
    every = control_every(config.profile)
    return Quadcopter(
        body,
        QuadcopterControl(body, tuning, every * PHYSICS_DT),
        QuadcopterState(
            config.north,
            config.east,
            config.down,
            qw=cos(config.yaw / 2),
            qz=sin(config.yaw / 2),
        ),
        BodyForce(config.disturbance, config.seed, config.system_id, PHYSICS_DT),
        PHYSICS_DT,
        every,
        _retuner(config, _any_tuning),
    )


def _rover(config: VehicleConfig, body: RoverParams, tuning: RoverTuning) -> Rover:
    every = control_every(config.profile)

    def fits(tuning: RoverTuning) -> None:
        check_rover(body, tuning, every * PHYSICS_DT)

    return Rover(
        body,
        RoverControl(body, tuning, every * PHYSICS_DT),
        RoverState(config.north, config.east, config.yaw),
        config.down,
        BodyForce(config.disturbance, config.seed, config.system_id, PHYSICS_DT),
        PHYSICS_DT,
        every,
        _retuner(config, fits),
    )


def _any_tuning(_: QuadcopterTuning) -> None:
    """Be content: a quadcopter's gains check themselves."""


def _retuner(
    config: VehicleConfig, check: Callable[[P], None]
) -> Callable[[P, Mapping[str, float]], P]:
    """Return a function that returns a tuning with changes, or raises ValueError."""

    def retuned(tuning: P, changes: Mapping[str, float]) -> P:
        values = plain(changes, numbers(config.kind, config.profile), config.kind)
        check_range(config.kind, config.profile, values)
        own = {field.name for field in fields(tuning)}
        if fixed := sorted(values.keys() - own):
            raise ValueError(f"{', '.join(fixed)} cannot change while the vehicle runs")
        changed = with_changes(tuning, values)
        check(changed)
        return changed

    return retuned
