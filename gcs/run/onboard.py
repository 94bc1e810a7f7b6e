"""What a vehicle of a scenario is started with, in a process of its own or in ours."""

from math import pi

from ...scenarios.schema import RobotSpec, Scenario
from ...vehicles.config import VehicleConfig
from ..station import STACKS


def vehicle_config(scenario: Scenario, spec: RobotSpec) -> VehicleConfig:
    """Return what the vehicle of `spec`, at the start that was drawn for it, needs to know."""
    team, stack = scenario.team, STACKS[spec.autopilot]
    return VehicleConfig(
        kind=spec.kind,
        system_id=spec.system_id,
        name=spec.name,
        origin=scenario.origin,
        north=spec.start.north,
        east=spec.start.east,
        down=-(spec.start.up or 0.0),
        yaw=pi / 2 - spec.heading,
        autopilot=spec.autopilot,
        profile=spec.profile,
        params={stack.loss_parameter: team.setpoint_timeout_s, **spec.params},
        disturbance=spec.disturbance or scenario.disturbance,
        seed=scenario.seed,
        latch_position=False,
    )
